"""Models as BOP has them: PLY files in millimetres, and what is known of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.formats.bop.entries import MM
from viewsphere.geometry.diameter import diameter
from viewsphere.store import ModelInfo

MILLIMETRES = np.diag([MM, MM, MM, 1.0])


def ply(mesh: Mesh) -> bytes:
    """The vertices that triangles use, mm, with normals, and the triangles, in ASCII."""
    used, corners = np.unique(mesh.triangles, return_inverse=True)
    table = np.hstack([mesh.vertices[used] * np.float64(MM), mesh.normals[used]])
    head = ["ply", "format ascii 1.0", f"element vertex {len(used)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    head += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header"]
    rows = (" ".join(f"{value:.9g}" for value in row) for row in table.tolist())
    faces = (f"3 {a} {b} {c}" for a, b, c in corners.reshape(-1, 3).tolist())
    return ("\n".join([*head, *rows, *faces]) + "\n").encode("ascii")


def facts(info: ModelInfo, mesh: Mesh) -> dict[str, Any]:
    """The entry in models_info.json: box, diameter and symmetries, mm."""
    low, high = mesh.bounds * MM
    found: dict[str, Any] = {
        "diameter": MM * (diameter(mesh.corners) if info.diameter is None else info.diameter),
        **_named("min", low),
        **_named("size", high - low),
    }
    if info.symmetries is not None:
        own = info.symmetries.moved(MILLIMETRES)
        if own.discrete:
            found["symmetries_discrete"] = [np.array(motion).ravel().tolist() for motion in own.discrete]
        if own.continuous:
            found["symmetries_continuous"] = [{"axis": [*c.axis], "offset": [*c.offset]} for c in own.continuous]
    return found


def _named(name: str, values: NDArray[np.float64]) -> dict[str, float]:
    return {f"{name}_{axis}": value for axis, value in zip("xyz", values.tolist(), strict=True)}
