"""Mesh: triangles with all glTF 2.0 material fields, from any file format."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

Wrap = Literal["repeat", "clamp", "mirror"]
WRAPS: tuple[Wrap, ...] = get_args(Wrap)
"""Wrap modes; kernels refer to a mode by its index here."""


@dataclass(frozen=True, eq=False)
class Image:
    """Pixels (H, W, 4) uint8 RGBA, row 0 on top, encoded as in the file (sRGB for colours, linear for data)."""

    name: str
    pixels: NDArray[np.uint8]


@dataclass(frozen=True)
class Texture:
    """One use of an image: glTF's uv (v = 0 is the image's top row), KHR_texture_transform included."""

    image: int
    texcoord: int = 0
    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    nearest: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """KHR_texture_transform, (2, 3) float64: scale, then rotate by r radians, then offset.

        With c = cos r and s = sin r, u' = c scale_u u + s scale_v v + offset_u and v' = -s scale_u u + c scale_v v + offset_v
        (https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_texture_transform).
        """
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        (u, v), (x, y) = self.scale, self.offset
        return np.array([[c * u, s * v, x], [-s * u, c * v, y]])


HIGHEST_IOR = 4.0
"""Greatest index of refraction for a file's material: germanium's; diamond's is 2.4."""


@dataclass(frozen=True)
class Material:
    """glTF 2.0 metallic-roughness and its common extensions; colours linear.

    https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#materials; `emissive` includes
    KHR_materials_emissive_strength.
    """

    name: str = ""
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    base_color_texture: Texture | None = None
    metallic: float = 0.0
    roughness: float = 0.8
    metallic_roughness_texture: Texture | None = None  # green: roughness, blue: metallic
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    occlusion_texture: Texture | None = None  # red
    occlusion_strength: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emissive_texture: Texture | None = None
    alpha_mode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alpha_cutoff: float = 0.5
    double_sided: bool = True
    unlit: bool = False
    clearcoat: float = 0.0
    clearcoat_texture: Texture | None = None
    clearcoat_roughness: float = 0.0
    clearcoat_roughness_texture: Texture | None = None
    clearcoat_normal_texture: Texture | None = None
    transmission: float = 0.0
    transmission_texture: Texture | None = None
    ior: float = 1.5
    thickness: float = 0.0  # of transmitting materials; 0: a thin sheet without refraction, else the surface bounds a solid
    specular: float = 1.0
    specular_texture: Texture | None = None
    specular_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    specular_color_texture: Texture | None = None


@dataclass(frozen=True, eq=False)
class Mesh:
    """A whole model as one triangle list; object axes: metres, +Z up, front -Y (once normalised).

    vertices (V, 3) float32; triangles (T, 3) int32, counter-clockwise seen from outside; normals (V, 3) float32, unit length,
    for shading; uv0, uv1 (V, 2) float32 or None; colors (V, 4) float32 linear or None, multiplied with the base colour;
    triangle_material, triangle_part (T,) int32 index `materials` and `parts` (never empty). triangle_body_part (T,) int32: the
    triangle's entry in `body_parts`, counted from 1, 0 for none; None for models without bones. `warnings` report the repairs
    and omissions of the file's reader.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]
    triangle_material: NDArray[np.int32]
    triangle_part: NDArray[np.int32]
    materials: tuple[Material, ...] = (Material(),)
    parts: tuple[str, ...] = ("object",)
    uv0: NDArray[np.float32] | None = None
    uv1: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    images: tuple[Image, ...] = ()
    warnings: tuple[str, ...] = field(default=())
    triangle_body_part: NDArray[np.int32] | None = None
    body_parts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse arrays of the wrong shape or dtype, and indices out of range."""
        v, t = len(self.vertices), len(self.triangles)
        expected = {
            "vertices": ((v, 3), np.float32),
            "triangles": ((t, 3), np.int32),
            "normals": ((v, 3), np.float32),
            "triangle_material": ((t,), np.int32),
            "triangle_part": ((t,), np.int32),
            "uv0": ((v, 2), np.float32),
            "uv1": ((v, 2), np.float32),
            "colors": ((v, 4), np.float32),
            "triangle_body_part": ((t,), np.int32),
        }
        for name, (shape, dtype) in expected.items():
            array = getattr(self, name)
            if array is not None and (array.shape != shape or array.dtype != dtype):
                raise ValueError(f"Mesh.{name}: expected {shape} {np.dtype(dtype)}, got {array.shape} {array.dtype}")
        limits = (
            ("triangles", v),
            ("triangle_material", len(self.materials)),
            ("triangle_part", len(self.parts)),
            ("triangle_body_part", len(self.body_parts) + 1),
        )
        for name, limit in limits:
            array = getattr(self, name)
            if array is not None and array.size and (array.min() < 0 or array.max() >= limit):
                raise ValueError(f"Mesh.{name}: expected indices in [0, {limit}), got {array.min()}..{array.max()}")

    def emptied(self) -> Mesh:
        """The same model without any triangle."""
        return replace(
            self,
            triangles=self.triangles[:0],
            triangle_material=self.triangle_material[:0],
            triangle_part=self.triangle_part[:0],
            triangle_body_part=None if self.triangle_body_part is None else self.triangle_body_part[:0],
        )

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner of the vertices that triangles use, (2, 3) float64."""
        corners = self.corners
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    @property
    def corners(self) -> NDArray[np.float64]:
        """The vertices that triangles use, (N, 3) float64."""
        used = np.zeros(len(self.vertices), bool)
        used[self.triangles] = True
        return self.vertices[used].astype(np.float64)
