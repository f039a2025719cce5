"""glTF 2.0 and GLB: our own reader, because none in Python keeps all of a material.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from __future__ import annotations

from viewsphere.assets.folder import ModelFolder
from viewsphere.assets.gltf.document import Document
from viewsphere.assets.gltf.keypoints import read_keypoints
from viewsphere.assets.gltf.material import read_materials
from viewsphere.assets.gltf.scene import read_pieces, world_matrices
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.primitive import FileFacts, assemble


def read_gltf(folder: ModelFolder, node: str | None = None) -> tuple[Mesh, FileFacts]:
    """The file's default scene as one mesh in glTF's axes (up +Y, front +Z, metres), at rest; or what is below the first node
    of a name, in that node's axes.

    Skins stand in their bind pose with the scene's joints, morph targets at their default weights, instances
    are repeated. One part a node, named by the node or its mesh; points as `read_keypoints` has them. Raises ModelError
    for a file that breaks the specification in a way that affects the mesh, or requires an extension that this reader lacks.
    """
    document = Document.read(folder)
    worlds = world_matrices(document, node)
    pieces = read_pieces(document, worlds)
    materials = read_materials(document, {piece.material for piece in pieces})
    facts = FileFacts(
        folder.model, folder.model.suffix[1:].lower(), "+y", "+z", 1.0, keypoints=read_keypoints(document, worlds)
    )
    return assemble(folder, pieces, materials, facts)
