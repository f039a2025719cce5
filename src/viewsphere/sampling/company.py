"""Several targets at once: who stands beside whom, and where, without standing in one another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.scenery import CompanyEntry
from viewsphere.sampling.seeds import generator, share

Float = NDArray[np.float64]

TRIES = 2000
"""Spots that are tried for one model; the circle they lie in grows with each."""

GROWTH = 0.01

Names = tuple[str, ...]
"""What a draw is for: nothing, a model's key, or a model's key and a pose's name."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """An oriented rectangle on the floor: centre (2,), unit axes as rows (2, 2), half sizes (2,); metres."""

    center: Float
    axes: Float
    half: Float

    def apart(self, other: Footprint, gap: float) -> bool:
        """Whether a side of one of the two separates them by at least `gap`: then nothing of them is nearer than that."""
        between = other.center - self.center
        for axis in (*self.axes, *other.axes):
            reach = sum(float(np.abs(f.axes @ axis) @ f.half) for f in (self, other))
            if abs(float(between @ axis)) - reach >= gap - 1e-9:
                return True
        return False

    def contains(self, other: Footprint) -> bool:
        """Whether all of the other lies in this one."""
        return bool((np.abs((other.corners - self.center) @ self.axes.T) <= self.half + 1e-9).all())

    @property
    def corners(self) -> Float:
        """The four corners, (4, 2)."""
        a, b = self.axes * self.half[:, None]
        return self.center + np.array([a + b, a - b, -a - b, b - a])


def footprint(box: Float, world_from_object: Matrix4) -> Footprint:
    """What a model with this box (8, 3), in its own axes, covers of the floor where it stands upright."""
    m = np.array(world_from_object)
    low, high = box[2, :2], box[4, :2]
    return Footprint(m[:2, :2] @ ((low + high) / 2) + m[:2, 3], m[:2, :2].T, (high - low) / 2)


def standing(box: Float, x: float = 0.0, y: float = 0.0, azimuth_deg: float = 0.0) -> Matrix4:
    """World from object for a model with this box that stands on the floor, its origin above (x, y).

    Its front faces the azimuth: where a camera of that azimuth stands.
    """
    quarters, rest = divmod(azimuth_deg, 90.0)
    c, s = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    if rest == 0:  # exact
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return ((c, 0.0 - s, 0.0, x), (s, c, 0.0, y), (0.0, 0.0, 1.0, 0.0 - float(box[2, 2])), (0.0, 0.0, 0.0, 1.0))


def companions(seed: int, spec: ModelSpec, others: Iterable[ModelSpec], count: int, names: Names) -> tuple[ModelSpec, ...]:
    """`count` of `others` to stand beside a model, which is none of them.

    Each place goes to the one whose number for it is lowest (rendezvous hashing): one model more in the recipe changes
    only the places that it takes.
    """
    left = {other.key: other for other in others if other.key != spec.key}
    chosen: list[ModelSpec] = []
    for slot in range(count):
        key = min(left, key=lambda k: (share(seed, "company", *names, str(slot), k), k))
        chosen.append(left.pop(key))
    return tuple(chosen)


def layout(
    entry: CompanyEntry,
    seed: int,
    specs: Sequence[ModelSpec],
    boxes: Sequence[Float],
    names: Names,
    free: Footprint | None = None,
) -> tuple[Matrix4, ...]:
    """Where each of `specs` stands, the first one at the origin, facing -Y; all on the floor.

    `boxes[i]` (8, 3) is theirs; `free` what there is room in. Raises RecipeError where two would stand in one
    another, or where there is no room.
    """
    if isinstance(entry.layout, tuple):
        spots = ((0.0, 0.0, 0.0), *entry.layout)
        placed = tuple(standing(box, *spot) for box, spot in zip(boxes, spots, strict=True))
    elif entry.layout == "row":
        placed = _row(boxes, entry.gap)
    else:
        placed = _random(entry, seed, specs, boxes, names, free)
    _check(entry, specs, [footprint(b, m) for b, m in zip(boxes, placed, strict=True)], free)
    return placed


def _check(entry: CompanyEntry, specs: Sequence[ModelSpec], prints: Sequence[Footprint], free: Footprint | None) -> None:
    for i, own in enumerate(prints):
        for j in range(i):
            if not own.apart(prints[j], entry.gap):
                raise RecipeError(
                    f"scene.company.layout: expected {entry.gap:g} m between all models; found {specs[j].key} and "
                    f"{specs[i].key} nearer or in one another: move them, or use layout: random"
                )
        if i and free and not free.contains(own):
            raise RecipeError(
                f"scene.company.layout: expected all models in the free part of the place; found {specs[i].key} beyond it"
            )


def _row(boxes: Sequence[Float], gap: float) -> tuple[Matrix4, ...]:
    """Side by side along X, right and left of the first in turn."""
    placed = [standing(boxes[0])]
    left, right = float(boxes[0][2, 0]), float(boxes[0][4, 0])
    for i, box in enumerate(boxes[1:]):
        low, high = float(box[2, 0]), float(box[4, 0])
        if i % 2 == 0:
            placed.append(standing(box, right + gap - low))
            right += gap + high - low
        else:
            placed.append(standing(box, left - gap - high))
            left -= gap + high - low
    return tuple(placed)


def _random(
    entry: CompanyEntry, seed: int, specs: Sequence[ModelSpec], boxes: Sequence[Float], names: Names, free: Footprint | None
) -> tuple[Matrix4, ...]:
    """One after another: uniform in a circle that grows until there is room."""
    placed = [standing(boxes[0])]
    prints = [footprint(boxes[0], placed[0])]
    widest = math.inf if free is None else float(np.linalg.norm(free.corners, axis=1).max())
    for slot, (spec, box) in enumerate(zip(specs[1:], boxes[1:], strict=True)):
        rng = generator(seed, "layout", *names, str(slot), spec.key)
        radius = float(prints[0].half.min() + (box[4] - box[2])[:2].min() / 2) + entry.gap  # nearer there is no room
        for _ in range(TRIES):
            turn, far, azimuth = rng.random(3)
            x, y = (radius * math.sqrt(far) * f(2 * math.pi * turn) for f in (math.cos, math.sin))
            move = standing(box, x, y, 360.0 * float(azimuth))
            own = footprint(box, move)
            if (free is None or free.contains(own)) and all(own.apart(other, entry.gap) for other in prints):
                break
            radius = min((1 + GROWTH) * radius, widest)
        else:
            raise RecipeError(
                f"scene.company: expected room for {len(specs)} models; found none for {spec.key}: ask for fewer, or for a "
                "smaller gap"
            )
        placed.append(move)
        prints.append(own)
    return tuple(placed)
