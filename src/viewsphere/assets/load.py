"""Any model file to a raw mesh, in the file's own axes and unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.assets.folder import ModelFolder
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.piece import FileFacts
from viewsphere.errors import ModelError

SUFFIXES = ("3mf", "dae", "glb", "gltf", "obj", "off", "ply", "stl")


def load_model(path: Path, *, confined: bool = True) -> tuple[Mesh, FileFacts]:
    """Read a model file: its triangles in its own axes and unit, and what it says of these.

    | suffix    | up            | front        | unit                  | source                              |
    |-----------|---------------|--------------|-----------------------|-------------------------------------|
    | glb, gltf | +y            | +z           | metre                 | glTF 2.0, section 3.4               |
    | obj       | +y            | +z           | unknown, taken as 1 m | no rule; what most exporters write  |
    | dae       | asset/up_axis | see below    | asset/unit            | COLLADA 1.4.1, up_axis              |
    | 3mf       | +z            | -y           | the file's, else 1 mm | 3MF core specification, section 3.3 |
    | ply       | +z            | -y           | unknown, taken as 1 m | no rule; scanners, CAD              |
    | stl       | +z            | -y           | unknown, taken as 1 m | no rule; CAD, often in millimetres  |
    | off       | +z            | -y           | unknown, taken as 1 m | no rule                             |

    COLLADA: Y_UP has its front at +z, Z_UP at -y, X_UP at +z. With `confined`, files that the model names
    (textures, buffers, material libraries) are read only from its own folder and below. Raises ModelError in
    one line that names the file: missing, empty, truncated, not a model, no triangles, or more of them than
    `limits` allows.
    """
    suffix = path.suffix[1:].lower()
    if suffix not in SUFFIXES:
        raise ModelError(f"{path}: expected a model file with suffix {', '.join(SUFFIXES)}, found {path.suffix or 'none'!r}")
    # NaN and infinity are found and reported once the whole file is read.
    with np.errstate(all="ignore"):
        return _read(ModelFolder(path, confined), suffix)


def _read(folder: ModelFolder, suffix: str) -> tuple[Mesh, FileFacts]:
    if suffix in {"glb", "gltf"}:
        from viewsphere.assets.gltf import read_gltf

        return read_gltf(folder)
    if suffix == "obj":
        from viewsphere.assets.obj import read_obj

        return read_obj(folder)
    from viewsphere.assets.via_trimesh import read_via_trimesh

    return read_via_trimesh(folder)
