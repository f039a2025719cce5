"""What every mesh of the zoo has to be, and how to look at its parts."""

from __future__ import annotations

import os
from functools import cache

import numpy as np
import pytest

import viewsphere_zoo as zoo
from viewsphere.assets.mesh import Mesh

ON_CI = os.environ.get("CI") == "true"


def seeds(many: int, few: int = 2) -> range:
    """Seeds of many draws on CI, which has the time for them, and of a few elsewhere."""
    return range(many if ON_CI else few)


@cache
def drawn(family: str, seed: int) -> Mesh:
    """A draw of a family, made once; do not change it."""
    return zoo.build(family, np.random.default_rng(seed))


def part_vertices(mesh: Mesh, *prefixes: str) -> np.ndarray:
    ids = [i for i, name in enumerate(mesh.parts) if name.startswith(prefixes)]
    assert ids, f"no part {prefixes} in {mesh.parts}"
    return mesh.vertices[np.unique(mesh.triangles[np.isin(mesh.triangle_part, ids)])].astype(np.float64)


def faces(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Corner positions (T, 3, 3) and face normals of twice the area's length."""
    corners = mesh.vertices.astype(np.float64)[mesh.triangles]
    return corners, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def assert_sound(mesh: Mesh, most: int, least: int = 4_000) -> None:
    assert least <= len(mesh.triangles) <= most
    assert np.isfinite(mesh.vertices).all() and np.isfinite(mesh.normals).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
    _, area = faces(mesh)
    assert np.linalg.norm(area, axis=1).min() > 1e-12
    dots = np.einsum("tj,tcj->tc", area, mesh.normals[mesh.triangles])
    assert (dots > 0).mean() > 0.999
    assert set(mesh.triangle_material) == set(range(len(mesh.materials)))
    assert set(mesh.triangle_part) == set(range(len(mesh.parts)))
    assert len(set(mesh.materials)) == len(mesh.materials)


def outward_share(mesh: Mesh) -> float:
    """Share of what a camera sees, from 26 sides, that shows its outside (rays of Embree, an independent caster)."""
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    caster = RayMeshIntersector(Trimesh(mesh.vertices, mesh.triangles, process=False))
    _, area = faces(mesh)
    low, high = mesh.bounds
    center, reach = (low + high) / 2, float(np.linalg.norm(high - low))
    seen = outside = 0
    for direction in np.array(np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3)).reshape(3, -1).T:
        if not direction.any():
            continue
        d = direction / np.linalg.norm(direction)
        u = np.cross(d, (0.3, 0.5, 0.8))
        u /= np.linalg.norm(u)
        a, b = np.meshgrid(np.linspace(-0.5, 0.5, 60) * reach, np.linspace(-0.5, 0.5, 60) * reach)
        origins = center + d * reach + a.reshape(-1, 1) * u + b.reshape(-1, 1) * np.cross(d, u)
        hit = caster.intersects_first(origins, np.broadcast_to(-d, origins.shape))
        hit = hit[hit >= 0]
        seen += len(hit)
        outside += int((area[hit] @ d > 0).sum())
    return outside / seen


def assert_family(family: str, sizes: tuple[tuple[float, float], ...], most: int, draws: int = 5, least: int = 200) -> None:
    """Draws are sound, stand on the ground, have real sizes and pictures, differ; one seed gives one mesh."""
    meshes = [drawn(family, seed) for seed in seeds(draws)]
    for mesh in meshes:
        assert_sound(mesh, most, least)
        assert abs(float(mesh.vertices[:, 2].min())) < 1e-3
        for value, (low, high) in zip(zoo.real_size(mesh), sizes, strict=True):
            assert low - 1e-3 <= value <= high + 1e-3, zoo.real_size(mesh)
        if mesh.images:
            assert mesh.uv0 is not None and np.isfinite(mesh.uv0).all()
        for image in mesh.images:
            assert max(image.pixels.shape) <= 640 and (image.pixels[..., 3] == 255).all()
            assert image.pixels[..., :3].std() > 2
    looks = [_look(mesh) for mesh in meshes]
    assert len(set(looks)) == len(meshes)
    assert len({np.round(mesh.bounds, 3).tobytes() for mesh in meshes}) >= max(len(meshes) - 1, 2)
    assert _look(zoo.build(family, np.random.default_rng(1))) == looks[1]


def _look(mesh: Mesh) -> bytes:
    arrays = (mesh.vertices, mesh.triangles, mesh.normals, mesh.uv0, mesh.colors, mesh.triangle_part, mesh.triangle_material)
    pictures = b"".join(image.pixels.tobytes() for image in mesh.images)
    return b"".join(b"" if a is None else a.tobytes() for a in arrays) + pictures + repr(mesh.materials).encode()
