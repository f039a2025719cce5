"""Annotations of a file's objects for the objects placed among them: a floor, a surface, a lane, or things in a room."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

PROPERTY = "viewsphere"
"""The custom property (glTF's `extras`) with an object's kind; a lane may also have `width` and `closed`."""

FLOOR, LANE, SURFACE, INDOORS = KINDS = ("floor", "lane", "surface", "indoors")

NAMED = re.compile(rf"({FLOOR}|{LANE}|{SURFACE})(?![^\W\d_])", re.IGNORECASE)
"""The beginning of the name of an annotated object; `surfaces` and `lanes` are other words."""

BLENDERS_NUMBER = re.compile(r"\.\d{3,}$")
"""The number that Blender appends to a duplicate name."""

Point = tuple[float, float, float]
Edge = tuple[int, int]


@dataclass(frozen=True)
class Annotation:
    """An annotated object. `part`: its part of the mesh, empty if it has no triangles. `points`: a lane's points in the file's
    coordinates, in the direction of travel. `width`: metres, None if not given. `problem`: the reason why the annotation is
    invalid; empty if it is valid.
    """

    kind: str
    name: str
    part: str = ""
    points: tuple[Point, ...] = ()
    width: float | None = None
    closed: bool = False
    problem: str = ""


@dataclass(frozen=True)
class Marker:
    """A reader's facts about an object: its name and custom properties, and its part of the mesh (empty without triangles).
    Also: the points and edges of its lines, and the places by name of its children without triangles. `is_group`: other
    objects are below it.
    """

    name: str
    said: Mapping[str, Any]
    part: str = ""
    points: tuple[Point, ...] = ()
    edges: tuple[Edge, ...] = ()
    children: tuple[tuple[str, Point], ...] = ()
    is_group: bool = False


def kind_of(name: str, said: Any = None) -> str:
    """Return an object's kind: its custom property in lower case, valid or not, else the kind in its name. Empty without
    either.
    """
    if said not in (None, ""):
        return str(said).strip().lower()
    found = NAMED.match(name)
    return found[1].lower() if found else ""


def own_name(name: str) -> str:
    """Return the name of an annotated object in recipes: its name in lower case, without its kind and without Blender's number.
    `Lane.001` gives `lane`, since nothing else is left.
    """
    plain = BLENDERS_NUMBER.sub("", name)
    return NAMED.sub("", plain, 1).strip(" ._-:").lower() or plain.strip().lower()


def naturally(name: str) -> tuple[Any, ...]:
    """A key that sorts names with their numbers as numbers: p2 before p10."""
    return tuple((not t.isdecimal(), int(t) if t.isdecimal() else 0, t) for t in re.split(r"(\d+)", name.lower()) if t)


def annotation_of(marker: Marker) -> Annotation | None:
    """Return the annotation of an object; None without one. A name alone makes an object a floor or surface only where it has
    triangles, which the mesh's parts show. It makes an object a lane only if the object is a line or has no triangles.
    """
    said = marker.said.get(PROPERTY)
    kind = kind_of(marker.name, said)
    is_said = said not in (None, "")
    if kind == LANE:
        return _lane(marker, is_said)
    if not kind or not is_said:
        return None
    lacks = kind in (FLOOR, SURFACE) and not marker.part
    problem = "expected a mesh of faces; found none" if lacks else ""
    if kind not in KINDS:
        problem = f"expected one of {', '.join(KINDS)} as its property {PROPERTY!r}; found {kind!r}"
    return Annotation(kind, marker.name, marker.part, problem=problem)


def _lane(marker: Marker, is_said: bool) -> Annotation | None:
    if not marker.points and (marker.part or (marker.is_group and not marker.children)):
        if not is_said:
            return None  # a road with this name, or a group of objects
        found = "faces" if marker.part else "an object without either"
        return Annotation(LANE, marker.name, problem=f"expected a line, or empties below it; found {found}")
    if not is_said and not marker.points and not marker.children:
        return None  # a lamp or a camera with this name
    closed, problem = marker.said.get("closed", False) in (True, 1), ""
    points = tuple(place for _, place in sorted(marker.children, key=lambda child: naturally(child[0])))
    if marker.points:
        points, around, problem = _chained(marker.points, marker.edges)
        closed = closed or around
    points = tuple(point for i, point in enumerate(points) if i == 0 or point != points[i - 1])
    if closed and len(points) > 1 and points[0] == points[-1]:
        points = points[:-1]
    if not problem and len(points) < 2:
        problem = f"expected two points at least, of a line or of empties below it; found {len(points)}"
    width = marker.said.get("width")
    if width is not None and not (isinstance(width, (int, float)) and 0 < width < 1e6):
        problem = problem or f"expected its width as metres above 0; found {width!r}"
        width = None
    return Annotation(LANE, marker.name, "", points, None if width is None else float(width), closed, problem)


def _chained(points: Sequence[Point], edges: Sequence[Edge]) -> tuple[tuple[Point, ...], bool, str]:
    """The points along edges from end to end, whether the edges form a ring, and the reason why they are not one line, if any.

    The line starts at the end that its edge leads away from; if both or neither end is such, at the first one.
    """
    first = {point: i for i, point in reversed([*enumerate(points)])}
    welded = [(first[points[a]], first[points[b]]) for a, b in edges if points[a] != points[b]]
    beside: dict[int, list[int]] = {}
    for a, b in dict.fromkeys((min(edge), max(edge)) for edge in welded):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    if any(len(others) > 2 for others in beside.values()):
        return (), False, "expected one line; found one that branches"
    if not beside:
        return tuple(points[:1]), False, "expected one line; found points without edges" if len(first) > 1 else ""
    ends = sorted(i for i, others in beside.items() if len(others) == 1)
    sources = {a for a, _ in welded}
    leading = [i for i in ends if i in sources]
    at = (leading if len(leading) == 1 else ends or sorted(beside))[0]
    onward = {a: b for a, b in reversed(welded)}
    way, before = [at], -1
    while True:
        others = [i for i in beside[at] if i != before]
        ahead = onward[at] if len(way) == 1 and onward.get(at) in others else (others or [way[0]])[0]
        if ahead == way[0]:
            break
        way.append(ahead)
        before, at = at, ahead
    if len(way) < len(beside):
        return (), False, "expected one line; found several"
    return tuple(points[i] for i in way), not ends, ""
