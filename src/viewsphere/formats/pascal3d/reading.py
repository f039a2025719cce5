"""Reads PASCAL3D+'s records and CAD models from MATLAB files."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError, UserError
from viewsphere.formats._viewpoint_mat import scipy_io
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import quaternion_from_matrix, rigid, transform
from viewsphere.limits import limits
from viewsphere.model.camera import Intrinsics

MISTAKES = (
    LookupError,
    TypeError,
    ValueError,
    AttributeError,
    ArithmeticError,
    OSError,
    NotImplementedError,
    UserError,
    zlib.error,
)
"""Errors of MATLAB files that are broken, or of another structure."""

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """An object of a picture: its category, the number of its CAD model from 1, the lens that shows it, pixels from the corner,
    and its pose in the camera (4, 4), in the CAD model's unit.
    """

    category: str
    cad: int
    lens: Intrinsics
    camera_from_object: Float


@dataclass(frozen=True)
class Record:
    """A picture: its file, its objects of known viewpoint, and how many others there are."""

    filename: str
    objects: tuple[Seen, ...]
    others: int


def read_record(file: Path) -> Record:
    """A picture's annotations; raises one of MISTAKES for a file that holds none."""
    record = _loaded(file, "record")
    size = [int(value) for value in np.ravel(record.imgsize)[:2]]
    objects = [one for one in np.ravel(np.asarray(record.objects, object)) if hasattr(one, "_fieldnames")]
    lens = _true_lens(record, size)
    seen = [_seen(one, size, lens) for one in objects]
    found = tuple(one for one in seen if one is not None)
    return Record(str(getattr(record, "filename", "")), found, len(seen) - len(found))


def read_cads(file: Path, category: str) -> tuple[tuple[Float, NDArray[np.int64]], ...]:
    """Vertices (V, 3) and triangles (T, 3) of a category's CAD models; raises StoreError for a file that has none."""
    try:
        return tuple(_shape(one) for one in np.ravel(np.asarray(_loaded(file, category), object)))
    except MISTAKES as error:
        raise StoreError(f"{file}: expected CAD models of {category}; found: {error}") from None


def off_bytes(vertices: Float, triangles: NDArray[np.int64]) -> bytes:
    """A model as OFF text."""
    rows = [f"OFF\n{len(vertices)} {len(triangles)} 0"]
    rows += [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles.tolist()]
    return ("\n".join(rows) + "\n").encode()


def _loaded(file: Path, variable: str) -> Any:
    """A variable of a MATLAB file."""
    size, most = file.stat().st_size, limits.MAX_MAT_BYTES
    if size > most:
        raise ValueError(f"expected at most {most:,} bytes (limit MAX_MAT_BYTES); found {size:,}")
    data = BytesIO(file.read_bytes())
    return scipy_io("pascal3d").loadmat(data, squeeze_me=True, struct_as_record=False, variable_names=[variable])[variable]


def _shape(said: Any) -> tuple[Float, NDArray[np.int64]]:
    vertices = np.array(said.vertices, np.float64).reshape(-1, 3)
    triangles = np.array(said.faces, np.int64).reshape(-1, 3) - 1
    if not np.isfinite(vertices).all() or (triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices)):
        raise ValueError("vertices that are not finite, or triangles of others than these")
    return vertices, triangles


def _true_lens(record: Any, size: list[int]) -> Intrinsics | None:
    """The lens that a record of viewsphere's own says, None in others."""
    if not hasattr(record, "K"):
        return None
    k = np.array(record.K, np.float64).reshape(3, 3)
    lens = {"fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2] - 0.5, "cy": k[1, 2] - 0.5, "skew": k[0, 1]}
    return Intrinsics.model_validate({"width": size[0], "height": size[1], **lens})


def _seen(said: Any, size: list[int], lens: Intrinsics | None) -> Seen | None:
    """An object; None for one of which nobody knows the exact viewpoint, or the model."""
    number = np.ravel(np.asarray(getattr(said, "cad_index", ())))
    if number.size != 1 or not hasattr(said, "viewpoint"):
        return None
    category, cad = str(getattr(said, "class")), int(number[0])
    if lens is not None and hasattr(said, "RT"):
        motion = np.array(said.RT, np.float64).reshape(3, 4)
        quaternion_from_matrix(motion[:, :3])
        return Seen(category, cad, lens, rigid(motion[:, :3], motion[:, 3]))
    names = ("azimuth", "elevation", "theta", "distance", "viewport", "focal", "px", "py")
    values = [_number(getattr(said.viewpoint, name, math.nan)) for name in names]
    azimuth, elevation, theta, distance, viewport, focal, px, py = values
    if not (all(map(math.isfinite, values)) and distance > 0):
        return None
    own = Intrinsics(width=size[0], height=size[1], fx=viewport * focal, fy=viewport * focal, cx=px - 0.5, cy=py - 0.5)
    a, e, t = (math.radians(angle) for angle in (azimuth, elevation, theta))
    rotation = orbit_rotation(a, e, t)
    return Seen(category, cad, own, rigid(rotation, -transform(rotation, orbit_center(a, e, distance))))


def _number(value: Any) -> float:
    """A number of MATLAB's; NaN for nothing."""
    found = np.ravel(np.asarray(value, np.float64))
    return float(found[0]) if found.size == 1 else math.nan
