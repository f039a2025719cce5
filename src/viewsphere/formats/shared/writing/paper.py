"""The pieces of JSON that Ruiz et al. 2019 (VipIMAGE) use both in their native format and in their COCO files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.sensors.camera import Camera
from viewsphere.store import ModelInfo


def json_bytes(value: Any) -> bytes:
    """Compact JSON, floats to the last digit. Raises StoreError for NaN and infinity, which come from damaged records."""
    try:
        return json.dumps(value, separators=(",", ":"), allow_nan=False).encode("ascii")
    except ValueError as error:
        raise StoreError(f"labels: expected finite numbers, found {error}: viewsphere check says which frame's") from None


def faces(points: NDArray[np.float64]) -> dict[str, dict[str, list[float] | None]]:
    """A box's vertices (8, n) as {face: {vertex: [coordinates]}}, None for a vertex that is NaN."""
    values = [None if math.isnan(p[0]) else p for p in points.tolist()]
    named = Box3d.numbered_faces().items()
    return {"ground" if name == "bottom" else name: {str(v): values[v] for v in face} for name, face in named}


def vehicles(models: Iterable[ModelInfo]) -> dict[str, dict[str, Any]]:
    """Models by key: file, 3D box in the model's own axes and true size, in metres."""
    return {info.key: _vehicle(info) for info in models}


def _vehicle(info: ModelInfo) -> dict[str, Any]:
    sizes = zip(("width", "height", "length"), info.real_size or (None, None, None), strict=True)
    return {
        "supercategory": info.supercategory,
        "category": info.category,
        "model_file": f"./MODELS/{info.track or info.key}/{PurePosixPath(info.obj).name}",
        **(_deforming(info) if info.step else {}),
        "bbox3D_model": faces(info.box3d_object),
        "real_size": dict(sizes),
        **({"credit": info.credit.model_dump(exclude_none=True)} if info.credit else {}),
    }


def _deforming(info: ModelInfo) -> dict[str, Any]:
    """The fields of a deforming model: the file of all its time steps, beside the file of this step, and the step's frame
    there.
    """
    assert info.step is not None
    track = {"id_track": info.track} if info.track else {}
    return {"animation": PurePosixPath(info.glb).name, "frame": info.step.frame, "seconds": info.step.seconds, **track}


def transformation_matrix(camera: Camera) -> dict[str, list[list[float]]]:
    """K (3, 3) and RT (3, 4), world to camera, without the lens' distortion."""
    motion = zip(camera.R.tolist(), camera.t.tolist(), strict=True)
    return {"K": camera.K.tolist(), "RT": [[*row, t] for row, t in motion]}
