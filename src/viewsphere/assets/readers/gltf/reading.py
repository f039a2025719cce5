"""glTF 2.0 and GLB: our own reader, because none in Python keeps all of a material.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, assemble
from viewsphere.assets.readers.gltf.animation import Posed, posed, timeline
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.keypoints import read_keypoints
from viewsphere.assets.readers.gltf.marks import read_marks
from viewsphere.assets.readers.gltf.material import read_materials
from viewsphere.assets.readers.gltf.scene import part_names, read_pieces, world_matrices


def read_gltf(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file's default scene as one mesh in glTF's axes (up +Y, front +Z, metres), at rest; or what is below the first node
    that is named `folder.node`, in that node's axes.

    Skins stand in their bind pose with the scene's joints, morph targets at their default weights, instances
    are repeated. One part a node, named by the node or its mesh; points as `read_keypoints` has them. Raises ModelError
    for a file that breaks the specification in a way that affects the mesh, or requires an extension that this reader lacks.
    """
    return _built(Document.read(folder), folder.node, {})


def read_gltf_frames(folder: ModelFolder, frames: Sequence[int]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The file as `read_gltf` gives it at the first frame of the animation that `folder.clip` names (None: of what moves each
    node first), then at each of the `frames`, of which `folder.fps` make a second. Raises ModelError as there, and for
    a clip that the file does not have.
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
        keypoints=read_keypoints(document, worlds),
        marks=read_marks(document, worlds, part_names(document, worlds)),
    )
    return assemble(folder, pieces, materials, facts)
