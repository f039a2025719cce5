"""The reduction of models' textures to the resolution that a frame can show.

Cycles has no mip levels. If many texels fall into one pixel, each look-up waits for memory (a tenth of a frame's time in total)
and returns the noise of one texel instead of the mean. So a texture is halved, by means of 2 x 2 texels, while at least
`FINEST` texels remain in each pixel, along a line, at any place of the model and any rotation.

The number of halvings depends only on the frame's own camera, so a frame does not depend on those rendered before. Textures
that cut out are never halved, because labels use each texel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.repaint import repainted
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.geometry.rotation import transform
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Repaint, Thing

FINEST = 2.0
"""Minimum texels of a halved texture in a pixel, along a line."""

UNSEEN = 1.0
"""Total pixels that triangles with fewer than `FINEST` texels may cover: slivers, and triangles that the texture's coordinates
map to a line or a point.
"""

BUMPED = 0.25
"""Share of the spread of averaged normals that is added to the fourth power of roughness: measured against Cycles' pictures
with full normal maps. A share of 1 would be right for Gaussian lobes, and is too bright for Cycles' GGX lobes.
"""

ROUGHER = 4.0
"""Largest ratio of the added fourth power of roughness to the material's own: normal maps of smoother materials are kept, as
each of their bumps mirrors visibly.
"""

MOST = 8
"""Maximum number of halvings of a texture."""

BAND = 1 << MOST
"""Rows of a picture that are averaged at once, to limit memory."""

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Content = Literal["color", "data", "normal"]
_Read = Callable[[NDArray[np.uint8]], Float32]
Key = tuple[int, int, str] | tuple[int, int, int, float, float]
Levels = tuple[tuple[int, ...], ...]
"""Halvings of each texture of `CONTENTS`, for each material."""

CONTENTS: Mapping[str, Content] = {
    "base_color_texture": "color",
    "metallic_roughness_texture": "data",
    "normal_texture": "normal",
    "emissive_texture": "color",
    "clearcoat_texture": "data",
    "clearcoat_roughness_texture": "data",
    "clearcoat_normal_texture": "normal",
    "transmission_texture": "data",
    "specular_texture": "data",
    "specular_color_texture": "color",
}
"""The textures that Cycles shows, and the content of their images."""


@dataclass(frozen=True, eq=False)
class _Density:
    """The density of a picture's texels on a surface.

    texels (T,): texels per metre of each triangle, along the direction with the fewest, ascending; area (T,): square metres
    of the triangles up to this one.
    """

    texels: Float
    area: Float

    @classmethod
    def from_mesh(cls, mesh: Mesh, chosen: NDArray[np.bool_], texture: Texture, size: tuple[int, int]) -> _Density:
        """The density on the chosen triangles (T,); size: the picture's width and height. Clamped parts have no extent."""
        uv = mesh.uv1 if texture.texcoord else mesh.uv0
        assert uv is not None
        triangles = mesh.triangles[chosen]
        u, v = np.nan_to_num(uv.astype(np.float64)).T
        place = np.stack([a * u + b * v + c for a, b, c in texture.matrix.tolist()], axis=1)
        for axis, wrap in enumerate((texture.wrap_s, texture.wrap_t)):
            if wrap == "clamp":
                place[:, axis] = place[:, axis].clip(0, 1)
        edges = _edges(np.nan_to_num(mesh.vertices.astype(np.float64))[triangles])
        texels = _fewest(edges, _edges((place * size)[triangles]))
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
        order = np.argsort(texels, kind="stable")
        return cls(texels[order], np.cumsum(area[order]))

    def halvings(self, pixels: float) -> int:
        """Return the number of times the texture may be halved if a metre covers `pixels` pixels."""
        if not len(self.texels) or not math.isfinite(pixels):
            return 0
        first = int(np.searchsorted(self.area * pixels**2, UNSEEN, side="right"))
        spare = float(self.texels[min(first, len(self.texels) - 1)]) / (FINEST * pixels)
        return min(int(math.log2(spare)), MOST) if spare >= 1 else 0


def _finest(camera: Camera) -> float:
    """Most pixels in a radian along the middle row and the middle column of a panorama. Near its poles, where columns are
    closer, its rows limit what can be seen.
    """
    w, h = camera.width, camera.height
    strips = (0, h // 2, w, h // 2 + 1), (w // 2, 0, w // 2 + 1, h)
    rays = [camera.lens.directions(1, strip).reshape(-1, 3) for strip in strips]
    steps = np.concatenate([np.linalg.norm(np.diff(strip, axis=0), axis=1) for strip in rays])
    return 1 / float(steps.min(initial=1.0))


def _edges(corners: Float) -> Float:
    """Two edges (T, 2, N) of triangles (T, 3, N)."""
    return corners[:, 1:] - corners[:, :1]


def _fewest(edges: Float, across: Float) -> Float:
    """The smaller singular value (T,) of the linear map from triangles' edges (T, 2, 3) to those in the picture (T, 2, 2)."""
    (e, f), (p, q) = np.moveaxis(edges, 1, 0), np.moveaxis(across, 1, 0)
    ee, ef, ff = (e * e).sum(axis=1), (e * f).sum(axis=1), (f * f).sum(axis=1)

    def stretch(i: int, k: int) -> Float:
        return ff * p[:, i] * p[:, k] - ef * (p[:, i] * q[:, k] + q[:, i] * p[:, k]) + ee * q[:, i] * q[:, k]

    half = (stretch(0, 0) + stretch(1, 1)) / 2
    product = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        largest = half + np.sqrt(np.maximum(half**2 - product * (ee * ff - ef**2), 0))
        return np.nan_to_num(np.sqrt(product / largest), nan=0.0, posinf=0.0)


@dataclass(frozen=True, eq=False)
class Kind:
    """A model with one set of repainted materials, and all things that use it. has_backs: whether cameras see the backs of
    single-sided materials.
    """

    mesh: Mesh
    repaints: tuple[Repaint, ...]
    has_backs: bool
    things: tuple[Thing, ...]
    _densities: dict[tuple[int, Texture, tuple[int, int]], _Density] = field(default_factory=dict)
    _made: dict[Key, Image] = field(default_factory=dict)
    _read: dict[tuple[int, int, str], Float] = field(default_factory=dict)
    _matt: dict[tuple[int, int], bool] = field(default_factory=dict)

    @cached_property
    def balls(self) -> tuple[Float, float]:
        """Centres (N, 3) of balls around the model wherever it stands, and their radius, world metres."""
        low, high = self.mesh.bounds
        middles = [transform(thing.world_from_object, (low + high) / 2) for thing in self.things]
        return np.array(middles), float(np.linalg.norm(high - low)) / 2

    def levels(self, cameras: Sequence[Camera]) -> Levels:
        """Halvings for a frame that is made of these cameras' pictures."""
        pixels = max(map(self._pixels, cameras))
        return tuple(self._material_levels(index, pixels) for index in range(len(self.mesh.materials)))

    def _pixels(self, camera: Camera) -> float:
        """Maximum pixels of a picture on a metre of the model, at any rotation; inf if the camera is inside a ball around a
        model.
        """
        middles, radius = self.balls
        nearest = float(np.linalg.norm(middles - camera.center, axis=1).min()) - radius
        k = camera.intrinsics
        if camera.lens.is_parallel:
            return max(k.fx, k.fy)
        if not camera.lens.is_linear:
            return _finest(camera) / nearest if nearest > 0 else math.inf
        slope = math.hypot(max(k.cx, k.width - k.cx) / k.fx, max(k.cy, k.height - k.cy) / k.fy)  # of a corner's ray
        return max(k.fx, k.fy) * (1 + slope**2) / nearest if nearest > 0 else math.inf

    def _material_levels(self, index: int, pixels: float) -> tuple[int, ...]:
        material = self.mesh.materials[index]
        return tuple(self._level(index, getattr(material, name), name, pixels) for name in CONTENTS)

    def _level(self, index: int, texture: Texture | None, name: str, pixels: float) -> int:
        material = self.mesh.materials[index]
        if (
            texture is None
            or texture.wrap_s != texture.wrap_t
            or (self.mesh.uv1 if texture.texcoord else self.mesh.uv0) is None
        ):
            return 0  # with different wraps the material's nodes depend on the picture's size
        if name == "base_color_texture" and self._cuts(material, texture):
            return 0
        if CONTENTS[name] == "normal" and (name != "normal_texture" or not self._can_roughen(material)):
            return 0
        height, width = self.mesh.images[texture.image].pixels.shape[:2]
        key = index, replace(texture, image=0, nearest=False), (width, height)
        if key not in self._densities:
            self._densities[key] = _Density.from_mesh(self.mesh, self.mesh.triangle_material == index, texture, (width, height))
        even = math.gcd(width, height)
        level = min(self._densities[key].halvings(pixels), (even & -even).bit_length() - 1)
        return level if CONTENTS[name] != "normal" or level == 0 or self._is_matt(index, level) else 0

    def _cuts(self, material: Material, texture: Texture) -> bool:
        """Return whether the texture's alpha makes parts of the material transparent."""
        return material.alpha_mode != "OPAQUE" and bool((self.mesh.images[texture.image].pixels[..., 3] < 255).any())

    def _can_roughen(self, material: Material) -> bool:
        """Return whether averaged bumps can be turned into roughness: both textures must cover each other texel by texel."""
        bumps, rough = material.normal_texture, material.metallic_roughness_texture
        if bumps is None or rough is None or bumps != replace(rough, image=bumps.image):
            return False
        _, repaint = repainted(material, self.repaints)
        sizes = {self.mesh.images[texture.image].pixels.shape for texture in (bumps, rough)}
        return len(sizes) == 1 and (repaint is None or repaint.roughness is None)

    def _is_matt(self, index: int, level: int) -> bool:
        """Return whether a material is rough enough that its averaged bumps may be added to the roughness (`ROUGHER`)."""
        if (index, level) not in self._matt:
            own, bumps = self._fourths(self.mesh.materials[index], level)
            self._matt[index, level] = float(bumps.mean()) <= ROUGHER * float(own.mean())
        return self._matt[index, level]

    def _fourths(self, material: Material, level: int) -> tuple[Float, Float]:
        """The fourth power (H, W) of roughness, and the addition (H, W) for the averaged bumps."""
        rough, bumps = material.metallic_roughness_texture, material.normal_texture
        assert rough is not None and bumps is not None
        own = np.clip(self._means_of(rough.image, level, "own") * material.roughness, 0, 1) ** 4
        return own, BUMPED * self._means_of(bumps.image, level, "spread") * material.normal_scale**2

    def pictured(self, levels: Levels) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
        """The materials and their pictures, halved."""
        images: dict[int, int] = {}
        shown: list[Image] = []

        def number(image: Image) -> int:
            if id(image) not in images:
                images[id(image)] = len(shown)
                shown.append(image)
            return images[id(image)]

        materials: list[Material] = []
        for material, row in zip(self.mesh.materials, levels, strict=True):
            level = dict(zip(CONTENTS, row, strict=True))
            changed: dict[str, Any] = {}
            for name, content in CONTENTS.items():
                texture: Texture | None = getattr(material, name)
                if texture is not None:
                    is_rough = name == "metallic_roughness_texture" and level["normal_texture"] > 0
                    image = self._roughened(material, level[name]) if is_rough else self._halved(texture, level[name], content)
                    changed[name] = replace(texture, image=number(image))
                    changed |= {"roughness": 1.0} if is_rough else {}
            materials.append(replace(material, occlusion_texture=None, **changed))
        return tuple(materials), tuple(shown)

    def _halved(self, texture: Texture, level: int, content: Content) -> Image:
        image = self.mesh.images[texture.image]
        if level == 0:
            return image
        key = texture.image, level, content
        if key not in self._made:
            self._made[key] = Image(image.name, halved(image.pixels, level, content))
        return self._made[key]

    def _roughened(self, material: Material, level: int) -> Image:
        rough, bumps = material.metallic_roughness_texture, material.normal_texture
        assert rough is not None and bumps is not None
        key = rough.image, bumps.image, level, material.roughness, material.normal_scale
        if key not in self._made:
            image = self._halved(rough, level, "data")
            pixels = image.pixels.copy()
            pixels[..., 1] = _bytes(np.sqrt(np.sqrt(sum(self._fourths(material, level)))))
            self._made[key] = Image(image.name, pixels)
        return self._made[key]

    def _means_of(self, image: int, level: int, what: Literal["own", "spread"]) -> Float:
        """Means of a picture's roughness (H, W), or the spread of its normals (H, W)."""
        if (image, level, what) not in self._read:
            pixels = self.mesh.images[image].pixels
            own = spread_of(pixels, level) if what == "spread" else _means(pixels[..., 1], level, _plain)[..., 0]
            self._read[image, level, what] = own.astype(np.float64)
        return self._read[image, level, what]


def halved(pixels: NDArray[np.uint8], level: int, content: Content) -> NDArray[np.uint8]:
    """Means of squares of 2^level texels: of light, plain numbers, or directions; alpha is always a plain number."""
    out = np.empty((pixels.shape[0] >> level, pixels.shape[1] >> level, 4), np.uint8)
    out[..., 3] = _bytes(_means(pixels[..., 3], level, _plain)[..., 0])
    means = _means(pixels[..., :3], level, {"color": _light, "data": _plain, "normal": _directions}[content])
    if content == "color":
        means = encoded(means)
    elif content == "normal":
        means = means / np.maximum(np.linalg.norm(means, axis=-1, keepdims=True), 1e-6) * 0.5 + 0.5
    out[..., :3] = _bytes(means)
    return out


def spread_of(pixels: NDArray[np.uint8], level: int) -> Float:
    """The spread (H, W) of directions in squares of 2^level texels of a normal map, defined as in the raster engine: twice
    the inverse of their concentration as a von Mises-Fisher lobe (Toksvig 2005, Banerjee et al. 2005).
    """
    squared = np.minimum((_means(pixels[..., :3], level, _directions).astype(np.float64) ** 2).sum(axis=-1), 1)
    spread = 2 * (1 - squared) / np.maximum((3 - squared) * np.sqrt(squared), 1e-3)
    return np.maximum(spread - 2e-4, 0)


def _means(pixels: NDArray[np.uint8], level: int, read: _Read) -> Float32:
    """Means (H, W, C) of squares of 2^level texels of a picture that is read band by band."""
    bands: list[Float32] = []
    for top in range(0, len(pixels), BAND):
        band = read(np.atleast_3d(pixels[top : top + BAND]))
        for _ in range(level):
            rows = band[0::2] + band[1::2]
            band = np.multiply(rows[:, 0::2] + rows[:, 1::2], np.float32(0.25), dtype=np.float32)
        bands.append(band)
    return np.concatenate(bands)


def _plain(pixels: NDArray[np.uint8]) -> Float32:
    return np.multiply(pixels, np.float32(1 / 255), dtype=np.float32)


def _light(pixels: NDArray[np.uint8]) -> Float32:
    return linear(np.arange(256) / 255).astype(np.float32)[pixels]


def _directions(pixels: NDArray[np.uint8]) -> Float32:
    """Unit vectors of a normal map; texels without a direction, as between an atlas's islands, get the unperturbed normal."""
    v = pixels.astype(np.float32) * np.float32(2 / 255) - np.float32(1)
    v[..., 2] = np.maximum(v[..., 2], 0)
    length = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    is_level = (length < 0.1) | (pixels[..., 2:] < 64)
    return np.where(is_level, np.array([0, 0, 1], np.float32), v / np.maximum(length, np.float32(1e-6)))


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    return np.floor(np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
