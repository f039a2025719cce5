"""The arrays that the shading kernels read, packed once per stage (PictureRays: once per picture). All are float32 unless
stated.

Lengths are in units of half the diagonal of the objects' bounds, from their centre, so that models of any size keep their
precision.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]


class Surfaces(NamedTuple):
    """The materials and vertices of the triangles.

    vertices (V, 16): shading normal, both uv sets, linear colour and alpha, position, two unused (a row is
    a cache line); triangles (T, 3) uint32; material (T,) int32; normals (T, 3): geometric, unit; looks (M, LOOKS): columns
    named in `kernels_material.py`; bundles (M, 12) int32: indices in `Textures`, -1 after the last.
    """

    vertices: Float32
    triangles: NDArray[np.uint32]
    material: Int32
    normals: Float32
    looks: Float32
    bundles: Int32


class Textures(NamedTuple):
    """The mip levels of all textures in one array, as bundles: textures that a material looks up together.

    texels (N,) uint16: for linear light and data, 65,535 means 1; for components of normals, 32,768 means 0 and 65,535 means 1.
    After the last texel there is room for reading three planes at once. levels (X, 16, 3) int32: first word, width and height
    of each level. modes (X, 14) int32: number of levels, wrap along u and v, nearest, uv set, number of planes of four
    channels, kinds of up to six planes, whether the bundle has normals and the coat's normals. transforms (X, 6): rows of the 2
    x 3 matrix on (u, v, 1).
    """

    texels: NDArray[np.uint16]
    levels: Int32
    modes: Int32
    transforms: Float32


class PictureRays(NamedTuple):
    """One picture's rays: direction = rotation.T @ ray.

    eye (3,); rotation (3, 3) world to camera; lens (2, 3): ray = lens @ (column, row, 1) in samples for a pinhole, and -1 for
    panoramas, whose pixels narrow towards the poles; rays (S, 3), empty for a pinhole; columns: samples in a row; pixel: a
    pixel's size at distance 1; scale: factor of depths; places (S, 2): column and row of samples that are not on a grid,
    otherwise empty. shifts (S, 3): from the eye to where each ray begins, for parallel rays and rolling shutters; otherwise
    empty. is_parallel: whether pixels have one size at any distance.
    """

    eye: Float32
    rotation: Float32
    lens: Float32
    rays: Float32
    columns: np.uint32
    pixel: np.float32
    scale: np.float32
    places: Float32 = np.zeros((0, 2), np.float32)
    shifts: Float32 = np.zeros((0, 3), np.float32)
    is_parallel: bool = False

    @property
    def spread(self) -> float:
        """The growth of a pixel's size with distance."""
        return 0.0 if self.is_parallel else float(self.pixel)


class Lightmap(NamedTuple):
    """Light that arrives at still surfaces: at flat ones, which have charts, and at facets of the others.

    nodes (N, 12): see `kernels_lightmap.see`; charts (C, 16): columns named in `kernels_lightmap`; chart (T,) int32: the chart
    of each of the stage's triangles, -1 for none, -2 - k for facet k; empty if there are no charts; facets (F, 5): columns
    named in `kernels_vertex_light`; knots (I,) int32: the points of each facet, row by row; points (P, 12): the weight of each,
    then, multiplied by it, light along x, y and z.
    """

    nodes: Float32
    charts: Float32
    chart: Int32
    facets: Float32
    knots: Int32
    points: Float32


class PatchLight(NamedTuple):
    """The light that patches send.

    keys (S,) uint64, patch (S,) int32: their table, see `kernels_probes.patch`. light (M, 3): the radiance of each patch, -1
    for emissive triangles, whose light arrives through the probes. frame (7,): the box of the probes, and the number of patches
    in a length. materials (T,): those of the triangles that rays can hit, with the numbers used when the table was made.
    """

    keys: NDArray[np.uint64]
    patch: Int32
    light: Float32
    frame: Float32
    materials: Int32


class Bounces(NamedTuple):
    """Light that things reflect onto one another: a volume of probes, and a map of level ground below things that are on it.

    light (cells, 28) float32: irradiance at each probe, columns named in `kernels_bounce`. views (cells * NODES, 4): the view
    of each probe in each direction, see `kernels_views`: radiance of things, and the share of the far background that they
    leave visible. screens (cells, 72): for the cell whose first corner is the probe, the part of the cell that each of its
    eight corners sees. The columns are the normal's x for all eight corners, then y, z and the offset of a plane, in cells from
    the first corner, then those of a second plane, then the weight of a corner that sees nothing. grid (3,) int64: layers, rows
    and columns, 0 for no volume. frame (2, 7): for the volume and for the volume around it, with as many probes, or the same
    volume again: x, y and z of the first probe, cells per length, distance from a surface at which it is read in cells, one
    over the number of cells in which its light ends at the border, and the first probe's row. floor (n, n, 4): radiance of a
    white matt ground lit only by things. floor_frame (4,): its cells per length, its corner's x and y, and whether there is a
    map. lightmap: surfaces for which it is more accurate than probes. sent: the light that patches of things send. near (S, 4),
    or empty: for each sample, the share of the probes' light that arrives, and the light of nearer surfaces
    (`near_field_gather`).
    """

    light: Float32
    views: Float32
    screens: Float32
    grid: NDArray[np.int64]
    frame: Float32
    floor: Float32
    floor_frame: Float32
    lightmap: Lightmap
    sent: PatchLight
    near: Float32


NO_LIGHTMAP = Lightmap(
    np.zeros((1, 12), np.float32),
    np.zeros((0, 16), np.float32),
    np.zeros(0, np.int32),
    np.zeros((0, 5), np.float32),
    np.zeros(0, np.int32),
    np.zeros((1, 12), np.float32),
)
NO_PATCH_LIGHT = PatchLight(
    np.zeros(1, np.uint64),
    np.full(1, -1, np.int32),
    np.zeros((0, 3), np.float32),
    np.zeros(7, np.float32),
    np.zeros(0, np.int32),
)
NO_NEAR = np.zeros((0, 4), np.float32)
NO_BOUNCES = Bounces(
    np.zeros((1, 28), np.float32),
    np.zeros((1, 4), np.float32),
    np.zeros((1, 72), np.float32),
    np.zeros(3, np.int64),
    np.zeros((2, 7), np.float32),
    np.zeros((2, 2, 4), np.float32),
    np.zeros(4, np.float32),
    NO_LIGHTMAP,
    NO_PATCH_LIGHT,
    NO_NEAR,
)
