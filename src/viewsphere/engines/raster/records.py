"""The arrays that the shading kernels read, packed once per stage (View: once per picture). All float32 unless said.

Lengths are in units of half the diagonal of the objects' bounds, from their centre: models of any size keep their digits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]


class Surfaces(NamedTuple):
    """What the triangles are made of.

    vertices (V, 16): shading normal, both uv sets, linear colour and alpha, position, two unused (a row is
    a cache line); triangles (T, 3) uint32; material (T,) int32; density (T, 4): square per square length of each uv
    set; normals (T, 3): geometric, unit; materials (M, 18) and slots (M, 3) int32: columns named in `surface.py`.
    """

    vertices: Float32
    triangles: NDArray[np.uint32]
    material: Int32
    density: Float32
    normals: Float32
    materials: Float32
    slots: Int32

    @property
    def has_scenery(self) -> bool:
        """Whether any material is scenery's: the last column of `materials`."""
        return bool(self.materials[:, -1].any())


class Textures(NamedTuple):
    """All mip levels of all textures in one array.

    texels (N, 4) uint16, linear; levels (X, 16, 3) int32: first texel, width and height of each level; modes (X, 5) int32:
    number of levels, wrap along u and v, nearest, uv set; transforms (X, 6): rows of the 2 x 3 matrix on
    (u, v, 1).
    """

    texels: NDArray[np.uint16]
    levels: Int32
    modes: Int32
    transforms: Float32


class Light(NamedTuple):
    """Sun, sky and what they leave on the ground; radiance and irradiance times the exposure.

    sun (3,) direction; sun_color (3,) irradiance; sky (4, 3): radiance of a white surface under the upper half of the sky
    as a cubic in its normal's z; zenith, horizon, earth (3,) radiance above, beside and below; shadow (N, N): nearest
    depth seen from the sun; shadow_low and shadow_high: its bounds around each block; shadow_from_world (3, 4) in texels;
    wide (K, N, N), wide_low, wide_high and wide_from_world (K, 3, 4): the same of scenery alone, each wider than the one
    before, for what lies beyond `shadow`; ground (n, n, 2): share of the sky's and of all light that the targets leave to
    what they stand on; ground_frame (6,): map cells per length, its corner x and y, the z they stand on, their height, 1 if
    they stand on anything.
    """

    sun: Float32
    sun_color: Float32
    sky: Float32
    zenith: Float32
    horizon: Float32
    earth: Float32
    shadow: Float32
    shadow_low: Float32
    shadow_high: Float32
    shadow_from_world: Float32
    wide: Float32
    wide_low: Float32
    wide_high: Float32
    wide_from_world: Float32
    ground: Float32
    ground_frame: Float32


class View(NamedTuple):
    """One picture's rays: direction = rotation.T @ ray.

    eye (3,); rotation (3, 3) world to camera; lens (2, 3): ray = lens @ (column, row, 1) in samples;
    rays (rows * columns, 3), empty for a pinhole; columns: samples in a row; pixel: a pixel's size at distance 1;
    scale: of depths.
    """

    eye: Float32
    rotation: Float32
    lens: Float32
    rays: Float32
    columns: np.uint32
    pixel: np.float32
    scale: np.float32
