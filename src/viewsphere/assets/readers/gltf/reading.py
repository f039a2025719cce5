"""glTF 2.0 and GLB: our own reader, because no other reader in Python keeps all material fields.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, assemble
from viewsphere.assets.readers.gltf.animation import Posed, posed, timeline
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.marks import read_marks
from viewsphere.assets.readers.gltf.material import read_materials
from viewsphere.assets.readers.gltf.scene import part_names, read_pieces, world_matrices
from viewsphere.assets.readers.shared.named_points import NamedPoint, named_points
from viewsphere.model.annotations.keypoints import Keypoints

PREFIX = "keypoint:"
"""The prefix of the name of a node that is a point; the rest is the point's name."""

EXTRA = "keypoint"
"""The member of a node's `extras` that makes it a point: its name, or true for the node's name."""


def read_gltf(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file's default scene as one mesh in glTF's axes (up +Y, front +Z, metres), at rest; or only the nodes below the first
    node named `folder.node`, in that node's axes.

    Skins are bent by the scene's joints, morph targets have their default weights, and instances are repeated. Each node is one
    part, named after the node or its mesh; points are from `_read_keypoints`. Raises ModelError for a file that breaks the
    specification in a way that affects the mesh, or requires an extension that this reader lacks.
    """
    return _built(Document.read(folder), folder.node, {})


def read_gltf_frames(folder: ModelFolder, frames: Sequence[int]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The file, as from `read_gltf`, at the first frame of the animation `folder.clip` (None: each node's first animation),
    then at each of the `frames`, at `folder.fps` per second. Raises ModelError like `read_gltf`, and for a clip that the file
    does not have.
    """
    document = Document.read(folder)
    line = timeline(document, folder.clip, folder.fps)
    for frame in (line["first"], *frames):
        at_frame = replace(document, folder=folder.copy())
        yield _built(at_frame, None, posed(document, folder.clip, frame / line["fps"]))


def _built(document: Document, node: str | None, now: Posed) -> tuple[Mesh, FileFacts]:
    folder = document.folder
    worlds = world_matrices(document, node, now)
    pieces = read_pieces(document, worlds, now)
    materials = read_materials(document, {piece.material for piece in pieces})
    facts = FileFacts(
        folder.model,
        folder.model.suffix[1:].lower(),
        "+y",
        "+z",
        1.0,
        keypoints=_read_keypoints(document, worlds),
        marks=read_marks(document, worlds, part_names(document, worlds)),
    )
    return assemble(folder, pieces, materials, facts)


def _read_keypoints(document: Document, worlds: Mapping[int, Float]) -> Keypoints | None:
    """Named points among nodes in the scene (their matrices by their numbers, parents first), in its axes; None without any.

    Points are nodes named `keypoint:nose`, or with `extras: {keypoint: nose}`; without any, all joints of skins. A skeleton
    line connects each point to the next one above it; left and right follow from the names.
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
    """The name of the point that a node represents; empty for any other node."""
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
    """Whole numbers of a list that was already checked when meshes were read."""
    values = cast("list[Any]", value) if isinstance(value, list) else []
    return [int(v) for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)]
