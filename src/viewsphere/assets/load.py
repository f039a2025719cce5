"""Any model file to a raw mesh, in the file's own axes and unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.readers import usd
from viewsphere.errors import ModelError

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts

SUFFIXES = ("3mf", "dae", "glb", "gltf", "obj", "off", "ply", "stl")
BLENDER_SUFFIXES = ("abc", "blend", "fbx", "usd", "usda", "usdc", "usdz")
"""Suffixes of formats that Blender reads; usd-core reads USD models at rest where it is installed."""
GLTF = ("glb", "gltf")
UP = {"glb": "y", "gltf": "y", "obj": "y", "3mf": "z", "ply": "z", "stl": "z", "off": "z"}
"""The axis that is up in files of each suffix; files of other formats state their own."""
USD = ("usd", "usda", "usdc", "usdz")
ANIMATED_SUFFIXES = (*BLENDER_SUFFIXES, *GLTF)
PICTURE_SUFFIXES = ("bmp", "jpeg", "jpg", "png", "tif", "tiff", "webp")

KNOWN = {
    "3ds": "3D Studio",
    "iges": "IGES (CAD)",
    "igs": "IGES (CAD)",
    "max": "3ds Max",
    "mb": "Maya",
    "ma": "Maya",
    "c4d": "Cinema 4D",
    "lwo": "LightWave",
    "skp": "SketchUp",
    "step": "STEP (CAD)",
    "stp": "STEP (CAD)",
    "wrl": "VRML",
    "x": "DirectX",
    "x3d": "X3D",
}
"""Model formats that are not read, by suffix."""

IN_BLENDER = {"x3d", "wrl"}
"""Formats of `KNOWN` that Blender opens with an extension."""


def load_model(
    path: Path, *, confined: bool = True, shown: tuple[str, ...] = (), node: str | None = None
) -> tuple[Mesh, FileFacts]:
    """Read a model file, in this process: its triangles in its own axes and unit, and what it says of these.

    | suffix    | up            | front        | unit                  | source                              |
    |-----------|---------------|--------------|-----------------------|-------------------------------------|
    | glb, gltf | +y            | +z           | metre                 | glTF 2.0, section 3.4               |
    | obj       | +y            | +z           | unknown, taken as 1 m | no rule; what most exporters write  |
    | dae       | asset/up_axis | see below    | asset/unit            | COLLADA 1.4.1, up_axis              |
    | 3mf       | +z            | -y           | the file's, else 1 mm | 3MF core specification, section 3.3 |
    | ply       | +z            | -y           | unknown, taken as 1 m | no rule; scanners, CAD              |
    | stl       | +z            | -y           | unknown, taken as 1 m | no rule; CAD, often in millimetres  |
    | off       | +z            | -y           | unknown, taken as 1 m | no rule                             |
    | pictures  | +z            | -y           | its height            | `picture`                           |
    | others    | +z            | -y           | metre                 | Blender turns and scales them       |

    COLLADA: Y_UP has its front at +z, Z_UP at -y, X_UP at +z. Others are FBX, USD, Alembic and .blend (`readers.blender`), of
    which `file.blend/Object/NAME` and `file.blend/Collection/NAME` are parts. With `confined`, files that the model names
    (textures, buffers, material libraries) are read only from its own folder and below; `shown` are objects of a .blend file
    that are read although renders do not show them; `node` names one of a glTF file below which is what is read. Raises
    ModelError in one line that names the file: missing, empty, truncated, not a model, no triangles, or more of them than
    `limits` allows.
    """
    suffix = check_source(path)
    from viewsphere.assets.paths.folder import ModelFolder

    file, inside = split_source(path)
    # NaN and infinity are found and reported once the whole file is read.
    with np.errstate(all="ignore"):
        return _read(ModelFolder(file, confined, inside, shown), suffix, node)


def load_frames(
    path: Path,
    frames: Sequence[int],
    *,
    confined: bool = True,
    shown: tuple[str, ...] = (),
    clip: str | None = None,
    fps: float | None = None,
) -> Iterator[tuple[Mesh, FileFacts]]:
    """A model file's meshes at its first frame, then at each of the ascending `frames`; the file is opened once, by Blender
    unless it is a glTF file.

    `clip` names the animation that is played, where the file has several; `fps` is how many frames make a second, None for
    what the file says.

    Otherwise as `load_model`; ModelError for files that cannot move.
    """
    suffix = check_animated(path)
    from viewsphere.assets.paths.folder import ModelFolder

    file, inside = split_source(path)
    folder = ModelFolder(file, confined, inside, shown, clip, fps)
    with np.errstate(all="ignore"):
        if suffix in GLTF:
            from viewsphere.assets.readers.gltf import read_gltf_frames

            yield from read_gltf_frames(folder, frames)
        else:
            from viewsphere.assets.readers.blender.reading import read_frames

            yield from read_frames(folder, frames)


def check_animated(path: Path) -> str:
    """The suffix of a file whose format may hold a readable animation; ModelError for other formats."""
    suffix = check_source(path)
    if suffix in ANIMATED_SUFFIXES:
        return suffix
    raise ModelError(f"{path}: expected a file that can move ({', '.join(ANIMATED_SUFFIXES)}) for frames, found {suffix}")


def check_source(path: Path) -> str:
    """The file's suffix in lower case, without its dot; ModelError when files of its kind are not read."""
    suffix = split_source(path)[0].suffix[1:].lower()
    if suffix in SUFFIXES or suffix in BLENDER_SUFFIXES or suffix in PICTURE_SUFFIXES:
        return suffix
    if suffix in KNOWN:
        how = "in Blender: File > Open or Import, then File > Export > glTF 2.0" if suffix in IN_BLENDER else "with its program"
        raise ModelError(f"{path}: {KNOWN[suffix]} files are not read; convert it to GLB ({how}) and use that")
    if path.is_dir():
        raise ModelError(f"{path}: expected a model file, found a folder: name a file in it")
    expected = f"{', '.join((*SUFFIXES, *BLENDER_SUFFIXES))} or a picture ({', '.join(PICTURE_SUFFIXES)})"
    raise ModelError(f"{path}: expected a model file with suffix {expected}, found {path.suffix or 'none'!r}")


def needs_blender(suffix: str) -> bool:
    """Return whether Blender reads a model at rest: USD files only where usd-core is not installed."""
    return suffix in BLENDER_SUFFIXES and not (suffix in USD and usd.is_available())


def _read(folder: ModelFolder, suffix: str, node: str | None) -> tuple[Mesh, FileFacts]:
    if suffix in GLTF:
        from viewsphere.assets.readers.gltf import read_gltf

        return read_gltf(folder, node)
    if needs_blender(suffix):
        from viewsphere.assets.readers.blender.reading import read_via_blender

        if suffix in USD:
            folder.warn("Blender may lose the transform above a mesh that is below a mesh; pip install 'viewsphere[usd]'")
        return read_via_blender(folder)
    if suffix in USD:
        from viewsphere.assets.readers.usd.scene import read_usd

        return read_usd(folder)
    if suffix == "obj":
        from viewsphere.assets.readers.obj.reading import read_obj

        return read_obj(folder)
    if suffix in PICTURE_SUFFIXES:
        from viewsphere.assets.readers.picture import read_picture

        return read_picture(folder)
    if suffix == "dae":
        from viewsphere.assets.readers.dae.reading import read_dae

        return read_dae(folder)
    if suffix == "stl":
        from viewsphere.assets.readers.stl import read_stl

        return read_stl(folder)
    if suffix == "3mf":
        from viewsphere.assets.readers.threemf.reading import read_3mf

        return read_3mf(folder)
    if suffix == "ply":
        from viewsphere.assets.readers.ply.reading import read_ply

        return read_ply(folder)
    from viewsphere.assets.readers.off import read_off

    return read_off(folder)
