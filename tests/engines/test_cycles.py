"""The Cycles engine: labels are raster's, colours lie on them to the pixel, a Blender that dies costs nothing."""

from __future__ import annotations

import dataclasses
import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
from cycles_scenes import DRAFT, HAIR_DRIER, asked, moved_camera, recipe_of, shift_between, stage_of

from built_once import built_once
from viewsphere import render
from viewsphere.blender.process import BlenderProcess
from viewsphere.codecs.srgb import linear
from viewsphere.engines.shared.blender.border import border_of
from viewsphere.engines.shared.blender.staging import keeper_of
from viewsphere.errors import BlenderDied, UserError
from viewsphere.truth.raster.visibility import rasterize

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blender")]

LABELS = ["depth", "instances", "parts", "normals"]
LENSES = {
    "pinhole": {},
    "off centre": {"size": [112, 90], "fov_deg": None, "K": [[130.0, 0, 50.3], [0, 105.0, 50.9], [0, 0, 1]]},
    "skew": {"fov_deg": None, "K": [[130.0, 9.0, 48.0], [0, 130.0, 48.0], [0, 0, 1]]},
    "barrel": {"distortion": {"model": "brown_conrady", "coefficients": [-0.2, 0.03, 0.001, -0.002]}},
    "fisheye": {"fov_deg": 60, "distortion": {"model": "fisheye", "coefficients": [0.03, -0.004, 0.0007, -0.0001]}},
}
SHARP = {"pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
MODELS = Path(__file__).parents[3] / "shared" / "models"
FILES = ["car/NormalCar2.glb", "chair/dining_chair_01.glb", "misc/mug.glb", "hair_drier/hair_drier_a.obj"]
MIRRORED = ["car/NormalCar1.obj", "misc/retro_computer.glb", "chair/wheelchair_01.glb", "awkward/nested40_negative_scale.glb"]
EVALUATED = ["car/BasicTaxi.blend", "boat/Viking boat.blend", "car/Taxi.fbx", "chair/OfficeChair.fbx", "awkward/huesitos.fbx"]
TIMED = ["awkward/CesiumMan.usdz", "awkward/BoxAnimated.usdz"]
MANY = ["awkward/1500_instances_unicode_names.glb", "misc/Tableware.glb"]


def pictures(channel="rgb", **given):
    return [sample.channels[channel] for sample in render(recipe_of(**given))]


@pytest.mark.parametrize("lens", LENSES)
def test_labels_are_rasters_and_colours_lie_on_them(lens):
    """Lights that differ pass for a shift, so it is outlines that are compared, seen from sides where they are long."""
    given = {
        "camera": LENSES[lens],
        "channels": ["rgba", *LABELS],
        "viewpoints": {"azimuth": [72, 288], "elevation": [25], "distance": 0.9},
        "scene": {"ground": False, "background": "transparent"},
    }
    shifts = []
    pairs = zip(
        render(recipe_of(DRAFT | {"samples": 48}, **given)), render(recipe_of({"name": "raster"}, **given)), strict=True
    )
    for cycles, raster in pairs:
        for name in LABELS:
            assert cycles.channels[name].tobytes() == raster.channels[name].tobytes()
        assert repr(cycles.objects) == repr(raster.objects)
        pair = [s.channels["rgba"].astype(float) for s in (cycles, raster)]
        shifts.append(shift_between(*(p[..., 3] for p in pair)))
        grey = [p[..., :3].mean(axis=2) * p[..., 3] / 255 for p in pair]
        assert np.corrcoef(grey[0].ravel(), grey[1].ravel())[0, 1] > 0.97
    assert np.hypot(*np.mean(shifts, axis=0)) <= 0.05


@pytest.mark.parametrize("source", ["zoo:car", "zoo:bicycle", "zoo:chair", *FILES, *MIRRORED, *EVALUATED, *TIMED, *MANY])
def test_truth_is_what_cycles_sees(source):
    if ":" not in source and not (MODELS / source).exists():
        pytest.skip(f"needs {MODELS / source}")
    model = {"source": source if ":" in source else str(MODELS / source), "category": "thing", "scale": {"length": 4.0}}
    recipe = recipe_of(
        {"name": "cycles", "samples": 1, "denoise": "off", "bounces": 0, "settings": SHARP},
        {"size": [640, 480], "fov_deg": 30},
        models=[model],
        viewpoints={"azimuth": [35], "elevation": [20], "distance": 10.0},
    )
    stage = stage_of(recipe)
    camera = stage.shot.camera(0)
    truth = rasterize(stage.geometry, camera)
    found = asked(stage, camera, ["index", "depth"], border=border_of(stage.geometry, camera))
    is_object = truth.triangle >= 0
    differs = is_object != (found["index"] == 1)
    assert is_object.sum() > 5000
    assert differs.sum() <= 5
    assert not (differs & ~at_edges(is_object)).any()
    depth = 1 / np.where(is_object, truth.inverse_depth, 1)
    flat = is_object & ~differs & ~at_edges(depth > 0, depth)
    # Gaps and ridges narrower than a pixel, and steps too low for an edge: one ray meets the zoo's car, by Embree too, 0.0002
    # pixels inside of the body's end around the windshield, and Cycles' ray, up to a hundredth of a pixel beside it, the pane
    # 5.7 mm behind.
    assert (np.abs(found["depth"] - depth)[flat] > 1e-3).sum() <= 5


def at_edges(mask, depth=None):
    """Pixels with a neighbour that is not like them: in the mask, or 2 % nearer or farther."""
    near = np.zeros(mask.shape, bool)
    for axis in (0, 1):
        for step in (-1, 1):
            near |= np.roll(mask, step, axis) != mask
            if depth is not None:
                near |= np.abs(np.roll(depth, step, axis) / depth - 1) > 0.02
    return near


def test_same_recipe_same_bytes():
    first = pictures()
    assert [p.tobytes() for p in pictures()] == [p.tobytes() for p in first]
    anew = pictures(engine=DRAFT | {"replace_after": 1})
    assert [p.tobytes() for p in anew] == [p.tobytes() for p in first]
    assert np.abs(first[0].astype(int) - first[1]).mean() > 1


def test_blender_is_replaced_after_so_many_shots(blender):
    def served(replace_after):
        seen = []
        for _ in range(3):
            pictures(
                engine=DRAFT | {"replace_after": replace_after, "samples": 1}, viewpoints={"azimuth": [0], "distance": 0.9}
            )
            seen.append(keeper_of(blender).process.pid)
        return seen

    keeper_of(blender).drop()
    first, second, third = served(2)
    assert first == second != third
    assert set(served(0)) == {third}


def test_a_blender_killed_between_frames_costs_nothing(blender):
    expected = pictures()
    samples = render(recipe_of())
    found = [next(samples).channels["rgb"]]
    os.kill(keeper_of(blender).process.pid, signal.SIGKILL)
    found += [sample.channels["rgb"] for sample in samples]
    assert np.array_equal(found, expected)


def test_a_blender_killed_within_a_frame_costs_nothing(monkeypatch):
    engine = DRAFT | {"samples": 128}  # so that a frame takes longer than the killer waits
    expected = pictures(engine=engine)
    samples = render(recipe_of(engine))
    found = [next(samples).channels["rgb"]]
    ask, died = BlenderProcess.ask, []

    def asked(self, do, *given, **told):
        if do == "render" and not died:
            threading.Timer(0.05, os.kill, [self.pid, signal.SIGKILL]).start()
        try:
            return ask(self, do, *given, **told)
        except BlenderDied:
            died.append(do)
            raise

    monkeypatch.setattr(BlenderProcess, "ask", asked)
    found += [s.channels["rgb"] for s in samples]
    assert died == ["render"]
    assert np.array_equal(found, expected)


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        ({"settings": {"sampels": 3}}, r"engine\.settings\.sampels: "),
        ({"settings": {"caustics_reflective": "perhaps"}}, r"engine\.settings\.caustics_reflective: "),
        ({"device": "metal"}, r"engine\.device: .*metal"),
    ],
)
def test_what_this_blender_lacks_is_one_line(engine, said):
    with pytest.raises(UserError, match=said) as caught:
        pictures(engine=DRAFT | engine)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("how", ["beside the middle", "beside the picture and behind the camera"])
def test_a_border_changes_no_pixel(how):
    stage = stage_of(recipe_of(DRAFT | {"denoise": "off"}))
    camera = moved_camera(stage.shot, (0.12, 0.0, 0.03))
    if how != "beside the middle":
        camera = dataclasses.replace(camera, t=camera.t + np.array([0.1, 0.0, -0.8]))
        depth = stage.geometry.vertices @ camera.R[2] + camera.t[2]
        assert depth.min() < 0 < depth.max()
    border = border_of(stage.geometry, camera)
    x0, y0, x1, y1 = border
    assert 0 < (x1 - x0) * (y1 - y0) < 0.6 * camera.width * camera.height
    whole, part = (asked(stage, camera, border=b)["picture"] for b in (None, border))
    assert (whole[..., 3] > 0).sum() > 300
    np.testing.assert_allclose(part, whole, atol=1e-5)


def test_pictures_do_not_depend_on_those_before_them():
    above_horizon = {"azimuth": [20, 140], "elevation": [15], "distance": 0.9}
    recipe = recipe_of(DRAFT | {"samples": 1, "denoise": "off"}, scene={"ground": True}, viewpoints=above_horizon)
    stage = stage_of(recipe)
    cameras = [stage.shot.camera(i) for i in range(2)]
    asks = [(0, True, None), (1, False, None), (1, True, None), (0, False, (20, 10, 60, 50))]

    def picture(stage, i, is_open, border):
        return asked(stage, cameras[i], transparent=is_open, border=border)["picture"]

    alone = [picture(stage_of(recipe), *ask) for ask in asks]
    assert len({one.tobytes() for one in alone}) == len(asks)
    for k in (0, 1, 2, 3, 1, 0, 2):
        assert np.array_equal(picture(stage, *asks[k]), alone[k])


def test_nothing_in_view_is_nothing():
    recipe = recipe_of(scene={"ground": False, "background": "transparent"}, channels=["rgba"])
    stage = stage_of(recipe)
    camera = moved_camera(stage.shot, (30.0, -40.0, 0.0))
    assert not stage._radiance(camera, True).any()
    assert np.isfinite(stage._radiance(camera, False)).all()


def card(folder, side=1.0):
    """An upright square of grey, facing all sides it can: two triangles in a GLB."""
    import trimesh

    box = trimesh.creation.box((side, side, side))
    box.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            baseColorFactor=(128, 128, 128, 255), metallicFactor=0.0, roughnessFactor=1.0
        )
    )
    box.export(folder / "card.glb")
    return {"source": str(folder / "card.glb"), "category": "card", "scale": "as_is"}


BLACK = {"zenith": [0, 0, 0], "horizon": [0, 0, 0]}
LIGHTS = {
    "sun": {"sun": {"azimuth": 10, "elevation": 35, "strength": 2.0}, "sky": BLACK},
    "wide sun": {"sun": {"azimuth": 10, "elevation": 35, "strength": 2.0, "angle_deg": 20}, "sky": BLACK},
    "sky": {"sun": "off"},
    "daylight": {"sky": "daylight"},
    "point": {"sun": "off", "sky": BLACK, "lights": [{"kind": "point", "position": [1, -3, 1], "strength": 12.0}]},
    "spot": {
        "sun": "off",
        "sky": BLACK,
        "lights": [{"kind": "spot", "position": [0.5, -3, 1], "strength": 15.0, "angle_deg": 60, "color": [1, 0.5, 0.2]}],
    },
    "area": {
        "sun": "off",
        "sky": BLACK,
        "lights": [{"kind": "area", "position": [0.5, -3, 1], "strength": 15.0, "size": [1, 2]}],
    },
    "hemisphere": {"sun": "off", "sky": BLACK, "lights": [{"kind": "hemisphere", "strength": 0.8, "below": [0.1, 0.2, 0.4]}]},
}


@pytest.mark.parametrize("light", LIGHTS)
def test_light_is_as_bright_as_rasters(light, tmp_path):
    given = {
        "models": [card(tmp_path)],
        "viewpoints": {"azimuth": [0], "elevation": [15], "distance": 4.0},
        "camera": {"size": [64, 64], "fov_deg": 20},
        "scene": {"ground": False, **LIGHTS[light], "view": {"transform": "raw"}},
    }
    (cycles,) = pictures(engine=DRAFT | {"samples": 64}, **given)
    (raster,) = pictures(engine={"name": "raster"}, **given)
    middle = np.s_[28:44, 24:40]
    a, b = (linear(p[middle] / 255).reshape(-1, 3).mean(axis=0) for p in (cycles, raster))
    assert b.max() > 0.02
    np.testing.assert_allclose(a, b, rtol=0.05, atol=0.002)


@pytest.mark.parametrize("background", ["colour", "photo", "environment"])
def test_a_catcher_shows_the_shadow_over_what_is_there(background, tmp_path):
    from PIL import Image

    if background == "photo":
        Image.fromarray(np.full((60, 60, 3), (180, 150, 90), np.uint8)).save(tmp_path / "photo.png")
    photo = str(tmp_path / "photo.png")
    seen = {"colour": {"color": [0.7, 0.6, 0.35]}, "photo": {"image": photo}}.get(background)
    scene = {"ground": "catcher", "sun": {"azimuth": 60, "elevation": 35, "strength": 4.0}}
    given = {
        "models": [card(tmp_path)],
        "viewpoints": {"azimuth": [0], "elevation": [35], "distance": 6.0},
        "camera": {"size": [64, 64], "fov_deg": 35},
        "scene": scene | ({"background": seen} if seen else {"sky": hdri(tmp_path), "background": "environment"}),
    }
    (cycles,) = pictures(engine=DRAFT | {"samples": 64}, **given)
    (raster,) = pictures(engine={"name": "raster"}, **given)
    apart = np.abs(cycles.astype(float) - raster)
    assert apart.mean() < 8
    assert np.abs(cycles[:4].astype(float) - raster[:4]).mean() < 3
    darkness = [p.astype(float).mean(axis=2) < 0.75 * np.median(p[-8:]) for p in (cycles, raster)]
    both = (darkness[0] & darkness[1]).sum() / max(1, (darkness[0] | darkness[1]).sum())
    assert darkness[1].sum() > 60
    assert both > 0.75


def hdri(folder, turn=0.0):
    """A dim sphere with a bright patch at azimuth -90 degrees of the picture's middle, above the horizon."""
    import OpenEXR

    pixels = np.full((64, 128, 3), 0.2, np.float32)
    pixels[26:30, 40:46] = (3.0, 2.0, 0.5)
    file = folder / "patch.exr"
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": pixels}).write(str(file))
    return {"hdri": str(file), "rotation_deg": turn}


@pytest.mark.parametrize("turn", [0.0, 70.0])
def test_an_environment_stands_where_rasters_does(turn, tmp_path):
    given = {
        "scene": {"ground": False, "sky": hdri(tmp_path, turn)},
        "camera": {"size": [96, 96], "fov_deg": 90},
        "viewpoints": {"azimuth": [0, 90, 180, 270], "elevation": [0], "distance": 3.0},
    }
    cycles, raster = (np.array(pictures(engine=e, **given), float) for e in (DRAFT | {"samples": 16}, {"name": "raster"}))
    patches = [p[..., 0] - p[..., 2] > 60 for p in (cycles, raster)]
    assert patches[1].sum() > 20
    assert (patches[0] & patches[1]).sum() / (patches[0] | patches[1]).sum() > 0.85


def test_clear_pictures_have_alpha():
    scene = {"ground": False, "background": "transparent"}
    (cycles, *_), (raster, *_) = (
        pictures("rgba", engine=e, scene=scene, channels=["rgba"]) for e in (DRAFT | {"samples": 32}, {"name": "raster"})
    )
    alpha = [p[..., 3].astype(float) / 255 for p in (cycles, raster)]
    assert np.abs(alpha[0] - alpha[1]).mean() < 0.01
    assert ((alpha[0] > 0.99) == (alpha[1] > 0.99)).mean() > 0.97
    solid = (alpha[0] > 0.99) & (alpha[1] > 0.99)
    assert np.abs(cycles[solid].astype(float) - raster[solid]).mean() < 12


def test_the_ground_fades_where_rasters_does():
    given = {"scene": {"background": "transparent", "ground": "on"}, "channels": ["rgba"]}
    (cycles, *_), (raster, *_) = (pictures("rgba", engine=e, **given) for e in (DRAFT, {"name": "raster"}))
    assert np.abs(cycles[..., 3].astype(float) - raster[..., 3]).mean() < 3
    sky = [pictures(engine=e, scene={})[0].astype(float) for e in (DRAFT, {"name": "raster"})]
    assert np.abs(sky[0][:10] - sky[1][:10]).mean() < 4


def test_company_repaints_and_scenery_look_alike():
    given = {
        "models": [{"source": "zoo:car", "category": "car", "count": 2, "scale": {"length": 1.8}}],
        "viewpoints": {"azimuth": [30], "elevation": [20], "distance": 5.0},
        "scene": {
            "company": 1,
            "place": "zoo:neighbourhood",
            "materials": [{"tint": {"choice": ["#c03020", "#2040c0"]}, "roughness": 0.4}],
        },
        "channels": ["rgb", "instances"],
        "splits": {"by": "frame"},
    }
    with built_once():
        cycles, raster = (next(iter(render(recipe_of(engine, **given)))) for engine in (DRAFT, {"name": "raster"}))
    assert cycles.channels["instances"].tobytes() == raster.channels["instances"].tobytes()
    assert raster.channels["instances"].max() == 2
    apart = np.abs(cycles.channels["rgb"].astype(float) - raster.channels["rgb"])
    assert np.median(apart) < 12
    target = raster.channels["instances"] > 0
    means = [s.channels["rgb"][target].mean(axis=0) for s in (cycles, raster)]
    np.testing.assert_allclose(means[0], means[1], rtol=0.15, atol=6)


def test_memory_stays_flat_over_many_shots(blender):
    """Models, pictures and skies of the shots before are gone."""
    used = []
    for i in range(60):
        engine = DRAFT | {"samples": 1, "denoise": "off", "replace_after": 0}
        stage = stage_of(recipe_of(engine, {"size": [16, 16]}, models=[HAIR_DRIER], seed=i % 3))
        camera = stage.shot.camera(0)
        asked(stage, camera)
        used.append(keeper_of(blender).process.ask("memory")["rss_mb"])
    assert max(used[40:]) <= 1.05 * max(used[10:20])


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="needs Linux")
def test_one_thread_starts_no_others_and_any_core_may_run_it(blender):
    """Libraries count cores as they are loaded; those that find no work for theirs would spin."""
    threads = {}
    for count in (1, 2):
        pictures(engine=DRAFT | {"threads": count}, viewpoints={"azimuth": [0], "distance": 0.9})
        tasks = [int(t.name) for t in Path(f"/proc/{keeper_of(blender).process.pid}/task").iterdir()]
        assert all(os.sched_getaffinity(task) == os.sched_getaffinity(0) for task in tasks)
        threads[count] = len(tasks)
    assert threads[1] <= threads[2]
