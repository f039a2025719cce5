"""The layers of a USD file. Before composition, all are found and checked to be in the model's folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.usd.library import Ar, Sdf, Tf, Usd, UsdGeom, UsdSkel
from viewsphere.errors import ModelError
from viewsphere.limits import limits

REASON = re.compile(r" : '([^\n]*)")
"""The message after the source position in each of USD's errors."""

PATH = re.compile(r"@?/\S*/([^/\s]*?)[@:]+")


def opened(folder: ModelFolder) -> Any:
    """The composed stage of a file; a missing layer causes a warning, and a layer outside the model's folder is refused."""
    folder.read_model()
    try:
        _check_layers(folder)
        stage = Usd.Stage.Open(str(folder.model))
        strangers = [path for path in _real_paths(stage) if not _may_read(folder, _file_of(path))]
    except Tf.ErrorException as error:
        raise folder.error(f"cannot be read as USD ({_reason(error)}): truncated or damaged") from None
    if strangers:
        raise _outside(folder, strangers[0])
    return stage


def _real_paths(stage: Any) -> list[str]:
    """The files of the layers in use; layers in memory have none."""
    return [str(layer.realPath) for layer in stage.GetUsedLayers() if layer.realPath]


def _check_layers(folder: ModelFolder) -> None:
    """Follow references, payloads and sublayers from layer to layer."""
    waiting, seen = [str(folder.model)], set[str]()
    while waiting:
        name = waiting.pop()
        for other in _named_by(folder, name):
            if other not in seen:
                seen.add(other)
                folder.check("MAX_FILES", len(seen), "layers")
                if _is_readable(folder, other):
                    waiting.append(other)


def _named_by(folder: ModelFolder, name: str) -> list[str]:
    """The layers that a layer names, as paths."""
    try:
        layer: Any = Sdf.Layer.FindOrOpen(name)
        names = layer.GetCompositionAssetDependencies() if layer else []
        return [_absolute(name, str(layer.ComputeAbsolutePath(asset))) for asset in names if asset]
    except Tf.ErrorException as error:
        if name == str(folder.model):
            raise
        folder.warn(f"layer {name!r} cannot be read ({_reason(error)})")
        return []


def _absolute(layer: str, path: str) -> str:
    """The absolute path of a file that a layer names; the library leaves it relative if the file does not exist."""
    return path if Path(path).is_absolute() else str(_file_of(layer).absolute().parent / path)


def _is_readable(folder: ModelFolder, name: str) -> bool:
    """Return whether a layer is a regular file that may be read; warns or raises if it is not."""
    path = _file_of(name)
    is_within = _may_read(folder, path)
    if path.is_absolute() and is_within:
        folder.remember(path)
    if not is_within:
        if path.exists() and not path.is_file():
            raise _outside(folder, name)
        if not path.exists():
            folder.warn(f"layer {name!r} is outside the model's folder, not read; set confined: false to allow")
        return False  # refused after composition, unless only an unselected variant names it
    if not path.is_file():
        folder.warn(f"layer {name!r} does not exist, or cannot be read")
        return False
    folder.check("MAX_FILE_BYTES", path.stat().st_size, f"bytes in layer {path.name}")
    return True


def _outside(folder: ModelFolder, name: str) -> ModelError:
    return folder.error(f"layer {name!r} is outside the model's folder; set confined: false to allow")


def _file_of(name: str) -> Path:
    """The file of a layer; for a layer inside an archive, the archive."""
    return Path(name.partition("[")[0])


def _may_read(folder: ModelFolder, path: Path) -> bool:
    return not folder.confined or path.resolve().is_relative_to(folder.model.parent.resolve())


def _reason(error: Exception) -> str:
    """The library's first error message, without source positions and the file's path."""
    reasons = REASON.findall(str(error)) or [str(error)]
    return PATH.sub("", " ".join(reasons[0].split()))[:120]


def asset_bytes(folder: ModelFolder, path: str) -> bytes | None:
    """Bytes of a file inside an archive, by its resolved path; None if there is none."""
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if asset is None or asset.GetSize() > limits.MAX_FILE_BYTES or not _may_read(folder, _file_of(path)):
        return None
    with asset as opened_asset:
        return bytes(opened_asset.GetBuffer())


def timeline(folder: ModelFolder) -> dict[str, Any]:
    """First and last frame of a file, its frame rate, whether anything moves, and an empty list of animations, since USD has no
    named ones.
    """
    stage = opened(folder)
    first, last = int(stage.GetStartTimeCode()), int(stage.GetEndTimeCode())
    moves = last > first and any(_moves(prim) for prim in stage.Traverse(Usd.TraverseInstanceProxies()))
    return {"first": first, "last": last, "fps": float(stage.GetTimeCodesPerSecond()), "moves": moves, "clips": []}


def _moves(prim: Any) -> bool:
    """Return whether a prim's place, shape or visibility, or a skeleton's pose, changes with time."""
    if prim.IsA(UsdSkel.Animation):
        return any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAttributes())
    if prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
        return True
    is_drawn = prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer)
    attributes = prim.GetAttributes() if is_drawn else [prim.GetAttribute("visibility")]
    return any(attribute and attribute.ValueMightBeTimeVarying() for attribute in attributes)
