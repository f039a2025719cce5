"""A reader of exported GLB files: it returns the mesh that `glb.glb_bytes` wrote, as far as labels need it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.exporting.glb import BODY_PARTS
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.assets.readers.gltf.material import read_materials

Part = tuple[int, Field]
"""A part's number, and one of its primitives."""

FROM_GLTF = np.array([0, 2, 1]), np.array([1, -1, 1], np.float32)
"""The axis of glTF for each of the object's axes, and their signs."""


def read_exported(file: Path, parts: Sequence[str], node: str | None = None, *, whole: bool = False) -> Mesh:
    """The mesh of a GLB file that this package wrote, in object axes; every number is equal to the last bit. For a model that
    deforms, `node` names the time step.

    `parts` names all parts of the model, including those without triangles. Unless the `whole` mesh is requested, opaque
    materials are left plain, and images that only they use are omitted. Raises ModelError for a file that cannot be read, has
    other parts, or lacks the node.
    """
    document = Document.read(ModelFolder(file))
    step = None if node is None else _step(document, node)
    meshes = _meshes(document, step)
    primitives = list(_primitives(document, meshes, parts))
    vertices = [_accessor(document, p, "POSITION", 3) for _, p in primitives]
    triangles = [document.accessor(p.integer("indices"), (1,)).reshape(-1, 3).astype(np.int64) for _, p in primitives]
    firsts = np.cumsum([0, *(len(own) for own in vertices)])
    counts = [len(own) for own in triangles]
    materials = document.root.items("materials")
    first, count = (0, len(materials)) if step is None else map(int, step.get("extras").numbers("materials", 2, ()))
    seen_through = {i for i in range(first, first + count) if whole or materials[i].text("alphaMode", "OPAQUE") != "OPAQUE"}
    if whole:
        _read_images(document)
    axes, signs = FROM_GLTF
    body_parts, body_part = _body_parts(document, meshes, primitives)
    try:
        return Mesh(
            vertices=_joined(vertices, 3)[:, axes] * signs,
            triangles=np.concatenate([own + first for own, first in zip(triangles, firsts, strict=False)]).astype(np.int32),
            normals=_joined([_accessor(document, p, "NORMAL", 3) for _, p in primitives], 3)[:, axes] * signs,
            triangle_material=np.repeat([p.integer("material") - first for _, p in primitives], counts).astype(np.int32),
            triangle_part=np.repeat([part for part, _ in primitives], counts).astype(np.int32),
            materials=tuple(read_materials(document, seen_through)[:-1][first : first + count]),
            parts=tuple(parts),
            uv0=_optional(document, primitives, "TEXCOORD_0", 2),
            uv1=_optional(document, primitives, "TEXCOORD_1", 2),
            colors=_optional(document, primitives, "COLOR_0", 4),
            images=tuple(document.folder.images),
            triangle_body_part=body_part,
            body_parts=body_parts,
        )
    except ValueError as error:
        raise document.folder.error(f"expected an exported model, found {error}") from None


def _read_images(document: Document) -> None:
    """Read every image in the file's order, so that images keep their numbers."""
    for i, entry in enumerate(document.root.items("images")):
        data, _ = document.view(entry.integer("bufferView"))
        document.folder.image(f"#{i}", entry.text("name"), bytes(data))


def _step(document: Document, name: str) -> Field:
    """The node of this name, which represents a time step."""
    for node in document.root.items("nodes"):
        if node.text("name") == name and "extras" in node:
            return node
    raise document.folder.error(f"expected a node {name!r}, found none")


def _meshes(document: Document, step: Field | None) -> Sequence[Field]:
    """The meshes of the parts, or of the parts of one time step."""
    if step is None:
        return document.root.items("meshes")
    nodes = (document.root.item("nodes", int(child.value)) for child in step.items("children"))
    return [document.root.item("meshes", node.integer("mesh")) for node in nodes]


def _primitives(document: Document, meshes: Sequence[Field], parts: Sequence[str]) -> Iterator[Part]:
    """Yield every primitive in order; meshes are the parts that have triangles."""
    part = -1
    for mesh in meshes:
        name = mesh.text("name")
        if name not in parts[part + 1 :]:
            raise document.folder.error(f"expected the parts {', '.join(parts)} in order, found {name!r}")
        part = parts.index(name, part + 1)
        for primitive in mesh.items("primitives"):
            yield part, primitive


def _body_parts(
    document: Document, meshes: Sequence[Field], primitives: Sequence[Part]
) -> tuple[tuple[str, ...], NDArray[np.int32] | None]:
    """Names of the model's body parts, and the body part number of each triangle; None if it has no bones."""
    if not any(BODY_PARTS in mesh.get("extras") for mesh in meshes):
        return (), None
    names = tuple(str(item.value) for item in meshes[0].get("extras").items(BODY_PARTS))
    own = [document.accessor(p.get("extras").integer(BODY_PARTS), (1,))[:, 0].astype(np.int32) for _, p in primitives]
    return names, np.concatenate(own)


def _accessor(document: Document, primitive: Field, name: str, width: int) -> NDArray[np.float32]:
    return document.accessor(primitive.get("attributes").integer(name), (width,)).astype(np.float32)


def _optional(document: Document, primitives: Sequence[Part], name: str, width: int) -> NDArray[np.float32] | None:
    if not all(name in p.get("attributes") for _, p in primitives):
        return None
    return _joined([_accessor(document, p, name, width) for _, p in primitives], width)


def _joined(arrays: Sequence[NDArray[Any]], width: int) -> NDArray[np.float32]:
    return np.concatenate([np.zeros((0, width), np.float32), *arrays])
