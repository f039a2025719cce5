"""Named points of a model's file, from the nodes of its scene tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float
from viewsphere.model.annotations.keypoints import MOST_POINTS, Keypoints, Place, is_name, left_and_right
from viewsphere.model.fields.numbers import LARGEST


@dataclass(frozen=True, eq=False)
class NamedPoint:
    """A node that is a point: its name, its position (3,), and the number of the next such node above it."""

    name: str
    place: Float
    above: int | None


def named_points(folder: ModelFolder, nodes: Mapping[int, NamedPoint]) -> Keypoints | None:
    """The points of nodes, by number, in their order; None without any. A line connects each point to the one above, and left
    and right follow from the names. Invalid and duplicate names are changed; a file with too many points for a model causes a
    warning.
    """
    if len(nodes) > MOST_POINTS:
        folder.warn(f"{len(nodes):,} named points: expected at most {MOST_POINTS:,}, none is kept")
        return None
    names, points = dict[int, str](), dict[str, Place]()
    for i, node in nodes.items():
        if abs(node.place).max() < LARGEST:
            names[i] = _free(node.name.strip()[:90], i, points)
            points[names[i]] = cast("Place", tuple(node.place.tolist()))
    lines = ((nodes[i].above, name) for i, name in names.items())
    skeleton = tuple((names[above], name) for above, name in lines if above in names)
    return Keypoints(points=points, skeleton=skeleton, flips=left_and_right(points)) if points else None


def _free(said: str, number: int, taken: Mapping[str, Place]) -> str:
    """The name, or the first of name_2, name_3, ... that is free."""
    name = said if is_name(said) else f"node{number}"
    found, k = name, 1
    while found in taken:
        k += 1
        found = f"{name}_{k}"
    return found
