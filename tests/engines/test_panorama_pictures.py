"""Pictures of panoramas: equal to six pinholes' pictures, without a seam, and the same data set passes `check`."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere import Dataset, Recipe, generate, render
from viewsphere.check import check
from viewsphere.codecs.srgb import encoded
from viewsphere.geometry.camera import pixel_rays, project

WIDTH = 256
FACES = {
    "ahead": [0, 0, 0],
    "right": [0, 90, 0],
    "behind": [0, 180, 0],
    "left": [0, -90, 0],
    "up": [90, 0, 0],
    "down": [-90, 0, 0],
}
PINHOLE = {"fov_deg": 90, "size": [321, 321]}
"""A pixel of a face is about half as wide as one of the panorama."""


def rendered(folder, scene, **changes):
    """An equirectangular panorama among cars, one a quarter turn to the right, a cylindrical one, and six faces of a cube."""
    pano = {"projection": "equirectangular", "size": [WIDTH, WIDTH // 2]}
    sensors = {
        "pano": pano,
        "turned": {**pano, "rotation": [0, 90, 0]},
        "cylinder": {"projection": "cylindrical", "size": [WIDTH, 110]},
        **{name: {**PINHOLE, "rotation": angles} for name, angles in FACES.items()},
    }
    said = {
        "name": "around",
        "models": [{"source": "zoo:car", "count": 1, "category": "car"}, {"source": "zoo:post_box", "category": "post box"}],
        "scenes": {"count": 1, "objects": 7, "repeat": True, "layout": "scatter"},
        "viewpoints": {"azimuth": [0], "elevation": 12, "distance": 0.6},
        "camera": pano,
        "rig": {"sensors": sensors},
        "scene": scene,
        "engine": {"name": "raster", "ambient_occlusion": "off", **changes},
        "channels": ["rgb", "instances", "depth_ray", "triangles"],
        "formats": ["native"],
        "splits": {"by": "scene"},
    }
    generate(Recipe.model_validate(said), folder, workers=0)
    return Dataset(folder)


@pytest.fixture(scope="module")
def matt(tmp_path_factory):
    """Grey models on a plain ground, without antialiasing."""
    plain = [{"models": "*", "roughness": 1, "metallic": 0}]
    return rendered(
        tmp_path_factory.mktemp("matt") / "out",
        {"materials": plain, "ground": {"pattern": "plain", "color": [0.5, 0.5, 0.5], "roughness": 1}},
        antialias=1,
    )


def by_sensor(dataset):
    return {sample.sensor: sample for sample in dataset}


def from_faces(sample, faces):
    """A panorama's picture, sampled in six pinholes' pictures, and where the pixels around show its own triangle and light."""
    rays = pixel_rays(sample.camera.intrinsics) @ sample.camera.R
    best = np.argmax([rays @ face.camera.R[2] for face in faces], axis=0)
    out, certain = np.zeros((*rays.shape[:2], 3)), np.zeros(rays.shape[:2], bool)
    for i, face in enumerate(faces):
        xy, _ = project(face.camera.intrinsics, rays[best == i] @ face.camera.R.T)
        x, y = np.clip(xy - 0.5, 0, 319.999).T
        u, v = x.astype(int), y.astype(int)
        a, b = (x - u)[:, None], (y - v)[:, None]
        picture, ids, depth = (np.asarray(face.channels[n], float) for n in ("rgb", "triangles", "depth_ray"))
        upper = picture[v, u] * (1 - a) + picture[v, u + 1] * a
        lower = picture[v + 1, u] * (1 - a) + picture[v + 1, u + 1] * a
        out[best == i] = upper * (1 - b) + lower * b
        around = [(v + p, u + q) for p in (0, 1) for q in (0, 1)]
        with np.errstate(invalid="ignore"):
            flat = np.ptp([np.where(np.isinf(depth[at]), 1e9, depth[at]) for at in around], axis=0) < 0.02
        calm = np.ptp([picture[at] for at in around], axis=0).max(axis=1) <= 2
        own = sample.channels["triangles"][best == i]
        certain[best == i] = np.all([ids[at] == own for at in around], axis=0) & flat & calm
    return out, certain


@pytest.mark.parametrize("name", ["pano", "turned", "cylinder"])
@pytest.mark.slow
def test_matt_colours_are_those_of_six_pinholes(name, matt):
    samples = by_sensor(matt)
    sample = samples[name]
    expected, certain = from_faces(sample, [samples[face] for face in FACES])
    off = np.abs(sample.rgb - expected).max(axis=-1)[certain]
    assert certain.mean() > 0.5
    assert np.quantile(off, 0.9995) <= 1.5  # 1, and half a step of interpolated ones; a few lie on a shadow's border
    assert off.max() <= 8


@pytest.mark.slow
def test_a_quarter_turn_moves_the_columns_of_every_channel(matt):
    samples = by_sensor(matt)
    for channel, most in (("instances", 0), ("depth_ray", 1e-4), ("rgb", 1)):
        a, b = (np.asarray(samples[n].channels[channel], float) for n in ("pano", "turned"))
        moved = np.roll(a, -WIDTH // 4, axis=1)
        with np.errstate(invalid="ignore"):
            apart = np.abs(np.where(moved == b, 0.0, moved - b)).reshape(b.shape[0], b.shape[1], -1).max(axis=-1)
        assert (apart > most * (1 + np.where(np.isfinite(b.reshape(*apart.shape, -1)[..., 0]), 1, 0))).sum() <= 3, channel


@pytest.mark.slow
def test_check_proves_it(matt):
    report = check(matt)
    assert report.ok, report.findings
    across = [o for sample in matt for o in sample.objects if o.box2d and o.box2d[2] > sample.width]
    assert across


def above_planks(width):
    """The colours (H, W, 3) of a panorama above planks, scene-linear."""
    said = {
        "models": [{"source": "zoo:post_box", "scale": {"length": 0.05}}],
        "viewpoints": {"azimuth": [30], "elevation": 15, "distance": 3.0},
        "camera": {"projection": "equirectangular", "size": [width, width // 2]},
        "scene": {"ground": {"material": "planks"}},
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "channels": ["rgb_linear", "depth_ray"],
        "formats": [],
    }
    return next(iter(render(Recipe.model_validate(said)))).rgb_linear.astype(float)


@pytest.mark.slow
def test_textures_are_as_sharp_at_a_pole_as_in_the_middle():
    """Against 64 samples a pixel: pixels narrow towards the poles, and so does the part of a texture that each covers."""
    fine = above_planks(1024).reshape(64, 8, 128, 8, 3).mean(axis=(1, 3))
    error = np.abs(encoded(np.clip(above_planks(128), 0, 1)) - encoded(np.clip(fine, 0, 1))) * 255
    assert error[-6:].mean() < 1  # 2.46 with parts as wide as in the middle
    assert error[:-6].mean() < 1
