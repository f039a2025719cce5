"""From a recipe's layout to the poses of models, their paths to these, and the scenery around them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.composing.filling import shape_of
from viewsphere.composing.physics import EDITION
from viewsphere.composing.placing import Draws, Piece, Room, Shape, Way
from viewsphere.composing.scene.scenery import composed
from viewsphere.errors import MissingExtraError, RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import random_rotation, rigid, rotation_about
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.thing import TimeStep
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.world.layout import Layout, options_of, placer_of
from viewsphere.recipe.world.scenery import CompanyEntry
from viewsphere.recipe.world.scenes import ScenesEntry
from viewsphere.validation.errors import one_of

NEEDS = ("trimesh", "networkx", "scipy")
"""Packages of the extra physics."""

RAREST = 0.02
"""Smallest probability of a stable pose; rarer poses are treated as ones from which the model tips over."""


Float = NDArray[np.float64]


class BoxOf(Protocol):
    """Returns the 3D box (8, 3) of a normalised model at a time step (None: at rest) in its own axes, metres."""

    def __call__(self, spec: ModelSpec, step: TimeStep | None = None, /) -> NDArray[np.float64]:
        """The box, float64."""
        ...


Remembering = Callable[[tuple[str, ...], Callable[[], Any]], Any]
"""Returns the plain data that a function makes for names, cached from the first call with the same names."""


def unremembered(names: tuple[str, ...], make: Callable[[], Any]) -> Any:
    """Return the function's result, computed on each call."""
    return make()


def remembered_as(entry: ScenesEntry | CompanyEntry, cast: Sequence[ModelSpec], names: Sequence[str]) -> tuple[str, ...]:
    """The key under which simulated poses are kept: the models, their layout, and the names of all draws."""
    asked = entry.model_dump_json(include={"layout", "gap", "orientation", "surface"})
    return (EDITION, asked, *names, "of", *(spec.key for spec in cast))


@dataclass(frozen=True)
class Carried:
    """A path in world axes, for a model that was turned in its own axes before, in a room with a pose in the world."""

    way: Way
    world_from_room: Matrix4
    turned: Matrix4

    def pose_at(self, seconds: float) -> Matrix4:
        """World from object at a time, seconds from the start of the path."""
        return composed(self.world_from_room, composed(self.way.pose_at(seconds), self.turned))


@dataclass(frozen=True, eq=False)
class Laid:
    """Models that a placer places in a room, each turned in its own axes before (`turns`); the room has a pose in the world.
    Placing happens on first access.
    """

    layout: Layout
    members: tuple[ModelSpec, ...]
    shapes: tuple[Shape, ...]
    turns: tuple[Matrix4, ...]
    room: Room
    rng: Draws
    world_from_room: Matrix4 = IDENTITY

    @cached_property
    def poses(self) -> tuple[Matrix4, ...]:
        """World from object of each model; raises RecipeError if there is not enough room."""
        placer, options = _placer(self.layout, self.room.field)
        poses = placer.place(self.members, self.room, self.shapes, (), self.rng, *options)
        return tuple(self._in_world(pose, turn) for pose, turn in zip(poses, self.turns, strict=True))

    @cached_property
    def ways(self) -> tuple[Carried, ...]:
        """The path of each object to its place; empty where the placer reports no paths."""
        placer, options = _placer(self.layout, self.room.field)
        if placer.ways is None:
            return ()
        ways: Sequence[Way] = placer.ways(self.members, self.room, self.shapes, self.rng, *options)
        return tuple(Carried(way, self.world_from_room, turn) for way, turn in zip(ways, self.turns, strict=True))

    @cached_property
    def around(self) -> tuple[Piece, ...]:
        """The pieces of scenery that the placer adds, in world axes."""
        placer, options = _placer(self.layout, self.room.field)
        if placer.around is None:
            return ()
        pieces: Sequence[Piece] = placer.around(self.members, self.room, self.shapes, self.rng, *options)
        return tuple(Piece(p.source, p.size, composed(self.world_from_room, p.world_from_piece)) for p in pieces)

    def _in_world(self, pose: Matrix4, turn: Matrix4) -> Matrix4:
        pose = pose if turn == IDENTITY else composed(pose, turn)
        return pose if self.world_from_room == IDENTITY else composed(self.world_from_room, pose)


def laid(
    layout: Layout,
    orientation: str,
    cast: Sequence[ModelSpec],
    room: Room,
    box_of: BoxOf,
    rng: Draws,
    world_from_room: Matrix4 = IDENTITY,
) -> Laid:
    """The models as the layout places them, upright or turned before: in `any` direction, or into a stable pose."""
    shapes = [shape(spec, box_of) for spec in cast]
    if orientation == "upright":
        return Laid(layout, tuple(cast), tuple(shapes), (IDENTITY,) * len(shapes), room, rng, world_from_room)
    turns: list[Float] = []
    for slot, (spec, one) in enumerate(zip(cast, shapes, strict=True)):
        own = rng("orientation", str(slot), spec.key)
        turns.append(random_rotation(own) if orientation == "any" else stable_turn(one.hull, own))
    turned = tuple(one.turned(turn) for one, turn in zip(shapes, turns, strict=True))
    moves = tuple(composed(IDENTITY, rigid(turn, (0.0, 0.0, 0.0))) for turn in turns)
    return Laid(layout, tuple(cast), turned, moves, room, rng, world_from_room)


def check_layout(layout: Layout, field: str) -> None:
    """Check the placer of a layout; raises RecipeError, beginning with the field's name, for an unknown placer or option, and
    MissingExtraError for missing packages.
    """
    placer, _ = _placer(layout, field)
    _check_packages(placer.packages, "physics", f"{field}.layout: {placer_of(layout)}")


def check_orientation(orientation: str, field: str) -> None:
    """Check that this orientation is available; raises MissingExtraError for missing packages."""
    if orientation == "stable":
        _check_packages(NEEDS, "physics", f"{field}.orientation: stable")


def has_ways(layout: Layout) -> bool:
    """Return whether the placer reports the paths of things to their places."""
    return plugins.load(PlacerSpec, placer_of(layout)).ways is not None


def is_slow(layout: Layout) -> bool:
    """Return whether the placer is too slow to run before rendering."""
    return plugins.load(PlacerSpec, placer_of(layout)).is_slow


def shape(spec: ModelSpec, box_of: BoxOf) -> Shape:
    """A model's shape for a placer. The boxes of the data set's models are known; other models are read."""
    box = box_of(spec) if spec.category_id else _box(spec)
    return Shape(box, partial(_vertices, spec), partial(_surface, spec))


def _placer(layout: Layout, field: str) -> tuple[PlacerSpec, tuple[Any, ...]]:
    """The placer, and its options, if it has any."""
    name, given, where = placer_of(layout), options_of(layout), f"{field}.layout"
    placers = plugins.names("placers")
    if name not in placers:
        raise RecipeError(f"{where}{'.kind' if given else ''}: {one_of(name, placers)}")
    spec = plugins.load(PlacerSpec, name)
    return spec, spec.read_options(name, given, where)


def _box(spec: ModelSpec) -> Float:
    vertices = _vertices(spec)
    return Box3d.around(vertices).corners


def _vertices(spec: ModelSpec) -> Float:
    """The vertices of the normalised model, (N, 3); raises ModelError if its file cannot be used."""
    return shape_of((spec, None)).vertices


def _surface(spec: ModelSpec) -> tuple[Float, NDArray[np.int32]]:
    found = shape_of((spec, None))
    return found.vertices, found.triangles


def stable_turn(hull: Float, rng: np.random.Generator) -> Float:
    """A rotation (3, 3) into a stable pose on z = 0, for a model with these corners of its convex hull (N, 3). Each stable pose
    has the probability that the model, dropped at random, comes to rest in it (Goldberg et al. 1999, by trimesh's
    `compute_stable_poses`). The turn about the vertical is random.

    Raises MissingExtraError without the packages that it needs.
    """
    ways, chances = stable_ways(hull)
    way = ways[int(rng.choice(len(ways), p=chances))]
    return rotation_about((0.0, 0.0, 2 * np.pi * rng.random())) @ way


def stable_ways(hull: Float) -> tuple[Float, Float]:
    """Return the stable poses as rotations (N, 3, 3), the likeliest first, and their probabilities (N,); the rarest are left
    out.
    """
    return _stable_ways(hull.tobytes())


@lru_cache(maxsize=256)
def _stable_ways(corners: bytes) -> tuple[Float, Float]:
    _check_packages(NEEDS, "physics", "orientation: stable")
    import trimesh

    hull = np.frombuffer(corners).reshape(-1, 3)
    solid: Any = trimesh.convex.convex_hull(hull, repair=True) if np.linalg.matrix_rank(hull - hull[0], 1e-9) == 3 else None
    if solid is None:  # flat, or a line
        return np.eye(3)[None], np.ones(1)
    with np.errstate(invalid="ignore"):  # of triangles so thin that rounding makes their chance no number; such are passed over
        found, chances = solid.compute_stable_poses(n_samples=1, seed=0)
    turns, chances = found[:, :3, :3], np.round(chances, 6)
    order = np.lexsort([*np.round(turns[:, 2], 6).T, -chances]).tolist()  # the same where two are as likely
    kept = [i for i in order if chances[i] >= min(RAREST, chances.max())]
    return turns[kept], chances[kept] / chances[kept].sum()


def _check_packages(packages: Iterable[str], extra: str, what: str) -> None:
    """Check that an extra's packages are installed, without importing them; raises MissingExtraError that
    begins with `what`.
    """
    missing = [name for name in packages if find_spec(name) is None]
    if missing:
        names, are = " and ".join(missing), "is" if len(missing) == 1 else "are"
        raise MissingExtraError(f"{what} needs {names}, which {are} not installed: pip install 'viewsphere[{extra}]'")
