"""Points that a glTF file names: nodes that say so, else the joints of its skins."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, cast

from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.shared.named_points import NamedPoint, named_points
from viewsphere.model.annotations.keypoints import Keypoints

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
    parents = {child: i for i in worlds for child in _numbers(nodes[i].mapping().get("children"))}
    points = {i: NamedPoint(name, worlds[i][:3, 3], _above(i, parents, names)) for i, name in names.items()}
    return named_points(document.folder, points)


def _said(node: Mapping[str, Any]) -> str:
    """The point that a node is said to be; empty for any other."""
    name, extras = str(node.get("name", "")), node.get("extras")
    said = cast("dict[str, Any]", extras).get(EXTRA) if isinstance(extras, dict) else None
    if said and not isinstance(said, str):
        return name.removeprefix(PREFIX)
    return said or (name.removeprefix(PREFIX) if name.startswith(PREFIX) else "")


def _above(node: int, parents: Mapping[int, int], chosen: Collection[int]) -> int | None:
    """The next of the chosen nodes above one."""
    above = parents.get(node)
    while above is not None and above not in chosen:
        above = parents.get(above)
    return above


def _numbers(value: Any) -> list[int]:
    """Whole numbers of a list that has been checked where meshes were read."""
    values = cast("list[Any]", value) if isinstance(value, list) else []
    return [int(v) for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
