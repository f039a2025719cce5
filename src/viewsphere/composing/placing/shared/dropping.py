"""Things that are dropped and come to rest, for several placers."""

from __future__ import annotations

import hashlib
import json
import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.caches.arrays import Content
from viewsphere.caches.entries import cached
from viewsphere.composing.physics import LONGEST_S, Board, Body, Touch, World, body_of, needed
from viewsphere.composing.placing import Draws, Footprint, Room, Shape, Way, draws_of
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Portion, Positive, Strength
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.draws import Drawn, drawn

SETTINGS = {
    "threshold": 0.08,
    "max_convex_hull": 16,
    "preprocess_resolution": 30,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "resolution": 1000,
    "seed": 1,
}
"""coacd's defaults take up to thirty times as long, without better results at rest."""


Float = NDArray[np.float64]

TRIES = 10
"""Number of draws of a fall; the first valid one is used."""

HASTY_S = 5.0
"""Simulated seconds to come to rest, for all tries but the last: most need half of them, and another draw is faster than
waiting for something that trembles on.
"""

ROUNDS = 2
"""Number of times that things which missed are dropped again, per thing of the cast."""

SPOTS = 12
"""Number of tried spots for each dropped thing; the lowest is used."""

MOST_OVERLAP = 0.002
"""Largest overlap of two things at rest, metres."""

CLEAR = 0.001
"""Largest overlap of things caught in flight, where some hit others, metres."""

FENCE, GAP = 50.0, 0.001
"""Height of fences, in lengths of the longest thing, and their distance from dropped things, metres."""

RECORDED = 5
"""Simulation steps between two states of a path."""


class Matter(Frozen):
    """The physical material of things; each value is drawn separately for each thing."""

    density: Drawn[Positive] = Field(default=300.0, description="density of the thing's hull, kg per cubic metre")
    mass: Drawn[Positive] | None = Field(default=None, description="mass in kg, instead of density")
    friction: Drawn[Strength] = Field(default=0.8, description="coefficient of sliding friction: 0.1 ice, 0.8 wood, 1 rubber")
    restitution: Drawn[Portion] = Field(default=0.0, description="share of the speed left after a bounce")
    collide: Literal["hulls", "parts"] = Field(
        default="hulls",
        description="hulls: things collide as convex hulls; parts: as convex parts (CoACD, seconds per model once), for "
        "chairs, mugs and other things that hold things",
    )
    drop: Drawn[Length] = Field(default=0.05, description="gap below each thing on release, metres")


@dataclass(frozen=True, eq=False)
class Ground:
    """The boards on which things fall, and the region where they must stay.
    The region is a rectangle of z = 0, with the things' lowest points at most at `height`; None allows any position.
    """

    boards: tuple[Board, ...] = ()
    within: Footprint | None = None
    height: float = math.inf


@dataclass(eq=False)
class Drop:
    """A cast that falls in a room."""

    cast: Sequence[ModelSpec]
    room: Room
    shapes: Sequence[Shape]
    rng: Draws
    options: Matter
    ground: Ground
    region: Footprint
    _bodies: list[Body] = field(default_factory=list[Body])

    def __post_init__(self) -> None:
        self._bodies = [self._body(i) for i in range(len(self.cast))]

    @property
    def typical(self) -> float:
        """Length of the typical thing, metres."""
        return float(np.median([shape.length for shape in self.shapes]))

    def rested(self) -> dict[str, Any]:
        """Plain data: `poses` of all things at rest and, if the room needs their paths, `ways`: seconds and states."""
        return self._best("rest")

    def caught(self) -> dict[str, Any]:
        """The same data for things caught while they fall, at a moment before the last one lands."""
        return self._best("mid")

    def _best(self, moment: str) -> dict[str, Any]:
        problems: list[tuple[float, str]] = []
        for number in range(TRIES):
            made, problem = self._once(str(number), moment, LONGEST_S if number == TRIES - 1 else HASTY_S)
            if problem is None:
                return made
            problems.append(problem)
        raise RecipeError(f"{self.room.field}.layout: {min(problems)[1]} (the best of {TRIES} draws)")

    def _once(self, number: str, moment: str, longest_s: float) -> tuple[dict[str, Any], tuple[float, str] | None]:
        """Return the result of one draw, and for a bad result its badness, as a number and in words."""
        places = [self._spheres(i) for i in range(len(self.cast))]
        starts = self._starts(number, range(len(self.cast)), places, [])
        high = FENCE * max(shape.length for shape in self.shapes)
        fences = _fences(self._enclosed(self.ground.within, starts), high) if self.ground.within else ()
        fixed = [(body_of(self._parts(shape), 1.0), pose) for shape, pose in self.room.taken]
        world = World(self._bodies, starts, (*self.ground.boards, *fences), self.typical, -self.room.below, fixed)
        if moment == "mid":
            return self._flying(world, number), None
        film = _Film(world) if self.room.moves else None
        settle = partial(world.settle, longest_s, each=RECORDED, look=film.shoot) if film else partial(world.settle, longest_s)
        calm = settle(rest_s=0.0) if fences else settle()
        if fences and calm:
            world.take_fences_away()
            calm = settle(is_calm=True) if film else self._kept(world, number, places, longest_s)
        made: dict[str, Any] = {"poses": world.poses}
        return made | ({"ways": film.ways} if film else {}), self._problem(world, calm, bool(film))

    def _enclosed(self, within: Footprint, starts: Sequence[Matrix4]) -> Footprint:
        """The region for the fences: `within`, enlarged to hold all released things, since fences would catch wider ones."""
        corners = [transform(np.array(pose), body.corners)[:, :2] for body, pose in zip(self._bodies, starts, strict=True)]
        reach = np.abs((np.concatenate(corners) - within.center) @ within.axes.T).max(axis=0)
        return replace(within, half=np.maximum(within.half, reach + GAP))

    def _kept(self, world: World, number: str, places: Sequence[tuple[Float, float]], longest_s: float) -> bool:
        """Simulate until all things are at rest in their region, and return whether they are. Things that leave the region are
        dropped again at once, before they roll away; things that are too high are dropped again when they are at rest.
        """
        again, most = 0, ROUNDS * len(self.cast)

        def let_go(slots: Sequence[int]) -> None:
            nonlocal again
            for i in slots:
                again += 1
                (pose,) = self._starts(f"{number} {again}", [i], places, self._lying(world, slots))
                world.put(i, pose)

        def watch() -> None:
            let_go(self._beside(world, math.inf) if again < most else ())

        calm = world.settle(longest_s, look=watch, is_calm=True)
        while calm and again < most and (high := self._beside(world, self.ground.height)):
            let_go(high)
            calm = world.settle(longest_s, look=watch)
        return calm

    def _problem(self, world: World, calm: bool, moves: bool) -> tuple[float, str] | None:
        beside = [] if moves else self._beside(world, self.ground.height)
        if beside:
            inside = len(self.cast) - len(beside)
            found = f"found {inside} inside, {self.cast[beside[0]].key} not: ask for fewer, or for more room"
            return 2.0 + len(beside), f"expected room for {len(self.cast)} models; {found}"
        if not calm:
            return 1.0, f"expected models that come to rest; found one at {1000 * world.speed:.2g} mm/s: ask for more friction"
        if world.deepest > MOST_OVERLAP:
            found = f"found {1000 * world.deepest:.2g} mm: ask for fewer, or for models of more alike sizes"
            return world.deepest, f"expected models at rest that overlap by {1000 * MOST_OVERLAP:g} mm at most; {found}"
        return None

    def _flying(self, world: World, number: str) -> dict[str, Any]:
        landed, frames = set[int](), list[tuple[float, tuple[Matrix4, ...]]]()
        while len(landed) < len(self.cast) and world.seconds < 60:
            if world.deepest <= CLEAR:
                frames.append((world.seconds, world.poses))
            world.step(RECORDED)
            landed.update(i for pair in world.touching if -1 in pair or landed.intersection(pair) for i in pair if i >= 0)
        wanted = world.seconds * float(self.rng("moment", number).random())
        return {"poses": min(frames, key=lambda frame: abs(frame[0] - wanted))[1]}

    def _body(self, slot: int) -> Body:
        spec, shape = self.cast[slot], self.shapes[slot]
        own = drawn(self.options, draws_of(self.rng, str(slot), spec.key))
        return body_of(self._parts(shape), own.density, own.mass, Touch(own.friction, own.restitution))

    def _parts(self, shape: Shape) -> list[Float]:
        return [shape.hull] if self.options.collide == "hulls" else _convex_parts(shape)

    def _spheres(self, slot: int) -> tuple[Float, float]:
        """Centre (3,) and radius of a ball around a thing, in its own axes."""
        box = self.shapes[slot].box
        return box.mean(axis=0), float(np.linalg.norm(box[0] - box.mean(axis=0)))

    def _lying(self, world: World, without: Sequence[int]) -> list[tuple[Float, float]]:
        """Balls around the things that are already there, world axes."""
        circles: list[tuple[Float, float]] = []
        for i, pose in enumerate(world.poses):
            if i not in without:
                middle, radius = self._spheres(i)
                circles.append((transform(np.array(pose), middle), radius))
        return circles

    def _starts(
        self, number: str, slots: Sequence[int], places: Sequence[tuple[Float, float]], there: list[tuple[Float, float]]
    ) -> list[Matrix4]:
        """Return the poses at release: over the region, turned at random about the vertical, as low as clears the earlier
        things.
        """
        balls = [*there, *(_ball(shape, pose) for shape, pose in self.room.taken)]
        poses: list[Matrix4] = []
        for slot in slots:
            middle, radius = places[slot]
            rng = self.rng("release", number, str(slot), self.cast[slot].key)
            air = drawn(self.options.drop, draws_of(self.rng, "drop", number, str(slot), self.cast[slot].key))
            reach = np.maximum(self.region.half - radius, 0.0)
            spots = self.region.center + (2 * rng.random((SPOTS, 2)) - 1) * reach @ self.region.axes
            bottom = radius if balls else float(middle[2] - self.shapes[slot].box[:, 2].min())
            x, y, z = min(((*spot, _clear(spot, radius, balls, bottom + air, air)) for spot in spots), key=lambda p: p[2])
            balls.append((np.array([x, y, z]), radius))
            poses.append(_turned(middle, (x, y, z), 2 * math.pi * rng.random()))
        return poses

    def _beside(self, world: World, height: float) -> list[int]:
        """Numbers of things whose middle is not over their region, or whose lowest point is above this height."""
        within = self.ground.within
        if within is None:
            return []
        beside: list[int] = []
        for i, pose in enumerate(world.poses):
            middle = transform(np.array(pose), self._spheres(i)[0])
            is_on = (np.abs((middle[:2] - within.center) @ within.axes.T) <= within.half).all()
            if not is_on or middle[2] < 0 or (height < math.inf and self._lowest(i, pose) > height):
                beside.append(i)
        return beside

    def _lowest(self, slot: int, pose: Matrix4) -> float:
        return float(transform(np.array(pose), self._bodies[slot].corners)[:, 2].min())


class _Film:
    """The states of a world's bodies, one after another."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._seconds, self._states = [0.0], [world.states]

    def shoot(self) -> None:
        self._seconds.append(self._world.seconds)
        self._states.append(self._world.states)

    @property
    def ways(self) -> dict[str, Any]:
        """The paths until all things are at rest."""
        count = bisect_right(self._seconds, self._world.seconds)
        states = np.round(np.array(self._states[:count]), 6) + 0.0
        return {"seconds": np.round(self._seconds[:count], 6).tolist(), "states": states.transpose(1, 0, 2).tolist()}


def ways_of(made: dict[str, Any]) -> list[Way]:
    """The paths stored in plain data."""
    seconds = tuple(made["ways"]["seconds"])
    return [Way(seconds, tuple(map(tuple, states))) for states in made["ways"]["states"]]


def poses_of(made: dict[str, Any]) -> list[Matrix4]:
    """The poses stored in plain data."""
    poses: list[Any] = [tuple(map(tuple, pose)) for pose in made["poses"]]
    return poses


def _ball(shape: Shape, pose: Matrix4) -> tuple[Float, float]:
    middle = shape.box.mean(axis=0)
    return transform(np.array(pose), middle), float(np.linalg.norm(shape.box[0] - middle))


def _clear(spot: Float, radius: float, balls: Sequence[tuple[Float, float]], lowest: float, air: float) -> float:
    """Return the lowest height at which a ball at a spot is clear of the others, with some air between."""
    height = lowest
    for middle, other in balls:
        reach, off = radius + other + air, float(np.hypot(*(spot - middle[:2])))
        if off < reach:
            height = max(height, float(middle[2]) + math.sqrt(reach**2 - off**2))
    return height


def _turned(middle: Float, at: tuple[float, float, float], turn: float) -> Matrix4:
    """A pose turned about the vertical, with its middle at `at`."""
    c, s = math.cos(turn), math.sin(turn)
    x, y, z = at[0] - c * middle[0] + s * middle[1], at[1] - s * middle[0] - c * middle[1], at[2] - middle[2]
    return ((c, -s, 0.0, float(x)), (s, c, 0.0, float(y)), (0.0, 0.0, 1.0, float(z)), (0.0, 0.0, 0.0, 1.0))


def _fences(around: Footprint, height: float) -> list[Board]:
    """Four boards around a rectangle."""
    turn = math.atan2(around.axes[0, 1], around.axes[0, 0])
    thick, boards = float(around.half.max()), list[Board]()
    for axis, side in ((0, 1), (0, -1), (1, 1), (1, -1)):
        half = [float(h) + 2 * thick for h in around.half]
        half[axis] = thick
        x, y = (around.center + side * (around.half[axis] + thick) * around.axes[axis]).tolist()
        boards.append(Board((x, y, height / 2), (half[0], half[1], height / 2), turn, is_fence=True))
    return boards


def _convex_parts(shape: Shape) -> list[Float]:
    """Corners (N, 3) of the convex parts of a model, by CoACD (Wei et al. 2022); together they cover the model. They are cached
    by the mesh's digest. Raises ModelError if the model's file cannot be used, MissingExtraError without coacd.
    """
    if shape.surface is None:
        return [shape.hull]
    vertices, triangles = shape.surface()
    digest = hashlib.sha256(json.dumps(SETTINGS).encode() + vertices.tobytes() + triangles.tobytes()).hexdigest()
    return cached("parts", digest, lambda: _parted(vertices, triangles), _plain, lambda content: list(content.arrays.values()))


def _plain(parts: list[Float]) -> Content:
    return Content(None, {f"{i}": part for i, part in enumerate(parts)})


def _parted(vertices: Float, triangles: NDArray[np.int32]) -> list[Float]:
    coacd = needed("coacd")
    trimesh = needed("trimesh")

    coacd.set_log_level("error")
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # else every seam of a texture is an open edge
    found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **SETTINGS)
    return [np.round(np.asarray(corners, np.float64), 9) for corners, _ in found]
