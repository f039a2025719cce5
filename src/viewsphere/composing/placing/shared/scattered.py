"""Scattering for several placers: things are placed one after another, each at a free spot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.placing import Draws, Footprint, Room, Shape, footprint, outline
from viewsphere.composing.placing.shared.crowd import TakenMap, inner_class
from viewsphere.composing.placing.shared.spot import Cover, Others
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.hull import convex_hull
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4

Spot = Callable[[np.random.Generator, Room, NDArray[np.float64], Others, Cover], Matrix4 | None]
"""Finds a pose for a box in a room, clear of the other things."""


class Gaps(Frozen):
    """Options of how closely models stand."""

    between: Literal["boxes", "hulls"] = Field(
        default="boxes",
        description="gap between boxes, or between hulls as seen from above, which lets models stand closer",
    )


def scattered(
    cast: Sequence[ModelSpec],
    room: Room,
    shapes: Sequence[Shape],
    rng: Draws,
    options: Gaps,
    spot: Spot,
    floor: Footprint | None = None,
) -> Sequence[Matrix4]:
    """Poses with no two boxes, or hulls, nearer than the room's gap, and none nearer to the place's mesh; raises RecipeError if
    no spot is found for a model. Slot and key seed the draws of each member. `floor`: the floor of the spots, by default the
    room's.
    """
    reach = _reach(floor, room, shapes)
    room = room.obstacles(shapes, reach)
    poses: list[Matrix4] = []
    of_hulls = options.between == "hulls"
    covers: list[Cover] = [
        partial(outline, _seen_from_above(shape)) if of_hulls else partial(footprint, shape.box) for shape in shapes
    ]
    slims = {inner_class(cover(IDENTITY).circle.inner) for cover in covers}
    others = Others(tuple(TakenMap.empty(room.gap, slim, reach) for slim in sorted(slims)))
    for shape, pose in room.taken:
        others.add(outline(shape.vertices(), pose) if of_hulls else footprint(shape.box, pose))
    for slot, (spec, shape, cover) in enumerate(zip(cast, shapes, covers, strict=True)):
        pose = spot(rng(str(slot), spec.key), room, shape.box, others, cover)
        if pose is None:
            _check_size(spec, shape, floor or room.free, room.field)
            raise RecipeError(
                f"{room.field}: expected room for {len(others.crowd.covers) + len(cast) - slot} models; found none for "
                f"{spec.key}: ask for fewer, or for a smaller gap"
            )
        poses.append(pose)
        others.add(cover(pose))
    return poses


def _check_size(spec: ModelSpec, shape: Shape, floor: Footprint | None, field: str) -> None:
    """Raise RecipeError for a model that is larger than the floor at every turn."""
    size = Box3d(shape.box).diagonal[:2]
    if floor is None or (size.min() <= 2 * floor.half.min() and size.max() <= 2 * np.linalg.norm(floor.half)):
        return
    (width, length), (across, along) = size.tolist(), (2 * floor.half).tolist()
    raise RecipeError(
        f"{field}: {spec.key} covers {width:.3g} x {length:.3g} m, and the free floor has {across:.3g} x {along:.3g} m. Use a "
        "smaller model, set its `scale`, or choose a larger surface or place"
    )


def _reach(floor: Footprint | None, room: Room, shapes: Sequence[Shape]) -> float:
    """Metres from the middle to the farthest spot: the end of the floor or, if nearer, twice the side of a square that holds
    the models at any turn.
    """
    widths = [float(np.linalg.norm(Box3d(shape.box).diagonal[:2])) + room.gap for shape in shapes]
    heap = 2 * float(np.linalg.norm(widths))
    if floor is not None:
        return float(np.abs(floor.corners).max())
    return heap if room.free is None else min(heap, float(np.abs(room.free.corners).max()))


def _seen_from_above(shape: Shape) -> NDArray[np.float64]:
    """Points (N, 3) of a model that cover the same floor as the whole model, at any turn about the vertical."""
    return np.insert(convex_hull(shape.vertices()[:, :2]), 2, 0.0, axis=1)
