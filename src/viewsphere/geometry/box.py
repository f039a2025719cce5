"""Boxes: the eight vertices and six faces of a 3D box, and the 2D box of what a camera projects.

Object axes: front -Y, up +Z; left (+X) and right (-X) are the object's own sides. 2D boxes are half-open
pixel corners (x0, y0, x1, y1).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from viewsphere.model.camera import Camera

Float = NDArray[np.float64]
Bounds = tuple[float, float, float, float]

VERTEX_SIGNS = (
    (1, 1, -1),
    (1, -1, -1),
    (-1, -1, -1),
    (-1, 1, -1),
    (1, 1, 1),
    (1, -1, 1),
    (-1, -1, 1),
    (-1, 1, 1),
)
"""Side of the box's centre each vertex lies on, in x, y and z; the order of Ruiz et al. 2019."""

FACES: dict[str, tuple[int, int, int, int]] = {
    "bottom": (0, 1, 2, 3),
    "top": (4, 7, 6, 5),
    "right": (2, 6, 7, 3),
    "front": (1, 5, 6, 2),
    "left": (0, 4, 5, 1),
    "back": (4, 0, 3, 7),
}
"""Vertices of each face, in the order of Ruiz et al. 2019 (who call the bottom `ground`)."""

EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""The twelve edges, as pairs of vertices."""

NEAR = 1e-6
"""Metres in front of the camera plane from which a model's projection counts."""

LONG_EDGE, SAMPLES, BISECTIONS = 8.0, 65, 50


def box_vertices(low: ArrayLike, high: ArrayLike) -> Float:
    """The eight vertices (8, 3) of an axis-aligned box between two corners, in the order of `VERTEX_SIGNS`."""
    return np.where(np.array(VERTEX_SIGNS) > 0, np.asarray(high, np.float64), np.asarray(low, np.float64))


def box_size(vertices: Float) -> tuple[float, float, float]:
    """(width along X, height along Z, length along Y) of an axis-aligned box given by its vertices (8, 3)."""
    x, y, z = (float(v) for v in vertices[4] - vertices[2])
    return x, z, y


def clip_to_image(bounds: Bounds, width: int, height: int) -> Bounds | None:
    """The part of a 2D box inside the image [0, width] x [0, height]; None if there is none."""
    x0, y0, x1, y1 = bounds
    if not (x1 > 0 and y1 > 0 and x0 < width and y0 < height):
        return None
    return max(x0, 0.0), max(y0, 0.0), min(x1, float(width)), min(y1, float(height))


def overlap(a: Bounds, b: Bounds) -> bool:
    """Whether two 2D boxes share more than an edge."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def projected_bounds(
    camera: Camera,
    vertices: Float,
    triangles: NDArray[np.int32],
    faces: tuple[int, int],
    points: tuple[int, int],
    is_used: NDArray[np.bool_] | None = None,
) -> tuple[Bounds | None, bool]:
    """The 2D box of triangles [faces) whose corners are world vertices [points), and whether the lens sees
    all of them. `is_used`, if known: of all vertices, whether a triangle has them.

    Triangles that cross the plane z = NEAR of the camera (or the limit of a distorted lens) are cut there.
    None if nothing of them is on the camera's side. Under lens distortion straight edges bend; they are
    followed to 1/100 px.
    """
    from viewsphere.geometry import kernels_box as kernels

    if camera.distortion is not None:
        used = vertices[triangles[faces[0] : faces[1]]]
        x0, y0, x1, y1, whole = _distorted_bounds(camera, used)
        return ((x0, y0, x1, y1) if x0 <= x1 else None), whole
    if faces[0] == faces[1]:
        return None, True
    if is_used is None:
        is_used = np.zeros(len(vertices), np.bool_)
        is_used[triangles[faces[0] : faces[1]]] = True
    base, stop = points
    seen, used = np.empty((3, stop - base)), is_used[base:stop]
    kernels.project(vertices, base, camera.K, camera.R, camera.t, seen)
    u, v, w = seen if used.all() else seen[:, used]
    if w.min() >= NEAR:
        return (float(u.min()), float(v.min()), float(u.max()), float(v.max())), True
    x0, y0, x1, y1, whole = kernels.cut_bounds(vertices, triangles, *faces, *points, camera.K, camera.R, camera.t, NEAR)
    return ((x0, y0, x1, y1) if x0 <= x1 else None), bool(whole)


def _distorted_bounds(camera: Camera, corners: Float) -> tuple[float, float, float, float, bool]:
    """As the kernel, for triangles (T, 3, 3) in the world; long edges are sampled, edges that leave the
    lens' field cut.
    """
    from viewsphere.geometry.camera import project
    from viewsphere.geometry.rotation import rigid, transform

    local = transform(rigid(camera.R, camera.t), corners)
    starts, stops = local.reshape(-1, 3), local[:, (1, 2, 0)].reshape(-1, 3)
    pixels = project(camera.intrinsics, starts)[0]
    ends = pixels.reshape(-1, 3, 2)[:, (1, 2, 0)].reshape(-1, 2)
    seen, end_seen = ~np.isnan(pixels[:, 0]), ~np.isnan(ends[:, 0])
    long = seen & end_seen
    long[long] = np.abs(pixels[long] - ends[long]).max(axis=1) > LONG_EDGE
    s = np.linspace(0, 1, SAMPLES)[:, None, None]
    bent = project(camera.intrinsics, (starts[long] + s * (stops[long] - starts[long])).reshape(-1, 3))[0]
    leaving, entering = seen & ~end_seen, ~seen & end_seen
    inside = np.concatenate([starts[leaving], stops[entering]])
    outside = np.concatenate([stops[leaving], starts[entering]])
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2
        shown = ~np.isnan(project(camera.intrinsics, middle)[0][:, :1])
        inside, outside = np.where(shown, middle, inside), np.where(shown, outside, middle)
    points = np.concatenate([pixels, bent, project(camera.intrinsics, inside)[0]])
    points = points[~np.isnan(points[:, 0])]
    if not len(points):
        return math.inf, math.inf, -math.inf, -math.inf, bool(seen.all())
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0, y0, x1, y1, bool(seen.all())
