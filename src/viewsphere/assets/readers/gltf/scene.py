"""Nodes, meshes, skins and instances of a glTF file, as pieces in world coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from viewsphere.assets.animation.skin import strongest
from viewsphere.assets.primitive import Float, Int, Primitive, compact
from viewsphere.assets.readers.gltf.animation import Posed
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.assets.readers.gltf.marks import is_line
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.smoothing import flat
from viewsphere.assets.readers.shared.transform import moved, unit
from viewsphere.geometry.rotation import compose
from viewsphere.model.annotations.keypoints import is_name

TRIANGLES, STRIP, FAN = 4, 5, 6


def read_pieces(document: Document, worlds: Mapping[int, Float], now: Posed = MappingProxyType({})) -> list[Primitive]:
    """The triangles of nodes, node by node, with the transforms `worlds` from `world_matrices` applied. The animated properties
    `now` override those of the nodes.

    Nodes scaled to zero are not drawn (glTF 2.0, section 3.5.3).
    """
    pieces: list[Primitive] = []
    parts = part_names(document, worlds)
    meshes: dict[int, list[Primitive]] = {}  # read once without morphing or skinning, for instances
    total = 0
    for index, part in parts.items():
        node, world = document.root.item("nodes", index), worlds[index]
        mesh = node.integer("mesh")
        entry = document.root.item("meshes", mesh)
        moved_weights = now.get(index, {}).get("weights")
        weights = tuple(_weights(node) or _weights(entry) if moved_weights is None else moved_weights.tolist())
        if "skin" in node or any(weights):
            local = _primitives(document, entry, weights, _skin(document, node, worlds))
        else:
            local = meshes.setdefault(mesh, []) or _primitives(document, entry, (), None)
            meshes[mesh] = local
        matrices = [np.eye(4)] if "skin" in node else _instances(document, node, world)
        total += len(matrices) * sum(len(piece.triangles) for piece in local)
        document.folder.check("MAX_TRIANGLES", total, "triangles, all instances counted,")
        placed = (replace(moved(piece, matrix), part=part) for matrix in matrices for piece in local)
        pieces.extend(piece if piece.normals is not None else flat(piece) for piece in placed)
    if not pieces and any("mesh" in document.root.item("nodes", index) for index in _hidden(document, worlds)):
        raise document.folder.error("all of its meshes are hidden (KHR_node_visibility); show some, and export it again")
    return pieces


def part_names(document: Document, worlds: Mapping[int, Float]) -> dict[int, str]:
    """The name of each node's part of the mesh, by the node's number; nodes that draw nothing or are hidden are left out."""
    names, taken = dict[int, str](), dict[str, int]()
    hidden = _hidden(document, worlds)
    for index, world in worlds.items():
        node = document.root.item("nodes", index)
        if "mesh" in node and index not in hidden and world[:3, :3].any() and not is_line(document, node):
            entry = document.root.item("meshes", node.integer("mesh"))
            names[index] = _unused(node.text("name") or entry.text("name") or f"node{index}", taken)
    return names


def _hidden(document: Document, worlds: Mapping[int, Float]) -> set[int]:
    """The nodes that KHR_node_visibility hides, and all below them; `worlds` lists parents first."""
    hidden = set[int]()
    for index in worlds:
        node = document.root.item("nodes", index)
        visibility = node.extension("KHR_node_visibility")
        if index in hidden or not (visibility is None or visibility.boolean("visible", True)):
            hidden |= {index, *_indices(node, "children")}
    return hidden


def _unused(name: str, taken: dict[str, int]) -> str:
    """The name, or the first of name_2, name_3, ... that is free."""
    unique, number = name, taken.get(name, 0)
    while unique in taken:
        number += 1
        unique = f"{name}_{number}"
    taken[name] = max(number, 1)
    taken.setdefault(unique, 1)
    return unique


def world_matrices(document: Document, below: str | None = None, now: Posed = MappingProxyType({})) -> dict[int, Float]:
    """Node-to-world matrices (4, 4) of the default scene, parents first, in file order; or only those of nodes `below` the node
    of this name, whose axes are then the world. The animated properties `now` override those of the nodes.
    """
    root = document.root
    nodes = root.items("nodes")
    if below is not None:
        starts = _indices(_named(document, below), "children")
    elif "scenes" in root and root.items("scenes"):
        starts = _indices(root.item("scenes", root.integer("scene", 0)), "nodes")
    else:
        children = {child for node in nodes for child in _indices(node, "children")}
        starts = [i for i in range(len(nodes)) if i not in children]
    worlds: dict[int, Float] = {}
    stack = [(index, np.eye(4), 1) for index in reversed(starts)]
    while stack:
        index, parent, depth = stack.pop()
        document.folder.check("MAX_NESTING", depth, "nodes within one another")
        if index in worlds:
            raise document.folder.error(f"nodes[{index}] is reached twice: expected a tree, found a cycle or a shared child")
        node = root.item("nodes", index)
        worlds[index] = compose(parent, _local_matrix(node, now.get(index, {})))
        stack.extend((child, worlds[index], depth + 1) for child in reversed(_indices(node, "children")))
    return worlds


def _named(document: Document, name: str) -> Field:
    """The first node of this name."""
    for node in document.root.items("nodes"):
        if node.text("name") == name:
            return node
    raise document.folder.error(f"expected a node {name!r}, found none")


def _indices(entry: Field, key: str) -> list[int]:
    found = (item.value for item in entry.items(key))
    values: list[Any] = [int(v) if isinstance(v, float) and v.is_integer() else v for v in found]
    if not all(isinstance(v, int) and not isinstance(v, bool) and v >= 0 for v in values):
        raise Field(values, f"{entry.where}.{key}").fail("whole numbers")
    return values


def _weights(entry: Field) -> list[float]:
    count = len(entry.items("weights"))
    return list(entry.numbers("weights", count, ()))


def _local_matrix(node: Field, now: Mapping[str, Float]) -> Float:
    if "matrix" in node:
        return np.array(node.numbers("matrix", 16, ())).reshape(4, 4).T

    def said(name: str, empty: tuple[float, ...]) -> Float:
        return np.array([now[name] if name in now else node.numbers(name, len(empty), empty)])

    return _compose(
        said("translation", (0.0, 0.0, 0.0)), said("rotation", (0.0, 0.0, 0.0, 1.0)), said("scale", (1.0, 1.0, 1.0))
    )[0]


def _compose(translation: Float, rotation: Float, scale: Float) -> Float:
    """Matrices (N, 4, 4) from translations, quaternions (x, y, z, w) and scales."""
    length = np.linalg.norm(rotation, axis=1, keepdims=True)
    x, y, z, w = np.where(length > 0, rotation / np.where(length > 0, length, 1.0), (0.0, 0.0, 0.0, 1.0)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrices = np.tile(np.eye(4), (len(translation), 1, 1))
    matrices[:, :3, :3] = np.moveaxis(np.array(rows), -1, 0) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    return matrices


def _instances(document: Document, node: Field, world: Float) -> list[Float]:
    """World matrices of a node's mesh: one, or those of EXT_mesh_gpu_instancing."""
    instancing = node.extension("EXT_mesh_gpu_instancing")
    if instancing is None:
        return [world]
    attributes = instancing.get("attributes")
    widths = {"TRANSLATION": (3, 0.0), "ROTATION": (4, 0.0), "SCALE": (3, 1.0)}
    read = {
        key: document.accessor(attributes.integer(key), (width,)).astype(np.float64)
        for key, (width, _) in widths.items()
        if key in attributes
    }
    counts = {len(values) for values in read.values()}
    if len(counts) != 1:
        raise attributes.fail("attributes of one length")
    count = counts.pop()
    document.folder.check("MAX_INSTANCES", count, "instances")
    t, r, s = (read.get(key, np.full((count, width), empty)) for key, (width, empty) in widths.items())
    return [compose(world, local) for local in _compose(t, r, s)]


@dataclass(frozen=True, eq=False)
class _Skin:
    """Matrices (J, 4, 4) of joints from the bind pose to the world, and the joints' names."""

    matrices: Float
    names: tuple[str, ...]


def _primitives(document: Document, mesh: Field, weights: tuple[float, ...], skin: _Skin | None) -> list[Primitive]:
    """A mesh's triangles in its own axes, or in the world's when a skin bends it."""
    pieces: list[Primitive] = []
    for entry in mesh.items("primitives"):
        piece = _primitive(document, entry)
        if piece is not None:
            piece = _morphed(document, entry, piece, weights)
            pieces.append(compact(piece if skin is None else _skinned(document, entry, piece, skin)))
            document.folder.check("MAX_TRIANGLES", sum(len(piece.triangles) for piece in pieces), "triangles")
    return pieces


def _skin(document: Document, node: Field, worlds: Mapping[int, Float]) -> _Skin | None:
    """The skin of a node, None if it has none."""
    if "skin" not in node:
        return None
    skin = document.root.item("skins", node.integer("skin"))
    joints = _indices(skin, "joints")
    outside = [joint for joint in joints if joint not in worlds]
    if outside or not joints:
        raise skin.fail(f"joints that are nodes of the scene, not {outside[:3] or 'none at all'}")
    matrices, names = np.array([worlds[joint] for joint in joints]), _names(document, joints)
    if "inverseBindMatrices" not in skin:
        return _Skin(matrices, names)
    inverse = document.accessor(skin.integer("inverseBindMatrices"), (16,)).astype(np.float64)
    if len(inverse) < len(joints):
        raise skin.fail(f"{len(joints)} inverse bind matrices, not {len(inverse)}")
    local = inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    return _Skin(np.array([compose(joint, bind) for joint, bind in zip(matrices, local, strict=True)]), names)


def _names(document: Document, joints: Sequence[int]) -> tuple[str, ...]:
    """Names of nodes, made unique."""
    taken = dict[str, int]()
    said = ((joint, document.root.item("nodes", joint).text("name").strip()) for joint in joints)
    return tuple(_unused(name if is_name(name) else f"node{joint}", taken) for joint, name in said)


def _skinned(document: Document, entry: Field, piece: Primitive, skin: _Skin) -> Primitive:
    """The piece bent by its skin's joints (linear blend skinning)."""
    attributes, count, joints = entry.get("attributes"), len(piece.positions), skin.matrices
    blend = np.zeros((count, 4, 4))
    bones, weights = list[Int](), list[Float]()
    for group in range(2):
        joint = _attribute(document, attributes, f"JOINTS_{group}", (4,), count)
        weight = _attribute(document, attributes, f"WEIGHTS_{group}", (4,), count)
        if joint is None or weight is None:
            break
        if joint.size and (joint.min() < 0 or joint.max() >= len(joints)):
            raise attributes.fail(f"JOINTS_{group} below {len(joints)}, not {joint.max():.0f}")
        bones.append(joint.astype(np.int64))
        weights.append(weight)
        for column in range(4):
            blend += weight[:, column, None, None] * joints[joint[:, column].astype(np.int64)]
    total = blend[:, 3, 3]
    if not (total > 0).all():
        document.folder.warn("a skinned mesh has vertices without joints: they stay where the file puts them")
        blend[total <= 0] = np.eye(4)
    blend /= blend[:, 3, 3, None, None]
    positions = np.einsum("nij,nj->ni", blend[:, :3, :3], piece.positions) + blend[:, :3, 3]
    if bones:
        piece = replace(piece, bone=strongest(np.hstack(bones), np.hstack(weights), piece.triangles), bones=skin.names)
    if piece.normals is None:
        return replace(piece, positions=positions)
    linear = blend[:, :3, :3]
    cofactor = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    return replace(piece, positions=positions, normals=unit(np.einsum("nij,nj->ni", cofactor, piece.normals)))


def _primitive(document: Document, entry: Field) -> Primitive | None:
    attributes = entry.get("attributes")
    mode = entry.integer("mode", TRIANGLES)
    if mode not in {TRIANGLES, STRIP, FAN}:
        document.folder.warn("points and lines are left out")
        return None
    if "POSITION" not in attributes:
        document.folder.warn("a primitive without positions is left out")
        return None
    if document.unpack(entry):
        mode = TRIANGLES  # Draco stores strips as triangles
    positions = _attribute(document, attributes, "POSITION", (3,), None)
    assert positions is not None
    count = len(positions)
    material = entry.integer("material") if "material" in entry else len(document.root.items("materials"))
    if "material" in entry:
        document.root.item("materials", material)
    triangles = _triangles(document, entry, mode, count)
    place = entry.where.removeprefix(f"{document.folder.model}: ")
    check_coordinates(document.folder, positions, triangles, f"{place}: ")
    return Primitive(
        part="",
        material=material,
        positions=positions,
        triangles=triangles,
        normals=_attribute(document, attributes, "NORMAL", (3,), count),
        uv0=_attribute(document, attributes, "TEXCOORD_0", (2,), count),
        uv1=_attribute(document, attributes, "TEXCOORD_1", (2,), count),
        colors=_colors(document, attributes, count),
    )


def _attribute(document: Document, attributes: Field, key: str, widths: tuple[int, ...], count: int | None) -> Float | None:
    if key not in attributes:
        return None
    values = document.accessor(attributes.integer(key), widths).astype(np.float64)
    if count is not None and len(values) != count:
        raise attributes.fail(f"{key} with {count} elements as POSITION has, not {len(values)}")
    return values


def _colors(document: Document, attributes: Field, count: int) -> Float | None:
    values = _attribute(document, attributes, "COLOR_0", (3, 4), count)
    if values is None or values.shape[1] == 4:
        return values
    return np.column_stack([values, np.ones(count)])


def _triangles(document: Document, entry: Field, mode: int, count: int) -> Int:
    if "indices" in entry:
        indices = document.accessor(entry.integer("indices"), (1,))[:, 0]
        if indices.dtype.kind not in "u":
            raise entry.fail("indices of an unsigned type")
        indices = indices.astype(np.int64)
    else:
        indices = np.arange(count)
    if len(indices) and int(indices.max()) >= count:
        raise document.folder.error(f"{entry.where}.indices: expected indices below {count}, found {indices.max()}")
    if mode == TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    i = np.arange(len(indices) - 2)
    if mode == FAN:
        return np.column_stack([np.full(len(i), indices[0]), indices[i + 1], indices[i + 2]])
    return np.column_stack([indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]])


def _morphed(document: Document, entry: Field, piece: Primitive, weights: tuple[float, ...]) -> Primitive:
    """The piece with its morph targets at these weights."""
    for target, weight in zip(entry.items("targets"), weights, strict=False):
        if weight == 0:
            continue
        shift = _attribute(document, target, "POSITION", (3,), len(piece.positions))
        turn = _attribute(document, target, "NORMAL", (3,), len(piece.positions))
        if shift is not None:
            piece = replace(piece, positions=piece.positions + weight * shift)
        if turn is not None and piece.normals is not None:
            piece = replace(piece, normals=piece.normals + weight * turn)
    return piece
