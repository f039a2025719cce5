"""The benchmark's reference scene: a zoo car cut to about 75,000 triangles, a set of 1,024 x 1,024 textures, a sky with a sun.

The whole scene is computed, so that the figures can be measured anywhere. The texture set: base colour, occlusion + roughness +
metallic in one image, and normals; on every material, mapped from the sides of a box, 0.5 m a tile.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere import Recipe
from viewsphere.assets.exporting.export import export_glb
from viewsphere.assets.mesh import Image, Mesh, Texture
from viewsphere_zoo import build

TRIANGLES = 75_000
TEXELS = 1024
TILE = 0.5
VERTEX_FIELDS = ("vertices", "normals", "uv0", "uv1", "colors")


def reference_recipe(frames: int, antialias: int, folder: Path) -> Recipe:
    """The car on the ground `car.glb` under `sky.exr` of a folder, seen from all around."""
    return Recipe(
        name="bench",
        models=[{"source": str(folder / "car.glb"), "category": "car", "scale": {"length": 4.3}}],
        viewpoints={
            "azimuth": [360 * i / frames for i in range(frames)],
            "elevation": [20],
            "distance": 9.0,
        },
        camera={"size": [640, 480], "fov_deg": 40},
        scene={"ground": True, "sky": {"hdri": str(folder / "sky.exr")}},
        engine={"name": "raster", "antialias": antialias},
        channels=["rgb", "depth", "instances", "normals"],
        formats=[],
    )


def write_reference(folder: Path) -> None:
    """The scene's files: `car.glb` and `sky.exr`."""
    export_glb(textured(subdivide(build("car", np.random.default_rng(1)))), folder / "car.glb")
    write_sky(folder)


def write_sky(folder: Path) -> None:
    """A clear sky over a dim earth, 1,024 x 512, with a sun two pixels wide, as an EXR file."""
    import OpenEXR

    elevation = np.pi * (0.5 - (np.arange(512) + 0.5) / 512)[:, None]
    azimuth = 2 * np.pi * ((np.arange(1024) + 0.5) / 1024)[None, :]
    up = np.clip(np.sin(elevation), 0, 1)
    sky = np.array([0.9, 0.95, 1.0]) * (1 - up[..., None]) ** 3 + np.array([0.3, 0.5, 0.9]) * (1 - (1 - up[..., None]) ** 3)
    light = np.where(elevation[..., None] > 0, sky, 0.25) * np.ones((1, 1024, 1))
    sun = np.cos(elevation) * np.cos(np.deg2rad(40)) * np.cos(azimuth - 2.0) + np.sin(elevation) * np.sin(np.deg2rad(40))
    light[sun > np.cos(np.deg2rad(0.45))] = [15000, 14000, 12500]
    channels = {"RGB": light.astype(np.float32)}
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(folder / "sky.exr"))


def texture_set(size: int = TEXELS) -> tuple[Image, Image, Image]:
    """Base colour, occlusion-roughness-metallic and normals of a hammered, stained sheet that repeats."""
    rng = np.random.default_rng(7)
    x = np.fft.fftfreq(size)[:, None] * size
    y = np.fft.fftfreq(size)[None, :] * size
    spectrum = np.fft.fft2(rng.standard_normal((size, size)))

    def noise(low: float, high: float) -> Any:
        band = np.exp(-((np.hypot(x, y) / high) ** 2)) - np.exp(-((np.hypot(x, y) / low) ** 2))
        field = np.fft.ifft2(spectrum * band).real
        return field / np.abs(field).max()

    stains, dents, grain = noise(1, 12), noise(10, 40), noise(60, 300)
    height = 3.0 * dents + 0.4 * grain
    slope_x, slope_y = (np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (1, 0))
    normal = np.stack([-slope_x, slope_y, np.ones_like(height)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    base = 0.8 + 0.2 * stains[..., None] * np.array([1.0, 0.8, 0.6])
    surface = np.stack([0.9 + 0.1 * dents, 0.75 + 0.25 * stains, np.full_like(stains, 1.0)], axis=-1)
    return _image("base", base), _image("surface", surface), _image("normal", normal * 0.5 + 0.5)


def _image(name: str, values: Any) -> Image:
    alpha = np.ones((*values.shape[:2], 1))
    return Image(name, np.round(255 * np.clip(np.concatenate([values, alpha], axis=-1), 0, 1)).astype(np.uint8))


def textured(mesh: Mesh, size: int = TEXELS) -> Mesh:
    """The mesh with box-mapped coordinates and the texture set on every material."""
    p = mesh.vertices[mesh.triangles]
    axis = np.abs(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])).argmax(axis=1)
    keys, first, corner = np.unique(mesh.triangles.astype(np.int64) * 3 + axis[:, None], return_index=True, return_inverse=True)
    order = np.argsort(first)
    vertex, side = np.divmod(keys[order], 3)
    rank = np.argsort(order).astype(np.int32)
    place = mesh.vertices[vertex]
    across = np.where(side == 0, 1, 0), np.where(side == 2, 1, 2)
    rows = np.arange(len(place))
    uv = np.stack([place[rows, a] for a in across], axis=1) / np.float32(TILE)
    base, surface, normal = (Texture(i) for i in range(3))
    materials = tuple(
        replace(
            m, base_color_texture=base, metallic_roughness_texture=surface, occlusion_texture=surface, normal_texture=normal
        )
        for m in mesh.materials
    )
    return replace(
        mesh,
        vertices=place,
        normals=mesh.normals[vertex],
        colors=None if mesh.colors is None else mesh.colors[vertex],
        triangles=rank[corner].reshape(-1, 3),
        uv0=uv.astype(np.float32),
        uv1=None,
        materials=materials,
        images=texture_set(size),
    )


def subdivide(mesh: Mesh, triangles: int = TRIANGLES) -> Mesh:
    """Halve the longest edges, of both triangles that share them, until there are about enough triangles.

    Vertices are numbered in order of use, as in any file.
    """
    while len(mesh.triangles) < triangles:
        edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        ends = mesh.vertices[edges]
        lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        lacking = triangles - len(mesh.triangles)
        longest = np.sort(lengths)[-min(max(lacking, 1), len(lengths) // 4)]
        pairs, inverse = np.unique(edges[lengths >= longest], axis=0, return_inverse=True)
        middles = np.full(len(edges), -1)
        middles[lengths >= longest] = len(mesh.vertices) + inverse.reshape(-1)
        cut, source = split_triangles(mesh.triangles, middles.reshape(-1, 3))
        mesh = replace(
            mesh,
            triangles=cut,
            triangle_material=mesh.triangle_material[source],
            triangle_part=mesh.triangle_part[source],
            **{name: with_means(getattr(mesh, name), pairs) for name in VERTEX_FIELDS},
        )
    used, first, inverse = np.unique(mesh.triangles, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order).astype(np.int32)
    fields = {name: getattr(mesh, name) for name in VERTEX_FIELDS}
    moved = {name: None if values is None else values[used[order]] for name, values in fields.items()}
    return replace(mesh, triangles=rank[inverse].reshape(-1, 3), **moved)


def split_triangles(triangles: Any, middles: Any) -> tuple[Any, Any]:
    """Triangles cut at the middles (T, 3) of their edges 01, 12, 20 (-1: not cut), and the triangle each came from."""
    corners, sources = [], []
    for t, (corner, middle) in enumerate(zip(triangles.tolist(), middles.tolist(), strict=True)):
        ring = [v for pair in zip(corner, middle, strict=True) for v in pair if v >= 0]
        start = ring.index(next((m for m in middle if m >= 0), ring[0]))
        fan = ring[start:] + ring[:start]
        pieces = [(fan[0], fan[k], fan[k + 1]) for k in range(1, len(fan) - 1)]
        corners += pieces
        sources += [t] * len(pieces)
    return np.array(corners, np.int32), np.array(sources)


def with_means(values: Any, pairs: Any) -> Any:
    """Per-vertex values and, behind them, the means of these pairs of vertices."""
    return None if values is None else np.concatenate([values, values[pairs].mean(axis=1, dtype=np.float32)])
