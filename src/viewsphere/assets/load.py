"""Loading of any model file as a raw mesh, in the file's own axes and unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from viewsphere import plugins
from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.readers import missing, reader_of, readers, suffixes
from viewsphere.errors import ModelError
from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.primitive import FileFacts

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
"""Unsupported model formats by suffix."""

IN_BLENDER = {"x3d", "wrl"}
"""Formats of `KNOWN` that Blender opens with an extension."""


def load_model(
    path: Path, *, confined: bool = True, shown: tuple[str, ...] = (), node: str | None = None
) -> tuple[Mesh, FileFacts]:
    """Read a model file, in this process: its triangles in its own axes and unit, and its own statements about both.

    The suffix selects the reader, whose spec has the axes and the unit of such files (`readers`). In .blend files,
    `file.blend/Object/NAME` and `file.blend/Collection/NAME` select parts. With `confined`, files that the model names
    (textures, buffers, material libraries) are read only from its own folder and below. `shown` are objects of a .blend file
    that are read although renders do not show them. `node` names a node of a glTF file; only the nodes below it are read.
    Raises ModelError in one line that names the file: missing, empty, truncated, not a model, no triangles, or more of them
    than `limits` allows.
    """
    reader = _reader(path)
    from viewsphere.assets.paths.folder import ModelFolder

    file, inside = split_source(path)
    # NaN and infinity are found and reported once the whole file is read.
    with np.errstate(all="ignore"):
        return reader.read(ModelFolder(file, confined, inside, shown, node=node))


def load_frames(
    path: Path,
    frames: Sequence[int],
    *,
    confined: bool = True,
    shown: tuple[str, ...] = (),
    clip: str | None = None,
    fps: float | None = None,
) -> Iterator[tuple[Mesh, FileFacts]]:
    """A model file's meshes at its first frame, then at each of the ascending `frames`; the file is opened once.

    `clip` names the animation to play if the file has several; `fps` is the frame rate, None for the file's own.

    Otherwise as `load_model`; ModelError for files that cannot move.
    """
    reader = animated_reader(path)
    from viewsphere.assets.paths.folder import ModelFolder

    file, inside = split_source(path)
    folder = ModelFolder(file, confined, inside, shown, clip, fps)
    with np.errstate(all="ignore"):
        assert reader.frames is not None
        yield from reader.frames(folder, frames)


def animated_reader(path: Path) -> ReaderSpec:
    """The reader of a file whose format may hold a readable animation; ModelError for other formats."""
    suffix = check_source(path)
    reader = reader_of(suffix, moving=True)
    if reader is None:
        moving = dict.fromkeys(suffix for one in readers().values() if one.frames is not None for suffix in one.suffixes)
        raise ModelError(f"{path}: expected a file that can move ({', '.join(moving)}) for frames, found {suffix}")
    return reader


def check_source(path: Path) -> str:
    """The file's suffix in lower case, without its dot; ModelError when files of its kind are not read."""
    suffix = suffix_of(path)
    if reader_of(suffix) is not None:
        return suffix
    if suffix in KNOWN:
        how = "in Blender: File > Open or Import, then File > Export > glTF 2.0" if suffix in IN_BLENDER else "with its program"
        raise ModelError(f"{path}: {KNOWN[suffix]} files are not read; convert it to GLB ({how}) and use that")
    if path.is_dir():
        raise ModelError(f"{path}: expected a model file, found a folder: name a file in it")
    blender = [suffix for suffix in suffixes() if any(one.by_blender for one in readers().values() if suffix in one.suffixes)]
    others = [suffix for suffix in suffixes() if suffix not in blender]
    pictures = [suffix for one in readers().values() if one.is_picture for suffix in one.suffixes]
    expected = f"{', '.join((*others, *blender))} or a picture ({', '.join(pictures)})"
    raise ModelError(f"{path}: expected a model file with suffix {expected}, found {path.suffix or 'none'!r}{_unloaded()}")


def _unloaded() -> str:
    """A hint at third-party readers that cannot be loaded; empty without any."""
    names = [name for name in plugins.names("readers") if name not in readers()]
    return f"; {', '.join(names)} cannot be loaded: see `viewsphere plugins`" if names else ""


def suffix_of(path: Path) -> str:
    """The suffix of a source's file, in lower case and without its dot."""
    return split_source(path)[0].suffix[1:].lower()


def needs_blender(suffix: str) -> bool:
    """Return whether Blender reads a model at rest: USD files only where usd-core is not installed."""
    reader = reader_of(suffix)
    return reader is not None and reader.by_blender


def _reader(path: Path) -> ReaderSpec:
    """The reader of a file; raises ModelError if there is none, or its packages are not installed."""
    reader = reader_of(check_source(path))
    assert reader is not None
    if absent := missing(reader):
        names, are = " and ".join(absent), "is" if len(absent) == 1 else "are"
        raise ModelError(f"{path}: needs {names}, which {are} not installed: pip install '{reader.install}'")
    return reader
