"""The limits that walls set for cameras: a camera stays inside the model's room, and never goes through a wall."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.composing.viewpoints.camera import inside_box
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.classes import STUFF_IDS, stuff_of
from viewsphere.model.thing import Thing

Float = NDArray[np.float64]

Step = tuple[int, Float, Float]
"""The number of a frame, and where a camera is then and in the next one, (3,) each, world metres."""

WALLS = {STUFF_IDS[name] for name in ("building", "wall", "floor", "ceiling")}
"""Classes of scenery that nobody goes through: leaves and hedges are none."""


def check_rooms(rooms: Sequence[Float], model: Float, cameras: Float) -> None:
    """Raise RecipeError for the first camera of (N, 3) in none of the rooms (8, 3), if the model's middle (3,) is in one."""
    if not any(inside_box(room, model[None])[0] for room in rooms):
        return
    for i in np.flatnonzero(~np.any([inside_box(room, cameras) for room in rooms], axis=0)):
        raise RecipeError(
            f"viewpoints: expected the camera in a room of the place, as the model is; found it beyond the walls at "
            f"{_shown(cameras[i])}: go nearer; with min_visibility, frames that are drawn at random are drawn again"
        )


def check_way(things: Iterable[tuple[Thing, Float]], mesh_of: Callable[[Thing], Mesh], steps: Sequence[Step]) -> None:
    """Raise RecipeError where one of a camera's steps goes straight through a wall.

    `things`: those that stand still, each with its box (8, 3) in the world; `mesh_of`: a thing's mesh in its own axes.
    """
    if not steps:
        return
    points = np.array([point for _, *both in steps for point in both])
    low, high = points.min(axis=0), points.max(axis=0)
    for thing, box in things:
        if thing.scenery and (low <= box.max(axis=0)).all() and (high >= box.min(axis=0)).all():
            _check_wall(thing, mesh_of(thing), steps)


def _check_wall(thing: Thing, mesh: Mesh, steps: Sequence[Step]) -> None:
    walls = _walls(thing.model.category, mesh)
    if not len(walls):
        return
    corners = transform(thing.world_from_object, mesh.vertices.astype(np.float64))[walls]
    low, high = corners.min(axis=1), corners.max(axis=1)
    for frame, a, b in steps:
        near = (np.minimum(a, b) <= high).all(axis=1) & (np.maximum(a, b) >= low).all(axis=1)
        if near.any() and _is_crossed(corners[near], a, b):
            what = f"{thing.model.category or 'piece'} {thing.key}"
            raise RecipeError(
                f"viewpoints: expected the camera's way clear of walls; found it going through {what} "
                f"between {_shown(a)} and {_shown(b)}, frames {frame} and {frame + 1}: lead the trajectory around"
            )


def _walls(category: str, mesh: Mesh) -> NDArray[np.int32]:
    """The triangles (T, 3) of scenery that nobody goes through."""
    solid = np.array([stuff_of(category, part) in WALLS for part in mesh.parts], np.bool_)
    return mesh.triangles[solid[mesh.triangle_part]]


def _is_crossed(corners: Float, a: Float, b: Float) -> bool:
    """Return whether the line from a to b (3,) goes through any of the triangles (T, 3, 3): Moeller and Trumbore 1997."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(b - a, second)
    volume = (first * across).sum(axis=1)
    kept = volume != 0
    first, second, across, volume = first[kept], second[kept], across[kept], volume[kept]
    to_a = a - corners[kept, 0]
    u = (to_a * across).sum(axis=1) / volume
    turned = np.cross(to_a, first)
    v = turned @ (b - a) / volume
    t = (second * turned).sum(axis=1) / volume
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)).any())


def _shown(point: Float) -> str:
    return f"({', '.join(f'{v:.3g}' for v in point)})"
