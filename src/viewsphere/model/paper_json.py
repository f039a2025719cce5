"""The pieces of JSON that Ruiz et al. 2019 (VipIMAGE) write, in their native format and in their COCO files
alike.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box import FACES
from viewsphere.model.camera import Camera
from viewsphere.model.shot import Size


def json_bytes(value: Any) -> bytes:
    """Compact JSON, floats to the last digit; raises ValueError for NaN and infinity."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode("ascii")


def faces(points: NDArray[np.float64]) -> dict[str, dict[str, list[float] | None]]:
    """A box's vertices (8, n) as {face: {vertex: [coordinates]}}, None for a vertex that is NaN."""
    values = [None if math.isnan(p[0]) else p for p in points.tolist()]
    named = zip(("ground", *list(FACES)[1:]), FACES.values(), strict=True)
    return {name: {str(v): values[v] for v in face} for name, face in named}


def vehicle(category: str, supercategory: str, file: str, box: NDArray[np.float64], real_size: Size | None) -> dict[str, Any]:
    """A model: its file, its 3D box in its own axes and its true size, in metres."""
    sizes = zip(("width", "height", "length"), real_size or (None, None, None), strict=True)
    return {
        "supercategory": supercategory,
        "category": category,
        "model_file": file,
        "bbox3D_model": faces(box),
        "real_size": dict(sizes),
    }


def transformation_matrix(camera: Camera) -> dict[str, list[list[float]]]:
    """K (3, 3) and RT (3, 4), world to camera; the lens' distortion is not in it."""
    motion = zip(camera.R.tolist(), camera.t.tolist(), strict=True)
    return {"K": camera.K.tolist(), "RT": [[*row, t] for row, t in motion]}
