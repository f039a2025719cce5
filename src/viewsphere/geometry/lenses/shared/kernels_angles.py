"""Compiled functions of angles. numpy's own differ between processors in the last digits; labels must not."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import njit


@njit
def to_angles(points, at):
    """Fill at (2, N) with positions at radius theta in the plane of angles, for points (N, 3) at angle theta from the z axis.

    NaN at the camera's centre and straight behind it.
    """
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        r = math.sqrt(x * x + y * y)
        if r > 0.0:
            scale = math.atan2(r, z) / r
            at[0, i], at[1, i] = x * scale, y * scale
        else:
            at[0, i] = at[1, i] = 0.0 if z > 0.0 else np.nan


@njit
def from_angles(x, y, directions):
    """Fill directions (N, 3) with unit vectors for positions (N,) of the plane of angles: the inverse of `to_angles`."""
    for i in range(x.shape[0]):
        theta = math.sqrt(x[i] * x[i] + y[i] * y[i])
        scale = math.sin(theta) / theta if theta > 0.0 else 1.0
        directions[i, 0], directions[i, 1], directions[i, 2] = x[i] * scale, y[i] * scale, math.cos(theta)


@njit
def tangents(angles, out):
    """Fill out (N,) with the tangents of angles (N,)."""
    for i in range(angles.shape[0]):
        out[i] = math.tan(angles[i])


@njit
def arctangents(tangents, out):
    """Fill out (N,) with the angles of tangents (N,)."""
    for i in range(tangents.shape[0]):
        out[i] = math.atan(tangents[i])
