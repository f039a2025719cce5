"""The detection of cameras in impossible places: inside a thing, outside the model's room, or moving through a wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.composing.redraws import is_redrawn
from viewsphere.composing.viewpoints.camera import inside_box
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.annotations.classes import STUFF_IDS
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.distances import Distances
from viewsphere.planning.plan import Plan
from viewsphere.plugins.source import rooms_of
from viewsphere.run.shots.stages import Stages

DIRECTIONS = 64
"""Rays of the upper hemisphere that are cast: the share of hits has steps of 1/64."""


Float = NDArray[np.float64]

Step = tuple[int, Float, Float]
"""The number of a frame, and the camera's positions in this frame and the next, (3,) each, world metres."""

WALLS = {STUFF_IDS[name] for name in ("building", "wall", "floor", "ceiling")}
"""Classes of scenery that cameras must not pass through; leaves and hedges do not count."""

MOST_CAMERAS = 1000
"""Number of cameras checked before rendering; the rest are checked in their turn."""

MOST_SKY = 0.8
"""Maximum share of the sky that scenery may hide from a camera outside the scenery."""


@dataclass(frozen=True, eq=False)
class _Stand:
    """The place of a static thing: its box (8, 3), and the boxes of its rooms, world metres."""

    box: Float
    rooms: tuple[Float, ...]


NONE_KNOWN: Mapping[int, _Stand] = MappingProxyType({})
"""No known places."""


@dataclass(frozen=True, eq=False)
class CameraChecks:
    """Checks that the cameras of shots are neither inside things nor beyond walls."""

    stages: Stages

    def check_distances(self, planned: Plan, subject: str) -> None:
        """Raise RecipeError if a pose's camera would be inside a thing in a subject's frames."""
        problem = Distances(planned, self.stages.box).problem(subject)
        with planned.recipe.located():
            if problem:
                raise problem

    def check_scenery(self, planned: Plan) -> None:
        """Raise RecipeError if a pose's camera would be inside a house; only for recipes with the same scenery for all models.

        Scenery that is drawn for each model or frame is checked when its shot is rendered.
        """
        scene = planned.recipe.scene
        if planned.composition is None or not scene.has_fixed_scenery or is_redrawn(planned.recipe):
            return
        subject = planned.subjects[0]
        there = next(iter(planned.standing(subject, self.stages.box)), None)
        if there is None or not there.views.are_known:  # the camera's position is known with its shot
            return
        things = planned.composition.things(subject, there.things, None, self.stages.box)
        poses = range(0, planned.poses, -(-planned.poses // MOST_CAMERAS))
        cameras = Distances(planned, self.stages.box).cameras(things, poses, views=there.views)
        with planned.recipe.located():
            self._check_cameras(things, cameras)

    def _check_cameras(self, things: Sequence[Thing], cameras: Float, known: Mapping[int, _Stand] = NONE_KNOWN) -> None:
        """Raise RecipeError for the first of the cameras (N, 3) that is inside a thing; `known` has the places of some of the
        things, by their identity.

        For a target, inside means inside its box. For scenery, inside means that it hides the sky from the camera but not from
        the frame's model, because a camera may be under a tree, among hills, or in the model's room. So cameras are not checked
        in frames without a target.
        """
        own = next((i for i, thing in enumerate(things) if not thing.scenery), None)
        if own is None:
            return
        stands = [known.get(id(thing)) or self._stand(thing) for thing in things]
        boxes, model = np.array([stand.box for stand in stands]), stands[own].box.mean(axis=0)
        _check_rooms([room for stand in stands for room in stand.rooms], model, cameras)
        low, high = cameras.min(axis=0), cameras.max(axis=0)
        for k in np.flatnonzero(((boxes.min(axis=1) <= high) & (boxes.max(axis=1) >= low)).all(axis=1)).tolist():
            thing = things[k]
            for i in np.flatnonzero(inside_box(boxes[k], cameras)):
                if not thing.scenery or (self._roofs(thing, cameras[i]) and not self._roofs(thing, model)):
                    what = f"{thing.model.category or 'piece'} {thing.key}"
                    x, y = np.array(thing.world_from_object)[:2, 3]
                    raise RecipeError(
                        f"viewpoints: expected the camera outside of all that is placed; found it at "
                        f"{_shown(cameras[i])} inside {what}, which stands at ({x:.3g}, {y:.3g}): go "
                        f"farther away, or, where distance is a share to fill, fill less; with min_visibility, frames that are "
                        f"drawn at random are drawn again"
                    )

    def check_shot(self, shot: Shot) -> None:
        """Raise RecipeError if a camera of a shot is inside a thing, or a trajectory leads through a wall; static things are
        checked once.
        """
        instants, sensors = range(len(shot.instants)), range(len(shot.rig.sensors))
        still = {id(thing): self._stand(thing) for thing in shot.things if thing.motion.is_still}
        for poses in dict.fromkeys(map(shot.poses_at, instants)):
            together = [instant for instant in instants if shot.poses_at(instant) == poses]
            cameras = [shot.camera(instant, sensor).center for instant in together for sensor in sensors]
            there = [thing for thing in shot.things_at(together[0]) if thing.is_there]
            self._check_cameras(there, np.array(cameras), still)
        if shot.sequence:
            fixed = [(thing, still[id(thing)].box) for thing in shot.things if id(thing) in still]
            check_way(fixed, lambda thing: self.stages.model(thing.model, thing.step), _steps(shot))

    def _stand(self, thing: Thing) -> _Stand:
        pose = thing.world_from_object
        rooms = tuple(transform(pose, box) for box in rooms_of(thing.model.source, thing.model.seed)) if thing.scenery else ()
        return _Stand(transform(pose, self.stages.box(thing.model, thing.step)), rooms)

    def check_instant(self, shot: Shot, instant: int) -> None:
        """Raise RecipeError if a camera of a shot is inside a thing at an instant, counted from 0 in the shot."""
        self.check_shot(shot.model_copy(update={"instants": (shot.instants[instant],), "things": shot.things_at(instant)}))

    def _roofs(self, thing: Thing, point: Float) -> bool:
        """Return whether scenery hides most of the sky from a point in the world."""
        mesh = self.stages.model(thing.model, thing.step)
        inside = transform(np.linalg.inv(np.array(thing.world_from_object)), point)
        return sky_occlusion(mesh.vertices.astype(np.float64), mesh.triangles, inside) > MOST_SKY


def _steps(shot: Shot) -> list[Step]:
    """The steps from each frame to the next one, if the shot has both."""
    pairs = enumerate(pairwise(shot.instants))
    return [(a.index, shot.camera(i, 0).center, shot.camera(i + 1, 0).center) for i, (a, b) in pairs if b.index == a.index + 1]


def _check_rooms(rooms: Sequence[Float], model: Float, cameras: Float) -> None:
    """Raise RecipeError for the first camera of (N, 3) in none of the rooms (8, 3), if the model's middle (3,) is in one."""
    if not any(inside_box(room, model[None])[0] for room in rooms):
        return
    for i in np.flatnonzero(~np.any([inside_box(room, cameras) for room in rooms], axis=0)):
        raise RecipeError(
            f"viewpoints: expected the camera in a room of the place, as the model is; found it beyond the walls at "
            f"{_shown(cameras[i])}: go nearer; with min_visibility, frames that are drawn at random are drawn again"
        )


def check_way(things: Iterable[tuple[Thing, Float]], mesh_of: Callable[[Thing], Mesh], steps: Sequence[Step]) -> None:
    """Raise RecipeError if one of a camera's steps leads straight through a wall.

    `things` are the static things, each with its box (8, 3) in the world; `mesh_of` returns a thing's mesh in its own axes.
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
    """The triangles (T, 3) of scenery that cameras must not pass through."""
    solid = np.array([stuff in WALLS for stuff in stuff_of(category, mesh.parts)], np.bool_)
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


def sky_occlusion(vertices: Float, triangles: NDArray[np.int32], point: Float) -> float:
    """Share of the upper hemisphere that a mesh hides from a point (3,); point and vertices in one frame, +Z up.

    1 inside a house, whatever its floor and the thickness of its walls; 0 where no part of the mesh is overhead, as in a street
    or among hills; in between beside a wall or below a tree.
    """
    from viewsphere.truth.kernels_sky_visibility import hits_any

    if not hits_any(vertices, triangles, point, np.array([0.0, 0.0, 1.0])):
        return 0.0
    return sum(hits_any(vertices, triangles, point, d) for d in _upward()) / DIRECTIONS


def _upward() -> Float:
    """Unit vectors spread evenly over the upper hemisphere, on a Fibonacci spiral."""
    z = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    turn = np.arange(DIRECTIONS) * math.pi * (3 - math.sqrt(5))
    level = np.sqrt(1 - z * z)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
