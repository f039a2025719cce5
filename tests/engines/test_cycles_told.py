"""What the Cycles engine needs no Blender for: its options, the plain data that it tells, the geometry of its lenses."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from cycles_scenes import recipe_of, stages
from light_stage import flat

from viewsphere import plan
from viewsphere.engines import cycles
from viewsphere.engines.shared.blender.border import AROUND, border_of
from viewsphere.engines.shared.blender.lens import resampled, views_of
from viewsphere.engines.shared.blender.options import PRESETS, Options, parse_options
from viewsphere.engines.shared.blender.requests import scene_request
from viewsphere.errors import MissingExtraError, RecipeError, UserError, ViewsphereError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

WIDE = {"width": 80, "height": 60, "cx": 37.0, "cy": 33.0}
BARREL = lens_parameters("brown_conrady", coefficients=(-0.2, 0.03, 0.001, -0.002))
LENSES = {
    "pinhole": Intrinsics(**WIDE, fx=70, fy=60),
    "skew": Intrinsics(**WIDE, fx=70, fy=60, skew=9.0),
    "barrel": Intrinsics(**WIDE, fx=70, fy=60, distortion=BARREL),
    "fisheye 90": Intrinsics(
        **WIDE, fx=50, fy=50, distortion=lens_parameters("fisheye", coefficients=(0.03, -0.004, 0.0, 0.0))
    ),
    "fisheye 220": Intrinsics(**WIDE, fx=20, fy=20, distortion=lens_parameters("fisheye", coefficients=(0.0, 0.0, 0.0, 0.0))),
}


def test_presets_differ_and_other_options_change_them():
    assert parse_options({}) == Options() == PRESETS["good"]
    assert parse_options({"quality": "draft"}) == PRESETS["draft"]
    assert PRESETS["draft"].samples < PRESETS["good"].samples < PRESETS["final"].samples
    changed = parse_options({"quality": "draft", "samples": 9, "denoise": False, "settings": {"seed": 3}})
    assert (changed.samples, changed.denoise, changed.bounces) == (9, "off", PRESETS["draft"].bounces)
    assert changed.settings == {"seed": 3}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"sampels": 4}, "engine.sampels: .*samples"),
        ({"quality": "drat"}, "engine.quality: expected draft, good or final, found 'drat'"),
        ({"samples": 0}, "engine.samples: expected an integer in 1..65536, found 0"),
        ({"samples": True}, "engine.samples: "),
        ({"denoise": "very"}, "engine.denoise: expected off, fast or best"),
        ({"device": "gpu"}, "engine.device: expected cpu, cuda, "),
        ({"python": 3}, "engine.python: "),
        ({"settings": ["seed"]}, "engine.settings: "),
    ],
)
def test_a_wrong_option_is_one_line(given, said):
    with pytest.raises(RecipeError, match=said) as caught:
        parse_options(given)
    assert "\n" not in str(caught.value)


def test_a_python_without_blender_is_one_line(tmp_path):
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -I -S "$@"\n')
    bare.chmod(0o755)
    for python in (bare, tmp_path / "none"):
        with pytest.raises((UserError, MissingExtraError), match=str(python)) as caught:
            cycles.ENGINE.check({"python": str(python)})
            stage = cycles.stage(shot_of(engine={"name": "cycles", "python": str(python)}), stages().model).arrangement(0)
            stage.keeper.process_for(stage)
        assert "\n" not in str(caught.value)


def shot_of(**given):
    return next(plan(recipe_of(**given)).shots(stages().box))


def of_request(**given):
    """What Blender is told of a recipe's first shot, and the arrays by the names they were given."""
    shot = shot_of(**given)
    meshes = [stages().model(p.model) for p in shot.things]
    geometry = build_geometry(shot.things, meshes, shot.scene.ground is not None, shot.label_alpha)
    arrays: dict[str, np.ndarray] = {}

    def put(array):
        arrays[f"{len(arrays)}"] = np.array(array)
        return f"{len(arrays) - 1}"

    options = parse_options(shot.engine_options)
    return scene_request(shot.things, meshes, geometry, shot.scene, options, put), arrays, geometry


def test_what_is_told_is_plain_and_truths_own():
    told, arrays, geometry = of_request(scene={"ground": {"color": [0.3, 0.3, 0.3], "roughness": 0.6}})
    assert json.loads(json.dumps(told)).keys() == told.keys()
    (thing,), (mesh,) = told["objects"], told["meshes"]
    move = np.array(thing["matrix"])
    world = arrays[mesh["vertices"]].astype(float) @ move[:3, :3].T + move[:3, 3]
    np.testing.assert_allclose(world, geometry.vertices[: geometry.vertex_start[1]], atol=1e-9)
    assert np.array_equal(arrays[mesh["triangles"]], geometry.triangles[: geometry.triangle_start[1]])
    floor = told["ground"]["mesh"]
    np.testing.assert_allclose(arrays[floor["vertices"]], geometry.vertices[geometry.vertex_start[-1] :], rtol=1e-6)
    assert np.allclose(arrays[floor["vertices"]][:, 2], geometry.ground_z)
    assert floor["materials"][0]["roughness"] == 0.6


@pytest.mark.slow
def test_copies_share_their_mesh_and_repaints_only_its_arrays():
    told, arrays, _ = of_request(
        models=[{"source": "zoo:chair", "category": "chair", "count": 1, "scale": {"length": 0.5}}],
        scene={"ground": False, "place": "zoo:neighbourhood"},
    )
    used = [tuple(m[name] for name in ("vertices", "triangles", "normals")) for m in told["meshes"]]
    kinds = {id_of(arrays, names) for names in used}
    assert len(kinds) == len(used) < len(told["objects"])
    assert [o["index"] for o in told["objects"]] == [1, *[0] * (len(told["objects"]) - 1)]


def id_of(arrays, names):
    return tuple(arrays[name].tobytes() for name in names)


def test_an_unreadable_sky_is_a_users_error(tmp_path):
    (tmp_path / "sky.exr").write_bytes(b"none")
    with pytest.raises(ViewsphereError) as caught:
        of_request(scene={"ground": False, "sky": str(tmp_path / "sky.exr")})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("lens", LENSES)
def test_views_hold_every_ray_where_the_lens_has_it(lens):
    """A picture of directions, seen through the views, gives each pixel its own ray."""
    intrinsics = LENSES[lens]
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    camera = Camera(intrinsics, turn, np.array([0.1, -0.2, 0.4]))
    views = views_of(camera, is_traced=True)
    assert (len(views) > 1) == (lens == "fisheye 220")
    pictures = []
    for view in views:
        np.testing.assert_allclose(view.camera.center, camera.center, atol=1e-12)
        rays = pixel_rays(view.camera.intrinsics).reshape(-1, 3) @ view.camera.R
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        shape = view.camera.height, view.camera.width, 4
        pictures.append(np.insert(rays, 3, 1, axis=1).astype(np.float32).reshape(shape))
    found = resampled(camera, views, pictures)
    own = pixel_rays(intrinsics) @ camera.R
    own /= np.linalg.norm(own, axis=2)[..., None]
    known = np.isfinite(own).all(axis=2)
    away = np.linalg.norm(found[..., :3] - own, axis=2)[known]
    assert np.all(found[known][:, 3] > 0.999)
    assert away.max() * max(intrinsics.fx, intrinsics.fy) < 0.02


def test_a_border_holds_all_that_is_seen():
    shot = shot_of(viewpoints={"azimuth": [0], "elevation": [10], "distance": 1.5})
    geometry = build_geometry(shot.things, [stages().model(shot.things[0].model)], False, shot.label_alpha)
    pose = Camera(shot.rig.sensors[0].intrinsics, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0.1, 0.0, 1.0]))
    x0, y0, x1, y1 = border_of(geometry, pose)
    seen = (geometry.vertices @ pose.R.T + pose.t) @ pose.K.T
    x, y = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
    assert x0 <= max(x.min(), 0) and y0 <= max(y.min(), 0)
    assert x1 >= min(x.max(), pose.width) and y1 >= min(y.max(), pose.height)
    assert x1 - x0 < np.ptp(x) + 8 and y1 - y0 < np.ptp(y) + 8
    around = Camera(pose.intrinsics, pose.R, np.zeros(3))
    assert border_of(geometry, around) == (0, 0, pose.width, pose.height)


@pytest.mark.parametrize("kind", ["one", "huge", "two things", "behind", "none"])
def test_a_border_is_the_box_of_what_is_seen(kind):
    """Triangles anywhere, around and behind the camera; what is seen is drawn eight times as fine."""
    rng = np.random.default_rng(5)
    thing = Thing(id=1, model=ModelSpec(key="a", source="a", category="thing", category_id=1))
    fine, close = 8, []
    for _ in range(40):
        soup = rng.normal(size=(2, 3, 3)) * (1e3 if kind == "huge" else 2.0)
        soup[:, :, 1] *= -1 if kind == "behind" else 1
        if kind == "behind":
            soup[:, :, 1] = -np.abs(soup[:, :, 1]) - 0.1
        meshes = [flat(triangles[None]) for triangles in (soup if kind == "two things" else soup[: 0 if kind == "none" else 1])]
        things = [thing.model_copy(update={"id": i + 1}) for i in range(len(meshes))]
        geometry = build_geometry(things, meshes, False, 0.5)
        eye = Camera(
            Intrinsics(width=24, height=18, fx=20, fy=20, cx=11.3, cy=9.2),
            np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
            np.zeros(3),
        )
        lens = eye.intrinsics
        large = lens.model_copy(
            update={name: getattr(lens, name) * fine for name in ("width", "height", "fx", "fy", "cx", "cy")}
        )
        seen = rasterize(geometry, Camera(large, eye.R, eye.t)).triangle >= 0
        x0, y0, x1, y1 = border_of(geometry, eye)
        if not seen.any():
            assert (x1 - x0) <= 2 * AROUND + 1 or (y1 - y0) <= 2 * AROUND + 1
            continue
        rows, columns = (np.flatnonzero(seen.any(axis=axis)) / fine for axis in (1, 0))
        for low, high, begin, end in ((x0, x1, columns[0], columns[-1]), (y0, y1, rows[0], rows[-1])):
            assert low <= begin and high >= end
            close.append(low >= begin - 2 * AROUND - 1.5 and high <= end + 2 * AROUND + 1.5)
    assert len(close) > 10 or kind in ("behind", "none")
    assert sum(close) >= 0.95 * len(close)  # but for tips that are too thin to be drawn
