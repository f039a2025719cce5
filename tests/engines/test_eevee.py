"""EEVEE and Workbench: labels are raster's, colours lie on them to the pixel, light is as strong as Cycles'.

Without a graphics card a picture of EEVEE takes two seconds, and shadows two more a sample, whatever the size; a sample of
Workbench takes a seventh of a second. So there are few pictures, and shadows only where they are looked at.
"""

from __future__ import annotations

import os
import signal
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from cycles_scenes import moved_camera, recipe_of, shift_between, stage_of

from viewsphere import render
from viewsphere.blender.interpreter import probe
from viewsphere.codecs.srgb import linear
from viewsphere.engines.shared.blender.border import border_of
from viewsphere.engines.shared.blender.staging import Keeper, clip_of, keeper_of
from viewsphere.errors import UserError
from viewsphere.truth.raster.visibility import rasterize

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900), pytest.mark.usefixtures("drawing")]

UNSHADOWED = {"name": "eevee", "quality": "draft", "samples": 8, "settings": {"use_shadows": False}}
SHADOWED = {"name": "eevee", "samples": 2}
WORKBENCH = {"name": "workbench"}
ENGINES = {"eevee": UNSHADOWED, "workbench": WORKBENCH}
CYCLES = {"name": "cycles", "quality": "draft", "samples": 48}
RASTER = {"name": "raster"}

LABELS = ["depth", "instances", "parts", "normals"]
LENSES = {
    "pinhole": {},
    "off centre": {"size": [112, 90], "fov_deg": None, "K": [[130.0, 0, 50.3], [0, 105.0, 50.9], [0, 0, 1]]},
    "barrel": {"distortion": {"model": "brown_conrady", "coefficients": [-0.2, 0.03, 0.001, -0.002]}},
}


def pictures(channel="rgb", **given):
    return [sample.channels[channel] for sample in render(recipe_of(**given))]


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("name", ENGINES)
def test_labels_are_rasters_and_pictures_lie_on_them(name, lens):
    """Lights that differ pass for a shift, so it is outlines that are compared, seen from sides where they are long."""
    given = {
        "camera": LENSES[lens],
        "channels": ["rgba", *LABELS],
        "viewpoints": {"azimuth": [72, 288], "elevation": [25], "distance": 0.9},
        "scene": {"ground": False, "background": "transparent"},
    }
    shifts = []
    for drawn, raster in zip(render(recipe_of(ENGINES[name], **given)), render(recipe_of(RASTER, **given)), strict=True):
        for label in LABELS:
            assert drawn.channels[label].tobytes() == raster.channels[label].tobytes()
        assert repr(drawn.objects) == repr(raster.objects)
        pair = [s.channels["rgba"].astype(float) for s in (drawn, raster)]
        alpha = [p[..., 3] / 255 for p in pair]
        shifts.append(shift_between(*alpha))
        assert np.abs(alpha[0] - alpha[1]).mean() < 0.01
        assert ((alpha[0] > 0.99) == (alpha[1] > 0.99)).mean() > 0.97
        assert not pair[0][:4].any()
        solid = (alpha[0] > 0.99) & (alpha[1] > 0.99)
        assert np.abs(pair[0] - pair[1])[solid].mean() < (16 if name == "eevee" else 40)  # Workbench mirrors nothing
    assert np.hypot(*np.mean(shifts, axis=0)) <= 0.05


@pytest.mark.parametrize("samples", [1, 5, 11, 16, 32])
def test_workbench_lies_there_with_any_number_of_samples(samples):
    """One sample a pixel makes edges that are random to a fifth of a pixel: of six pictures little of that is left."""
    given = {
        "channels": ["rgba"],
        "viewpoints": {
            "azimuth": [0, 50, 100, 150, 200, 250] if samples == 1 else [100],
            "elevation": [25],
            "distance": 0.9,
        },
        "scene": {"ground": False, "background": "transparent"},
        "camera": {"size": [256, 192]},
    }
    pairs = zip(*(pictures("rgba", engine=e, **given) for e in (WORKBENCH | {"samples": samples}, RASTER)), strict=True)
    shifts = [shift_between(*(p[..., 3].astype(float) for p in pair)) for pair in pairs]
    assert np.hypot(*np.mean(shifts, axis=0)) <= (0.08 if samples == 1 else 0.04)


@pytest.mark.parametrize("engine", ENGINES.values(), ids=ENGINES)
def test_the_ground_and_the_sky_are_where_rasters_are(engine):
    given = {"viewpoints": {"azimuth": [20], "elevation": [8], "distance": 0.9}}
    fading = given | {"scene": {"background": "transparent", "ground": "on"}, "channels": ["rgba"]}
    (drawn,), (raster,) = (pictures("rgba", engine=e, **fading) for e in (engine, RASTER))
    assert np.ptp(raster[..., 3]) == 255
    assert np.abs(drawn[..., 3].astype(float) - raster[..., 3]).mean() < 3
    for sky in ("gradient", "daylight"):
        scene = {} if sky == "gradient" else {"sky": "daylight", "sun": {"azimuth": 170, "elevation": 30}}
        (drawn,), (raster,) = (pictures(engine=e, scene=scene, **given) for e in (engine, RASTER))
        is_sky = np.arange(96) < 10
        assert np.abs(drawn[is_sky].astype(float) - raster[is_sky]).mean() < 4


@pytest.fixture(scope="module")
def card(tmp_path_factory):
    """A grey, matt box: a GLB's path."""
    import trimesh

    box = trimesh.creation.box((1.0, 1.0, 1.0))
    grey = trimesh.visual.material.PBRMaterial(baseColorFactor=(128, 128, 128, 255), metallicFactor=0.0, roughnessFactor=1.0)
    box.visual = trimesh.visual.TextureVisuals(material=grey)
    path = tmp_path_factory.mktemp("card") / "card.glb"
    box.export(path)
    return str(path)


def model_of(path):
    return {"source": path, "category": "card", "scale": "as_is"}


BLACK = {"zenith": [0, 0, 0], "horizon": [0, 0, 0]}
LAMPS_ALONE = {"sun": "off", "sky": BLACK}
LIGHTS = {
    "sun": {"sun": {"azimuth": 10, "elevation": 35, "strength": 2.0}, "sky": BLACK},
    "sky": {"sun": "off"},
    "daylight": {"sky": "daylight"},
    "lamps": LAMPS_ALONE
    | {
        "lights": [
            {"kind": "point", "position": [1, -3, 1], "strength": 12.0, "color": [1, 0, 0]},
            {"kind": "spot", "position": [0.5, -3, 1], "strength": 15.0, "angle_deg": 60, "color": [0, 1, 0]},
            {"kind": "area", "position": [0.5, -3, 1], "strength": 15.0, "size": [1, 2], "color": [0, 0, 1]},
        ]
    },
    "hemisphere": LAMPS_ALONE | {"lights": [{"kind": "hemisphere", "strength": 0.8, "below": [0.1, 0.2, 0.4]}]},
}


@cache
def brightness(name, light, card):
    """Linear colour of the side of a box that faces the camera."""
    (picture,) = pictures(
        engine=CYCLES if name == "cycles" else ENGINES[name],
        models=[model_of(card)],
        viewpoints={"azimuth": [0], "elevation": [15], "distance": 4.0},
        camera={"size": [64, 64], "fov_deg": 20},
        scene={"ground": False, "view": {"transform": "raw"}, **LIGHTS[light]},
    )
    return linear(picture[28:44, 24:40] / 255).reshape(-1, 3).mean(axis=0)


@pytest.mark.parametrize("light", LIGHTS)
def test_light_is_as_bright_as_cycles(light, card):
    """EEVEE knows four numbers of the sky's light in all directions: a tenth is what they leave out.

    Each lamp has a colour of its own.
    """
    drawn, traced = (brightness(name, light, card) for name in ("eevee", "cycles"))
    assert (traced.min() if light == "lamps" else traced.max()) > 0.02
    np.testing.assert_allclose(drawn, traced, rtol=0.05 if "lights" in LIGHTS[light] or light == "sun" else 0.12, atol=0.003)


@pytest.mark.parametrize("light", ["sun", "sky", "daylight", "hemisphere"])
def test_workbench_has_the_suns_and_the_skys_light(light, card):
    """Between up and down the sky's light is taken as linear."""
    drawn, traced = (brightness(name, light, card) for name in ("workbench", "cycles"))
    np.testing.assert_allclose(drawn, traced, rtol=0.2, atol=0.003)


def test_objects_are_as_bright_as_cycles_and_shadows_lie_where_they_do(card):
    given = {
        "models": [model_of(card)],
        "viewpoints": {"azimuth": [0], "elevation": [35], "distance": 6.0},
        "camera": {"size": [64, 64], "fov_deg": 35},
        "scene": {"ground": "on", "sun": {"azimuth": 60, "elevation": 35, "strength": 4.0}},
        "channels": ["rgb", "instances"],
    }
    traced, *drawn = (next(iter(render(recipe_of(engine, **given)))) for engine in (CYCLES, SHADOWED, WORKBENCH))
    is_object = traced.channels["instances"] > 0
    expected, *found = (linear(s.channels["rgb"] / 255).mean(axis=2) for s in (traced, *drawn))

    def shadow(light):
        return (light < 0.75 * np.median(light[-8:])) & ~is_object

    assert shadow(expected).sum() > 60
    for light in found:
        assert light[is_object].mean() == pytest.approx(expected[is_object].mean(), rel=0.15)
        assert (shadow(light) & shadow(expected)).sum() > 0.75 * (shadow(light) | shadow(expected)).sum()


def test_textures_are_there(tmp_path):
    """Left and right halves of a picture, over both renderers' ways to find it."""
    import trimesh
    from PIL import Image

    halves = np.zeros((8, 8, 3), np.uint8)
    halves[:, :4], halves[:, 4:] = (220, 30, 30), (30, 30, 220)
    corners = [[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]  # glTF's y points up
    mesh = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    painted = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(halves), metallicFactor=0.0, roughnessFactor=1.0
    )
    mesh.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=painted)
    mesh.export(tmp_path / "halves.glb")
    model = {"source": str(tmp_path / "halves.glb"), "category": "card", "scale": "as_is"}
    for engine in ENGINES.values():
        (picture,) = pictures(
            engine=engine,
            models=[model],
            viewpoints={"azimuth": [0], "elevation": [0], "distance": 2.0},
            scene={"ground": False},
        )
        left, right = (picture[40:56, part].reshape(-1, 3).mean(axis=0) for part in (np.s_[28:40], np.s_[56:68]))
        assert left[0] > 2 * left[2]
        assert right[2] > 2 * right[0]


@pytest.mark.parametrize("engine", ENGINES.values(), ids=ENGINES)
def test_a_border_moves_no_pixel(engine):
    stage = stage_of(recipe_of(engine))
    camera = moved_camera(stage.shot, (0.12, 0.0, 0.03))
    clip = clip_of(rasterize(stage.geometry, camera), stage.geometry, camera)
    x0, y0, x1, y1 = border_of(stage.geometry, camera)
    assert 0 < (x1 - x0) * (y1 - y0) < 0.6 * camera.width * camera.height
    part = stage._radiance(camera, True, clip)
    whole = stage._radiance(camera, False, clip)
    is_solid = part[..., 3] > 0.99
    assert is_solid.sum() > 200
    apart = np.abs(part - whole)[is_solid]
    assert apart.mean() < 0.003
    assert apart.max() < 0.1
    assert not part[:y0, :, 3].any() and not part[:, :x0, 3].any()


def test_the_same_again_and_after_a_kill(drawing):
    first = pictures(engine=WORKBENCH)
    assert np.abs(first[0].astype(int) - first[1]).mean() > 1
    samples = render(recipe_of(WORKBENCH))
    again = [next(samples).channels["rgb"]]
    os.kill(keeper_of(drawing).process.pid, signal.SIGKILL)
    again += [sample.channels["rgb"] for sample in samples]
    assert np.array_equal(again, first)


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        (UNSHADOWED | {"settings": {"taa_rendr": 3}}, r"engine\.settings\.taa_rendr: expected a setting of EEVEE"),
        (WORKBENCH | {"settings": {"light": "SUN"}}, r"engine\.settings\.light: expected a setting of Workbench"),
    ],
)
def test_what_this_blender_lacks_is_one_line(engine, said):
    with pytest.raises(UserError, match=said) as caught:
        pictures(engine=engine)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not Path("/usr/share/glvnd").exists() or sys.platform != "linux", reason="hides drivers as libglvnd does")
def test_where_nothing_can_be_drawn_it_says_so(drawing, monkeypatch, tmp_path):
    """Blender dies of it; whoever asks is told what to install, whichever way it is found out."""
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path))
    graphics = probe(drawing).graphics
    assert graphics is not None and "libegl1" in graphics.problem
    stage = replace(stage_of(recipe_of(WORKBENCH)), keeper=Keeper(drawing))
    camera = stage.shot.camera(0)
    with pytest.raises(UserError, match=r"engine: Workbench cannot draw .* libegl1 libgl1-mesa-dri, .* cycles") as caught:
        stage._radiance(camera, True)
    assert "\n" not in str(caught.value)
