"""Annotations in a glTF file for the objects placed in its scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.assets.scene_annotations import LANE, PROPERTY, Annotation, Edge, Marker, Point, annotation_of, kind_of
from viewsphere.geometry.rotation import transform

LINES, LOOP, LINE_STRIP = 1, 2, 3
FACES = (4, 5, 6)


def read_marks(document: Document, worlds: Mapping[int, Float], parts: Mapping[int, str]) -> tuple[Annotation, ...]:
    """The annotations of nodes in the scene, in its axes; `worlds` and `parts` are the nodes' matrices and part names by
    number.
    """
    nodes = document.root.items("nodes")
    found = ((i, nodes[i], _said(nodes[i])) for i in worlds)
    named = ((i, node, said) for i, node, said in found if kind_of(node.text("name"), said.get(PROPERTY)))
    marks = (annotation_of(_marker(document, i, node, said, worlds, parts)) for i, node, said in named)
    return tuple(mark for mark in marks if mark is not None)


def is_line(document: Document, node: Field) -> bool:
    """Return whether a node is a lane made only of lines, which must stay invisible."""
    if kind_of(node.text("name"), _said(node).get(PROPERTY)) != LANE or "mesh" not in node:
        return False
    primitives = document.root.item("meshes", node.integer("mesh")).items("primitives")
    return all(one.integer("mode", FACES[0]) in (LINES, LOOP, LINE_STRIP) for one in primitives)


def _said(node: Field) -> Mapping[str, Any]:
    extras = node.mapping().get("extras")
    return cast("dict[str, Any]", extras) if isinstance(extras, dict) else {}


def _marker(
    document: Document,
    index: int,
    node: Field,
    said: Mapping[str, Any],
    worlds: Mapping[int, Float],
    parts: Mapping[int, str],
) -> Marker:
    nodes = document.root.items("nodes")
    below = [int(item.value) for item in node.items("children")]
    children = tuple((nodes[i].text("name"), _point(worlds[i][:3, 3])) for i in below if i in worlds and "mesh" not in nodes[i])
    points, edges = _lines(document, node, worlds[index]) if is_line(document, node) else ((), ())
    return Marker(node.text("name"), said, parts.get(index, ""), points, edges, children, bool(below))


def _lines(document: Document, node: Field, world: Float) -> tuple[tuple[Point, ...], tuple[Edge, ...]]:
    """The points of a node's lines in the scene, and their edges."""
    points, edges = list[Point](), list[Edge]()
    for primitive in document.root.item("meshes", node.integer("mesh")).items("primitives"):
        positions = document.accessor(primitive.get("attributes").integer("POSITION"), (3,)).astype(np.float64)
        if not np.isfinite(positions).all():
            raise primitive.fail("finite positions of a lane")
        order = np.arange(len(positions))
        if "indices" in primitive:
            order = document.accessor(primitive.integer("indices"), (1,))[:, 0].astype(np.int64)
            if len(order) and not 0 <= order.min() <= order.max() < len(positions):
                raise primitive.fail(f"indices below {len(positions)}")
        ends = order + len(points)
        points += map(_point, transform(world, positions))
        edges += _edges(ends.tolist(), primitive.integer("mode", FACES[0]))
    return tuple(points), tuple(edges)


def _edges(order: list[int], mode: int) -> list[Edge]:
    if mode == LINES:
        return list(zip(order[::2], order[1::2], strict=False))
    following = order[1:] + order[:1] if mode == LOOP else order[1:]
    return list(zip(order, following, strict=False))


def _point(place: Float) -> Point:
    x, y, z = place.tolist()
    return x, y, z
