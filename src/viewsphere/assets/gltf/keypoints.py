"""Points that a glTF file names: nodes that say so, else the joints of its skins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast

from viewsphere.assets.gltf.document import Document
from viewsphere.assets.primitive import Float
from viewsphere.model.keypoints import MOST_POINTS, Keypoints, Pair, Place, is_name, left_and_right
from viewsphere.model.numbers import LARGEST

PREFIX = "keypoint:"
"""Begins the name of a node that is a point; the rest is the point's name."""

EXTRA = "keypoint"
"""The member of a node's `extras` that makes it a point: its name, or true for that of the node."""


def read_keypoints(document: Document, worlds: Mapping[int, Float]) -> Keypoints | None:
    """Named points among nodes in the scene (their matrices by their numbers, parents first), in its axes; None without any.

    Points are nodes named `keypoint:nose`, or with `extras: {keypoint: nose}`; without any, all joints of skins. A line of the
    skeleton leads from each to the next one above it; left and right follow from the names.
    """
    nodes = document.root.items("nodes")
    names = {i: name for i in worlds if (name := _said(nodes[i].mapping()))}
    if not names:
        joints = dict.fromkeys(
            joint for skin in document.root.items("skins") for joint in _numbers(skin.mapping().get("joints"))
        )
        names = {i: nodes[i].text("name") for i in joints if i in worlds}
    names = {i: name for i, name in _named(names) if abs(worlds[i][:3, 3]).max() < LARGEST}
    if len(names) > MOST_POINTS:
        document.folder.warn(f"{len(names):,} named points: expected at most {MOST_POINTS:,}, none is kept")
        return None
    points = {name: cast("Place", tuple(worlds[i][:3, 3].tolist())) for i, name in names.items()}
    if not points:
        return None
    parents = {child: i for i in worlds for child in _numbers(nodes[i].mapping().get("children"))}
    return Keypoints(points=points, skeleton=tuple(_lines(names, parents)), flips=left_and_right(points))


def _said(node: Mapping[str, Any]) -> str:
    """The point that a node is said to be; empty for any other."""
    name, extras = str(node.get("name", "")), node.get("extras")
    said = cast("dict[str, Any]", extras).get(EXTRA) if isinstance(extras, dict) else None
    if said and not isinstance(said, str):
        return name.removeprefix(PREFIX)
    return said or (name.removeprefix(PREFIX) if name.startswith(PREFIX) else "")


def _named(names: Mapping[int, str]) -> Iterator[tuple[int, str]]:
    """Each with a name of its own that a point may have."""
    taken = set[str]()
    for i, said in names.items():
        whole = said.strip()[:90]
        name = whole if is_name(whole) else f"node{i}"
        unique = next(other for k in range(1, len(names) + 2) if (other := name if k == 1 else f"{name}_{k}") not in taken)
        taken.add(unique)
        yield i, unique


def _lines(names: Mapping[int, str], parents: Mapping[int, int]) -> Iterator[Pair]:
    for i, name in names.items():
        above = parents.get(i)
        while above is not None and above not in names:
            above = parents.get(above)
        if above is not None:
            yield names[above], name


def _numbers(value: Any) -> list[int]:
    """Whole numbers of a list that has been checked where meshes were read."""
    values = cast("list[Any]", value) if isinstance(value, list) else []
    return [int(v) for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
