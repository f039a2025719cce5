"""The floor, lanes and surfaces that a place's file declares by the names and custom properties of its objects."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.scene_annotations import FLOOR, INDOORS, LANE, SURFACE, Annotation, kind_of, naturally, own_name
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.hull import convex_hull, smallest_rectangle
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Lane, Surface, standing
from viewsphere.model.scene import Matrix4, Vector

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.primitive import FileFacts

Float = NDArray[np.float64]

WIDTH = 3.0
"""Default width of a lane, metres."""

FLAT = 0.005
"""Largest distance of a surface's points below its highest one, metres."""

LEAST = 0.5
"""Least share of a mesh's area, seen from above, that must be level and on top for the mesh to count as a surface."""

NEAR = 0.02
"""Largest height above or below a floor at which models still stand on it, metres."""


@dataclass(frozen=True)
class _FileFloor:
    """The floor of a place's file, as a rectangle in the place's axes: its frame, whose origin is the middle of its top, its
    size along the frame's x and y, and metres from its top down to its lowest point.
    """

    name: str
    place_from_floor: Matrix4
    size: tuple[float, float]
    depth: float

    @property
    def middle(self) -> tuple[float, float, float]:
        """The middle of its top, in the place's axes."""
        x, y, z = (row[3] for row in self.place_from_floor[:3])
        return x, y, z

    @property
    def box(self) -> Float:
        """Corners (8, 3) in its frame."""
        width, length = self.size
        return Box3d.between((-width / 2, -length / 2, 0.0), (width / 2, length / 2, 0.0)).corners

    def has(self, point: Vector) -> bool:
        """Return whether a point in the place's axes is on it."""
        frame = np.array(self.place_from_floor)
        x, y, z = ((np.array(point) - frame[:3, 3]) @ frame[:3, :3]).tolist()
        return abs(x) <= self.size[0] / 2 and abs(y) <= self.size[1] / 2 and -self.depth - NEAR <= z <= NEAR


@dataclass(frozen=True)
class FileOffers:
    """The floor, lanes and surfaces of a place's file, in its mesh's axes.
    `lanes` and `surfaces` match those of a zoo's `Place`, ordered by name. Access to either raises its `mistakes`.
    """

    floor: _FileFloor | None
    all_lanes: tuple[Lane, ...]
    all_surfaces: tuple[Surface, ...]
    indoors: bool
    mistakes: tuple[tuple[str, str], ...] = ()

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """Its lanes; raises RecipeError for an invalid one."""
        return self._sound(LANE, self.all_lanes)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """Its surfaces; raises RecipeError for an invalid one."""
        return self._sound(SURFACE, self.all_surfaces)

    def _sound(self, kind: str, found: tuple[Any, ...]) -> tuple[Any, ...]:
        for of, problem in self.mistakes:
            if of == kind:
                raise RecipeError(f"scene.place: {problem}")
        return found


def offers_of(spec: ModelSpec) -> FileOffers:
    """Return the offers of a place's file with this specification.
    The file is read once, and the cache keeps its offers while the file is unchanged.
    Raises ModelError for an unreadable file, RecipeError for meaningless properties.
    """
    state = split_source(Path(spec.source))[0].stat()
    return _offers_of(spec.model_dump_json(), (state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=16)
def _offers_of(text: str, state: tuple[int, int]) -> FileOffers:
    """The offers for a specification as JSON and the state of its file."""
    from viewsphere.assets.cache import cached_facts, load  # which loads readers of models

    spec = ModelSpec.model_validate_json(text)

    def ask() -> tuple[list[Any], tuple[Path, ...]]:
        mesh, facts = load(spec)
        return _levels_and_lanes(mesh, facts), facts.files

    settings = spec.model_dump_json(include={"up", "forward", "unit", "confined"})
    path, inside = split_source(Path(spec.source))
    return _offers(path.name, cached_facts(path, f"place {json.dumps(inside)} {settings}", ask))


def _levels_and_lanes(mesh: Mesh, facts: FileFacts) -> list[dict[str, Any]]:
    """Return the declarations of a normalised mesh and its file's facts as plain data: an entry for each marked object.
    The entries are in the mesh's axes.
    """
    said = {mark.part: mark for mark in facts.marks if mark.part}
    offers = [_lane(mark, facts) for mark in facts.marks if not mark.part]
    for number, part in enumerate(mesh.parts):
        name = part.rpartition("/")[2]
        mark = said.get(part) or Annotation(kind_of(name), name)
        if mark.kind in (FLOOR, SURFACE):
            corners = np.unique(mesh.triangles[mesh.triangle_part == number])
            offers += _level(mark, mesh.vertices[corners].astype(np.float64), part in said)
        elif part in said:
            offers.append({"kind": mark.kind, "name": mark.name, "problem": mark.problem})
    return offers


def _lane(mark: Annotation, facts: FileFacts) -> dict[str, Any]:
    points = transform(facts.object_from_file, mark.points).tolist() if mark.points else []
    return {
        "kind": mark.kind,
        "name": mark.name,
        "problem": mark.problem,
        "points": points,
        "width": mark.width,
        "closed": mark.closed,
    }


def _level(mark: Annotation, points: Float, is_said: bool) -> Iterator[dict[str, Any]]:
    """The rectangle of a floor or of a surface. Objects marked only by their name give nothing if they are higher than wide,
    such as a floor lamp.
    """
    top, low = float(points[:, 2].max()), float(points[:, 2].min())
    whole, face = _around(points), points
    if mark.kind == FLOOR:
        if not is_said and (top - low > max(whole[2]) or min(whole[2]) <= 0):
            return
    else:
        face = points[points[:, 2] >= top - FLAT]
    (x, y), turn, size = _around(face)
    problem = mark.problem
    if mark.kind == SURFACE and size[0] * size[1] < LEAST * whole[2][0] * whole[2][1]:
        problem = f"expected a level mesh; found heights of {low:.4g} to {top:.4g} m: make it level, or call it another name"
    if min(size) <= 0:
        problem = problem or "expected faces that can be seen from above; found none"
    yield {
        "kind": mark.kind,
        "name": mark.name,
        "problem": problem,
        "middle": [x, y, top],
        "turn": turn,
        "size": list(size),
        "depth": top - low,
    }


def _around(points: Float) -> tuple[tuple[float, float], float, tuple[float, float]]:
    """The middle, the turn in degrees, -45 to 45, and the size of the rectangle around points seen from above, shrunk until it
    is inside their hull, such as the square in a disc.
    """
    hull = convex_hull(points[:, :2])
    corners = smallest_rectangle(hull)
    middle, sides = corners.mean(axis=0), np.diff(corners, axis=0)[:2]
    size = np.hypot(*sides.T)
    turn = float(np.degrees(np.arctan2(sides[0, 1], sides[0, 0])))
    quarters = round(turn / 90.0)
    share = _share_within(hull, middle, corners - middle)
    width, length = (size * share).tolist() if quarters % 2 == 0 else (size[::-1] * share).tolist()
    x, y = middle.tolist()
    return (x, y), turn - 90.0 * quarters, (width, length)


def _share_within(hull: Float, middle: Float, corners: Float) -> float:
    """The factor, at most 1, that shrinks a rectangle about its middle until it is inside a convex hull."""
    sides = np.roll(hull, -1, axis=0) - hull
    outward = np.stack([sides[:, 1], -sides[:, 0]], axis=1)
    room = ((hull - middle) * outward).sum(axis=1)
    reach = (corners[:, None, :] * outward).sum(axis=2).max(axis=0)
    return float(min(1.0, (room[reach > 0] / reach[reach > 0]).min(initial=1.0) + 1e-9))


def _offers(file: str, found: list[dict[str, Any]]) -> FileOffers:
    """The offers from a file's declarations; of several floors, the largest is used."""
    known = (FLOOR, LANE, SURFACE, INDOORS)
    for one in found:
        if one["kind"] not in known or (one["problem"] and one["kind"] in (FLOOR, INDOORS)):
            raise RecipeError(f"scene.place: {file}: {one['name']!r}: {one['problem']}")
    ordered = sorted(found, key=lambda one: naturally(one["name"]))
    floors = sorted((one for one in ordered if one["kind"] == FLOOR), key=lambda one: one["size"][0] * one["size"][1])
    lanes, surfaces = ([one for one in ordered if one["kind"] == kind and not one["problem"]] for kind in (LANE, SURFACE))
    return FileOffers(
        _floor(floors[-1]) if floors else None,
        tuple(
            Lane(name, tuple(map(_vector, one["points"])), one["width"] or WIDTH, one["closed"]) for name, one in _named(lanes)
        ),
        tuple(Surface(name, _frame(one), (one["size"][0], one["size"][1])) for name, one in _named(surfaces)),
        any(one["kind"] == INDOORS for one in found),
        tuple((one["kind"], f"{file}: {one['name']!r}: {one['problem']}") for one in ordered if one["problem"]),
    )


def _named(found: list[dict[str, Any]]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The declarations with unique names: table, table_2, ..."""
    taken = set[str]()
    for one in found:
        own = own_name(one["name"])
        name = next(name for name in (own, *(f"{own}_{k}" for k in range(2, len(found) + 2))) if name not in taken)
        taken.add(name)
        yield name, one


def _floor(one: dict[str, Any]) -> _FileFloor:
    return _FileFloor(one["name"], _frame(one), (one["size"][0], one["size"][1]), one["depth"])


def _frame(one: dict[str, Any]) -> Matrix4:
    x, y, z = one["middle"]
    return standing(x, y, one["turn"], z)


def _vector(point: list[float]) -> Vector:
    x, y, z = point
    return x, y, z
