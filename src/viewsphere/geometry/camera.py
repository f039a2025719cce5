"""The geometry of cameras: orbit viewpoints, pinhole projection, lens distortion.

World: right-handed, Z up, metres. Camera axes: x right, y down, z forward (OpenCV). The image spans [0, W] x [0, H];
pixel (i, j) has its centre at (i + .5, j + .5).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from viewsphere.geometry.lens import Distortion, Intrinsics

Float = NDArray[np.float64]
Window = tuple[int, int, int, int]
"""Pixels [x0, x1) x [y0, y1) as (x0, y0, x1, y1); may reach outside the image."""


def orbit_center(azimuth: float, elevation: float, distance: float) -> Float:
    """Camera centre relative to the target, (3,) metres; angles in radians.

    At azimuth 0 the camera stands on -Y and looks along +Y, the rig of Ruiz et al. 2019 and of PASCAL3D+.
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return distance * np.array([ce * sa, -ce * ca, se])


def orbit_rotation(azimuth: float, elevation: float, tilt: float = 0.0) -> Float:
    """World-to-camera rotation (3, 3); angles in radians.

    No look-at: elevation 90 degrees is well defined. A positive tilt rolls the camera clockwise seen from behind it.
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    level = np.array([[ca, sa, 0.0], [se * sa, -se * ca, -ce], [-ce * sa, ce * ca, -se]])
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array(
        [c * level[0] + s * level[1], c * level[1] - s * level[0], level[2]]
    )  # not @: BLAS' rounding varies by processor


def orbit_angles(rotation: ArrayLike) -> tuple[float, float, float]:
    """Azimuth, elevation and tilt, radians, whose `orbit_rotation` is this world-to-camera rotation (3, 3).

    Straight above and below, where only the sum or difference of azimuth and tilt is defined, tilt is 0.
    """
    right, _, forward = np.asarray(rotation, np.float64).tolist()
    level = math.hypot(forward[0], forward[1])
    elevation = math.atan2(-forward[2], level)
    if level < 1e-12:
        return math.atan2(right[1], right[0]), elevation, 0.0
    azimuth = math.atan2(-forward[0], forward[1])
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    across = right[0] * ca + right[1] * sa
    down = right[0] * se * sa - right[1] * se * ca - right[2] * ce
    return azimuth, elevation, math.atan2(down, across)


def focal_from_fov(fov: float, extent: float, fisheye: bool = False) -> float:
    """Focal length in pixels with which `extent` pixels span the full angle `fov` (radians).

    It is extent / (2 tan(fov / 2)) for a pinhole and extent / fov for an (equidistant) fisheye.
    """
    return extent / fov if fisheye else extent / (2 * math.tan(fov / 2))


def focal_from_sensor(focal: float, sensor: float, extent: float) -> float:
    """Focal length in pixels from the lens' focal length and the sensor's size along `extent` pixels (any one unit)."""
    return focal / sensor * extent


def inverse_camera_matrix(intrinsics: Intrinsics) -> Float:
    """K^-1, (3, 3): pixels to (x/z, y/z, 1)."""
    i = intrinsics
    return np.array(
        [
            [1 / i.fx, -i.skew / (i.fx * i.fy), (i.skew * i.cy / i.fy - i.cx) / i.fx],
            [0.0, 1 / i.fy, -i.cy / i.fy],
            [0.0, 0.0, 1.0],
        ]
    )


def pixel_rays(intrinsics: Intrinsics, subdivision: int = 1, window: Window | None = None) -> Float:
    """Rays through sample centres in camera axes, (H, W, 3): `subdivision` x `subdivision` samples a pixel.

    z is 1 for a pinhole and for Brown-Conrady; the rays of a fisheye and of a scan are unit vectors and may look sideways or
    back. NaN where the lens model has no ray for a pixel. `window` (x0, y0, x1, y1) replaces the image by other pixels, which
    may lie outside it.
    """
    x0, y0, x1, y1 = (subdivision * e for e in window or (0, 0, intrinsics.width, intrinsics.height))
    rays = np.empty((y1 - y0, x1 - x0, 3))
    lens, i = intrinsics.distortion, intrinsics
    if lens is None:
        y = ((np.arange(y0, y1) + 0.5) / subdivision - i.cy) / i.fy
        x = (np.arange(x0, x1) + 0.5) / subdivision - i.cx
        rays[..., 0] = (x - i.skew * y[:, None]) / i.fx
        rays[..., 1] = y[:, None]
        rays[..., 2] = 1.0
        return rays
    from viewsphere.geometry import kernels_lens as kernels

    k, limit = coefficients(lens), lens_limit(lens)
    cast = {"fisheye": kernels.rays_fisheye, "scan": kernels.rays_scan, "brown_conrady": kernels.rays_brown}[lens.model]
    cast(k, limit, i.K, x0, y0, subdivision, rays)
    return rays


def project(intrinsics: Intrinsics, points: ArrayLike) -> tuple[Float, NDArray[np.bool_]]:
    """Pixels at which points (..., 3) in camera axes appear.

    Returns pixels (..., 2) float64, NaN where the lens does not show the point (behind a pinhole, folded back by Brown-Conrady,
    beyond a fisheye's largest angle, straight above or below a scan), and in_front (...) bool, z > 0. A fisheye and a scan may
    show points that are not in front.
    """
    points = np.asarray(points, np.float64)
    in_front = points[..., 2] > 0
    lens, i = intrinsics.distortion, intrinsics
    flat = np.ascontiguousarray(points.reshape(-1, 3))
    if lens is None:
        z = np.where(in_front.reshape(-1), flat[:, 2], np.nan)
        x, y = flat[:, 0] / z, flat[:, 1] / z
    else:
        from viewsphere.geometry import kernels_lens as kernels

        out = np.empty((len(flat), 2))
        maps = {"fisheye": kernels.distort_fisheye, "scan": kernels.distort_scan, "brown_conrady": kernels.distort_brown}
        maps[lens.model](coefficients(lens), lens_limit(lens), flat, out)
        x, y = out.T
    pixels = np.stack([i.fx * x + i.skew * y + i.cx, i.fy * y + i.cy], axis=-1)
    return pixels.reshape(*points.shape[:-1], 2), in_front


def has_unit_rays(lens: Distortion | None) -> bool:
    """Return whether a lens' rays are unit vectors, which may look anywhere, instead of vectors of z = 1."""
    return lens is not None and lens.model != "brown_conrady"


def lens_limit(lens: Distortion) -> float:
    """Return the limit within which the lens map is one-to-one.

    The limit is a radius r/z for Brown-Conrady (may be infinite), an angle for a fisheye; a scan has no limit.

    Beyond this limit a distortion polynomial folds the picture back on itself, as no real lens does. A fisheye's radius must
    rise with the angle. Brown-Conrady's Jacobian is symmetric (the map is the gradient of a potential). Inside the limit it
    is positive definite all around, so the potential is convex and no two rays meet in a pixel.
    """
    return _limit(lens.model, tuple(coefficients(lens).tolist()))


@lru_cache(maxsize=64)
def _limit(model: str, k: tuple[float, ...]) -> float:
    if model == "scan":
        return math.inf
    if model == "fisheye":
        slope = np.array([9 * k[3], 7 * k[2], 5 * k[1], 3 * k[0], 1.0])
        return min(math.pi, math.sqrt(_first_positive_root(slope)))
    numerator, denominator = np.array([k[4], k[1], k[0], 1.0]), np.array([k[7], k[6], k[5], 1.0])
    twice_s = np.array([2.0, 0.0])
    rising = np.polymul(np.polyadd(numerator, np.polymul(twice_s, np.polyder(numerator))), denominator)
    falling = np.polymul(twice_s, np.polymul(numerator, np.polyder(denominator)))
    slope = np.asarray(np.polysub(rising, falling), np.float64)
    radial = math.sqrt(min(_first_positive_root(p) for p in (slope, numerator, denominator)))
    tangential = math.hypot(k[2], k[3])
    return radial if tangential == 0 else _tangential_limit(numerator, denominator, slope, tangential, radial)


def _tangential_limit(numerator: Float, denominator: Float, slope: Float, tangential: float, radial: float) -> float:
    """The radius, at most `radial`, up to which the Jacobian stays positive definite in spite of the tangential terms.

    In polar axes at angle psi from these terms' direction, with c, s = cos(psi), sin(psi), the Jacobian is
    [[a + 6 m c, -2 m s], [-2 m s, b + 2 m c]], where a and b are the radial map's derivative and factor, m = |p| r. The
    Jacobian's determinant is quadratic in c, so its least value over c has a closed form.
    """

    def definite(r: Float) -> NDArray[np.bool_]:
        s, m = r * r, tangential * r
        d = np.polyval(denominator, s)
        a, b = np.polyval(slope, s) / (d * d), np.polyval(numerator, s) / d
        inner = (a + 3 * b >= 16 * m) | (a * b - 4 * m * m > (a + 3 * b) ** 2 / 16)
        return (a > 6 * m) & (b > 2 * m) & inner

    radii = np.tan(np.linspace(0.0, min(math.atan(radial), 1.57), 8192))[:-1]
    good = definite(radii)
    if good.all():
        return min(radial, float(radii[-1]))
    first = int(np.argmin(good))
    low, high = float(radii[first - 1]), float(radii[first])
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if definite(np.array(middle)) else (low, middle)
    return low


def _first_positive_root(polynomial: Float) -> float:
    """Smallest positive root of a polynomial (highest power first) whose constant term is 1; infinite if there is none.

    Solved for 1/s, which keeps the leading coefficient at 1 however small the other coefficients are.
    """
    roots = np.roots(polynomial[::-1])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 1e-12)]
    return 1.0 / float(real.max()) if len(real) else math.inf


def coefficients(lens: Distortion) -> Float:
    """The lens' coefficients, padded with zeros to the model's full length; a scan's in radians, of two rings at least."""
    if lens.model == "scan":
        lone = (lens.coefficients[-1] - 1.0,) if len(lens.coefficients) == 2 else ()
        return np.array([math.radians(angle) for angle in (*lens.coefficients, *lone)])
    k = np.zeros(4 if lens.model == "fisheye" else 8)
    k[: len(lens.coefficients)] = lens.coefficients
    return k
