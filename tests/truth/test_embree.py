"""Truth against Embree, an independent ray caster (float32, so ties and grazed edges are set aside and counted)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from proven import told
from quick import quick
from ray_proofs import compare
from truth_scenes import LENSES, cube, lens, mesh_of, orbit_camera, placed, sphere
from viewsphere.truth.raster.alpha_masks import NEVER, SURFACE

pytest.importorskip("embreex")

MODELS = Path(__file__).parents[2].parent / "shared" / "models"
FOLDERS = ("car", "bicycle", "chair", "boat", "hair_drier", "misc")


def random_cameras(rng, count, width, height, distortion=None, reach=(4.0, 14.0)):
    fov = math.radians(170 if distortion is not None and distortion.model == "fisheye" else 50)
    intrinsics = lens(width, height, fov, distortion)
    cameras = []
    for _ in range(count):
        azimuth, elevation = rng.uniform(0, 2 * np.pi), rng.uniform(-0.1, np.pi / 2)
        distance, target, tilt = rng.uniform(*reach), rng.normal(size=3) * 0.3, rng.uniform(-0.5, 0.5)
        cameras.append(orbit_camera(intrinsics, azimuth, elevation, distance, target, tilt))
    return cameras


def turned(angle, x, y, z=0.0):
    move = np.eye(4)
    move[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    move[:3, 3] = x, y, z
    return move


def circle(count, radius):
    return [
        turned(1.3 * i, radius * math.cos(2 * np.pi * i / count), radius * math.sin(2 * np.pi * i / count))
        for i in range(count)
    ]


def procedural(rng):
    """A ball, a cube with parts, a torus, a bumpy ball and a needle."""
    import trimesh

    torus = trimesh.creation.torus(1.0, 0.35, 60, 30)
    ball = sphere(4)
    bumps = ball.vertices * (1 + 0.1 * rng.normal(size=(len(ball.vertices), 1)))
    needle = trimesh.creation.cone(0.02, 3.0, sections=7)
    return [
        sphere(5),
        cube(0.9),
        mesh_of(torus.vertices, torus.faces),
        mesh_of(bumps, ball.triangles, parts=np.arange(len(ball.triangles)) % 3),
        mesh_of(needle.vertices, needle.faces),
    ]


@pytest.mark.parametrize("name", quick(LENSES, "rational"))
def test_ids_and_depth_on_procedural_scenes(name):
    rng = np.random.default_rng(7)
    meshes = procedural(rng)
    geometry = placed(*meshes, moves=circle(len(meshes), 2.0), ground=True)
    cameras = random_cameras(rng, 5 if name == "pinhole" else 2, 320, 240, LENSES[name])
    toss_ups, overruled, errors = compare(geometry, cameras)
    pixels = len(cameras) * 320 * 240
    assert toss_ups < 2e-4 * pixels
    assert overruled < 2e-5 * pixels
    assert np.quantile(errors, 0.999) <= 1e-4
    told("depth", "Embree's rays, 999 of 1,000 pixels, at 10 m", np.quantile(errors, 0.999), "m")


def real_models(count):
    """Normalised to 2 m long; files that cannot be read are somebody else's test."""
    from viewsphere.assets.load import load_model
    from viewsphere.assets.normalise import normalise
    from viewsphere.assets.readers import suffixes
    from viewsphere.errors import ModelError
    from viewsphere.model.model_spec import ModelSpec

    found = {
        f: sorted(p for p in (MODELS / f).rglob("*") if p.suffix[1:].lower() in suffixes(by_blender=False)) for f in FOLDERS
    }
    meshes = {}
    for i in range(max(map(len, found.values()))):
        for folder in FOLDERS:
            if i < len(found[folder]) and len(meshes) < count:
                path = found[folder][i]
                spec = ModelSpec(key="m", source=str(path), category="thing", category_id=1, scale=2.0)
                try:
                    meshes[path.stem] = normalise(*load_model(path), spec)
                except ModelError:
                    continue
    return meshes


@pytest.mark.slow
@pytest.mark.skipif(not MODELS.exists(), reason="no folder of real models beside the project")
def test_ids_and_depth_on_real_models():
    meshes = list(real_models(12).values())
    assert len(meshes) >= 10
    rng = np.random.default_rng(3)
    pixels = toss_ups = overruled = 0
    errors = []
    for chosen in (meshes[:6], meshes[6:]):
        geometry = placed(*chosen, moves=circle(len(chosen), 2.0), ground=True)
        cameras = random_cameras(rng, 8, 640, 480)
        tossed, wrong, error = compare(opaque(geometry), cameras)
        pixels, toss_ups, overruled = pixels + 8 * 640 * 480, toss_ups + tossed, overruled + wrong
        errors.append(error)
    assert overruled < 1e-5 * pixels
    assert toss_ups < 2e-3 * pixels  # real models hold doubled faces: equal depth to the last bit
    worst = np.quantile(np.concatenate(errors), 0.999)
    assert worst <= 1e-4
    print(f"{pixels} pixels: {toss_ups} toss-ups, {overruled} where Embree was wrong, depth p99.9 {worst:.1e} m at 10 m")


def opaque(geometry):
    """Without cut-outs, of which Embree knows nothing."""
    from dataclasses import replace

    return replace(geometry, triangle_cutout=np.where(geometry.triangle_cutout < NEVER, geometry.triangle_cutout, SURFACE))


@pytest.mark.slow
def test_ids_with_bounds_checked():
    """The same kernels, compiled to check every array access."""
    import os
    import subprocess
    import sys

    chosen = ["test_embree.py", "test_geometry.py", "test_channels.py", "test_visibility.py"]
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", *(str(Path(__file__).parent / c) for c in chosen)]
    environment = {**os.environ, "NUMBA_BOUNDSCHECK": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:]
