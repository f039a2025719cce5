"""Animated files: what is read at a frame, the data sets of time steps, and cameras of files."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from animated import leaf
from scratch import scratch_cache
from shots import camera_of
from viewsphere import Dataset, Recipe, generate, plan
from viewsphere.assets import cache as model_cache
from viewsphere.assets.animation.timeline import Blenders, Clip
from viewsphere.assets.cache import load, load_normalised, read_ahead
from viewsphere.assets.inspect import describe
from viewsphere.check import check
from viewsphere.errors import ModelError, RecipeError
from viewsphere.geometry.camera import project
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.reports.inspection import report_lines
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Choice

FRAMES = (1, 13, 25)
KINDS = {"blend": None, "glb": "cubeAction", "usdc": None, "abc": None, "fbx": "cubeAction"}
"""What Blender exports has an animation for each object, in formats that may have several."""


@pytest.fixture(scope="module")
def files(blender, tmp_path_factory):
    """The folder of files that `make_moving` makes, with what it says as seen.json; do not change it."""
    folder = tmp_path_factory.mktemp("moving") / "files"
    folder.mkdir()
    run = subprocess.run([blender, Path(__file__).with_name("make_moving.py"), folder], capture_output=True, text=True)
    (folder / "seen.json").write_text(run.stdout.splitlines()[-1], "utf-8")
    return folder


def spec_of(path, **fields):
    return ModelSpec(key="a", source=str(path), category="thing", category_id=1, rest=1, **fields)


def at(frame):
    return TimeStep(frame=frame)


def recipe(files, name="jump.blend", frames=FRAMES, viewpoints=None, **fields):
    entry = {"source": str(files / name), "category": "cube", "frames": frames, "centring": "floor"}
    own = {key: fields.pop(key) for key in ("poses", "clip", "centring", "name") if key in fields}
    return Recipe(
        models=[{**entry, **own}],
        viewpoints=viewpoints or {"azimuth": [20, 200], "elevation": 15, "distance": 6},
        **{"camera": {"size": [64, 64], "fov_deg": 50}, **fields},
    )


def refused(files, **fields):
    with pytest.raises(RecipeError) as caught:
        plan(recipe(files, **fields))
    return str(caught.value)


def assert_holds(folder):
    report = check(Dataset(folder))
    assert report.ok, report


pytestmark = [pytest.mark.usefixtures("blenders")]


# Reading.


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_moves_from_where_it_stands_at_the_first_frame(files, kind):
    spec = spec_of(files / f"jump.{kind}", centring="floor", clip=KINDS[kind])
    read_ahead(spec, FRAMES)
    for frame, x, z in zip(FRAMES, (0, 1, 2), (0, 1, 0), strict=True):
        mesh, facts = load(spec, step=at(frame))
        reach = (np.cos((frame - 1) / 24) + np.sin((frame - 1) / 24)) / 2  # of a square that turns
        np.testing.assert_allclose(mesh.bounds, [[x - reach, -reach, z], [x + reach, reach, z + 1]], atol=2e-3)
        assert len(mesh.triangles) == 12
        assert facts.up == ("+y" if kind == "glb" else "+z")
    assert load(spec)[1].unit == 1
    np.testing.assert_array_equal(load(spec)[0].vertices, load(spec, step=at(1))[0].vertices)


def test_bones_are_named_points_at_each_frame(files):
    stages, spec = Stages(), spec_of(files / "bend.blend")
    points = [stages.metadata(spec, TimeStep(frame=frame)).keypoints.points for frame in FRAMES]
    assert [[*one] for one in points] == [["bone"]] * 3
    np.testing.assert_allclose([one["bone"][2] - points[0]["bone"][2] for one in points], (0, 0.5, 1), atol=0.02)
    assert [one["bone"][:2] for one in points] == [points[0]["bone"][:2]] * 3


def test_frames_are_read_at_once_and_each_is_the_same_alone(files, tmp_path, monkeypatch, blenders):
    spec = spec_of(files / "bend.blend")
    alone = load_normalised(spec, folder=tmp_path / "other", step=at(13))
    blenders.end()
    read_ahead(spec, FRAMES, tmp_path / "own")
    monkeypatch.setattr(model_cache, "read_apart", None)
    read_ahead(spec, FRAMES, tmp_path / "own")
    together = [load_normalised(spec, folder=tmp_path / "own", step=at(frame)) for frame in FRAMES]
    np.testing.assert_array_equal(together[1].vertices, alone.vertices)
    np.testing.assert_array_equal(together[1].normals, alone.normals)
    # An armature lifts the upper half and a shape key widens all, both by 1 m; the box of the first frame is centred.
    np.testing.assert_allclose(together[2].bounds, [[-1.5, -0.5, -0.5], [1.5, 0.5, 1.5]], atol=1e-5)
    np.testing.assert_allclose(together[0].bounds, [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], atol=1e-6)


def test_simulations_are_played_up_to_the_frame(files):
    fallen = load_normalised(spec_of(files / "fall.blend", centring="floor"), step=at(13))
    seconds = 12 / 24
    assert fallen.bounds[0, 2] == pytest.approx(-9.81 / 2 * seconds**2, rel=0.15)


def test_a_file_of_several_animations_is_warned_of(files):
    mesh, _ = load(spec_of(files / "jump.fbx"), step=at(13))
    assert "choose one by clip: 'cubeAction', 'eyeAction'" in mesh.warnings[-1]
    with pytest.raises(ModelError, match=r"expected an animation 'walk', found 'cubeAction', 'eyeAction'"):
        load(spec_of(files / "jump.fbx", clip="walk"), step=at(13))


def test_files_that_cannot_move_are_refused(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(ModelError, match=r"expected a file that can move \(abc, blend, fbx, .*found obj"):
        load(spec_of(tmp_path / "a.obj"), step=at(2))


# What files name.

USD = """#usda 1.0
(
 upAxis = "Z"
 metersPerUnit = 1
 startTimeCode = 1
 endTimeCode = 25
 {layers}
)
def Xform "root" {arc}
{{
 {moves}
 def Mesh "m" {{
  int[] faceVertexCounts = [3, 3, 3, 3]
  int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
  point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
 }}
}}
"""
MOVES = """double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 25: (2, 0, 0)}
 uniform token[] xformOpOrder = ["xformOp:translate"]"""


def timeline(path):
    """What a Blender of its own says, or the cache."""
    with Blenders.none_yet() as blenders:
        return blenders.timeline(path, True)


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path / "cache")


def usd(path, moves="", **named):
    path.write_text(USD.format(**{"layers": "", "arc": "", "moves": moves, **named}))
    return path


@pytest.mark.usefixtures("blender", "own_cache")
@pytest.mark.parametrize(
    "named",
    [
        {"layers": "subLayers = [@./deep/inner.usda@]"},
        {"arc": "(prepend references = @./deep/inner.usda@</root>)"},
        {"arc": "(prepend payload = @./deep/inner.usda@</root>)"},
    ],
    ids=["sublayer", "reference", "payload"],
)
def test_a_changed_layer_is_asked_about_anew(tmp_path, named, monkeypatch):
    (tmp_path / "deep").mkdir()
    usd(tmp_path / "deep" / "inner.usda", layers="subLayers = [@./moves.usda@]")
    top = usd(tmp_path / "top.usda", **named)
    assert not timeline(top).moves  # a layer is missing
    usd(tmp_path / "deep" / "moves.usda", MOVES)
    assert timeline(top).moves
    with monkeypatch.context() as known:
        known.setattr("viewsphere.assets.animation.timeline.started", None)
        assert timeline(top).moves
    usd(tmp_path / "deep" / "moves.usda")
    assert not timeline(top).moves


@pytest.mark.usefixtures("blender", "own_cache")
def test_layers_are_each_file_s_own(tmp_path, monkeypatch):
    """One Blender is asked about both."""
    first, second = (usd(tmp_path / f"{name}.usda", layers=f"subLayers = [@./in_{name}.usda@]") for name in "ab")
    inner = [usd(tmp_path / f"in_{name}.usda", MOVES) for name in "ab"]
    with Blenders.none_yet() as blenders:
        assert all(blenders.timeline(path, True).moves for path in (first, second))
    usd(inner[0])
    assert not timeline(first).moves
    monkeypatch.setattr("viewsphere.assets.animation.timeline.started", None)
    assert timeline(second).moves


@pytest.fixture(scope="module")
def rates(blender, tmp_path_factory):
    """Files of a plane that goes 5 m in ten frames of 60 a second, or of 30 / 1.001."""
    folder = tmp_path_factory.mktemp("rates")
    subprocess.run([blender, "-c", RATES, folder], check=True, capture_output=True)
    made = usd(folder / "fast.usda", MOVES.replace("25: (2", "11: (5"), layers="timeCodesPerSecond = 60")
    made.write_text(made.read_text().replace("endTimeCode = 25", "endTimeCode = 11"))
    return folder


NTSC = 30 / 1.001
RATES = """
import bpy, sys
for name, fps, base in (("fast", 60, 1.0), ("ntsc", 30, 1.001)):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.frame_start, scene.frame_end = fps, base, 1, 11
    bpy.ops.mesh.primitive_plane_add()
    for frame, x in ((1, 0), (11, 5)):
        bpy.context.object.location.x = x
        bpy.context.object.keyframe_insert("location", frame=frame)
    bpy.ops.wm.alembic_export(filepath=f"{sys.argv[-1]}/{name}.abc", as_background_job=False)
    bpy.ops.export_scene.gltf(filepath=f"{sys.argv[-1]}/{name}.glb")
    bpy.ops.export_scene.fbx(filepath=f"{sys.argv[-1]}/{name}.fbx")
"""


@cache
def steps_of(path, **fields):
    """Frame, seconds and middle in x of all time steps of a file."""
    recipe = Recipe(
        models=[{"source": str(path), "category": "plane", "centring": "as_is", "up": None, "frames": "all", **fields}],
        viewpoints={"distance": 5},
        formats=[],
    )
    planned = plan(recipe)
    (spec,) = planned.kept_specs
    read_ahead(spec, [step.frame for step in planned.steps_of(spec)])
    middles = [load_normalised(spec, step=step).vertices.mean(axis=0) for step in planned.steps_of(spec)]
    assert planned.steps_of(spec)[0].seconds == 0
    return np.array([(s.frame, s.seconds, *m) for s, m in zip(planned.steps_of(spec), middles, strict=True)])


@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize(
    ("name", "fps"),
    [("fast.usda", 60), ("fast.glb", 60), ("fast.abc", 60), ("fast.fbx", 60), ("ntsc.abc", NTSC), ("ntsc.fbx", NTSC)],
)
def test_files_keep_their_own_times(rates, name, fps):
    steps = steps_of(rates / name)
    assert len(steps) == 11
    assert np.allclose(steps[:, 1], np.arange(11) / fps, rtol=1e-6)
    went = np.linalg.norm(steps[:, 2:] - steps[0, 2:], axis=1)
    assert went[-1] == pytest.approx(5, abs=1e-4)
    assert (np.diff(went) > 0.1).all() if "usda" not in name else np.allclose(np.diff(went), 0.5, atol=1e-4)


@pytest.mark.usefixtures("own_cache")
def test_frames_are_as_many_a_second_as_the_recipe_says(rates):
    for name in ("fast.glb", "fast.abc"):
        steps = steps_of(rates / name, fps=120)
        assert len(steps) == 21
        assert np.allclose(steps[:, 1], np.arange(21) / 120)
        assert np.allclose(steps[::2, 2:], steps_of(rates / name)[:, 2:], atol=1e-4)
    for name in ("fast.usda", "fast.fbx"):
        assert np.allclose(steps_of(rates / name, fps=30)[:, 1], np.arange(11) / 30)
    fresh = plan(Recipe(models=[{"source": str(rates / "fast.glb"), "category": "c"}], viewpoints={"distance": 5}, formats=[]))
    assert "fps" not in fresh.model_specs[0].model_dump()


LINK = """
import os, sys
import bpy
folder = sys.argv[1]
for name in ("library", "still"):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    item = bpy.data.objects.new("cube", bpy.data.meshes.new("cube"))
    bpy.context.scene.collection.objects.link(item)
    if name == "library":
        item.keyframe_insert("location", frame=1)
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/deep/{name}.blend", check_existing=False)
for kind in ("middle", "top"):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    place, source = ("deep/middle", "deep/library") if kind == "middle" else ("top", "deep/middle")
    with bpy.data.libraries.load(f"{folder}/{source}.blend", link=True) as (_, wanted):
        wanted.objects = ["cube"] if kind == "middle" else ["holder"]
    if kind == "middle":
        holder = bpy.data.objects.new("holder", None)
        holder.constraints.new("COPY_LOCATION").target = wanted.objects[0]
        bpy.context.scene.collection.objects.link(holder)
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{place}.blend", check_existing=False, relative_remap=True)
os._exit(0)
"""


@pytest.mark.usefixtures("own_cache")
def test_a_changed_library_is_asked_about_anew(blender, tmp_path):
    """Of a library, too."""
    (tmp_path / "deep").mkdir()
    subprocess.run([blender, "-c", LINK, tmp_path], check=True, capture_output=True)
    assert timeline(tmp_path / "top.blend").moves
    shutil.move(tmp_path / "deep" / "still.blend", tmp_path / "deep" / "library.blend")
    assert not timeline(tmp_path / "top.blend").moves


@pytest.mark.usefixtures("own_cache")
def test_a_changed_buffer_is_read_anew(files, blender, tmp_path):
    (tmp_path / "models").mkdir()
    export = (
        "import os, sys; import bpy\n"
        "bpy.ops.wm.open_mainfile(filepath=sys.argv[1])\n"
        "bpy.ops.export_scene.gltf(filepath=sys.argv[2], export_format='GLTF_SEPARATE')\nos._exit(0)"
    )
    path = tmp_path / "models" / "jump.gltf"
    subprocess.run([blender, "-c", export, files / "jump.blend", path], check=True, capture_output=True)
    spec, buffer = spec_of(path), path.with_suffix(".bin")
    before, data = load(spec, step=at(13))[0].bounds, np.frombuffer(buffer.read_bytes(), np.float32).copy()
    assert timeline(path).last == 25
    accessors = json.loads(path.read_text())
    times = accessors["bufferViews"][accessors["accessors"][accessors["animations"][0]["samplers"][0]["input"]]["bufferView"]]
    first = times.get("byteOffset", 0) // 4
    data[first : first + times["byteLength"] // 4] *= 2
    buffer.write_bytes(data.tobytes())
    assert timeline(path).last > 25
    assert abs(load(spec, step=at(13))[0].bounds - before).max() > 0.1


# Recipes.


def test_mistakes_cost_one_line(files):
    assert "models[0].frames: expected a file in which something moves; found no animation in " in refused(
        files, name="still.blend"
    )
    assert "models[0].frames: expected frames of 1 to 25, as " in refused(files, frames=[1, 99])
    assert "found 99" in refused(files, frames=[1, 99])
    said = refused(files, poses="moving")
    assert "models[0].poses: expected as many poses as time steps, for moving; found 2 poses and 3 time steps of jump" in said
    assert "expected an animation 'walk', found 'cubeAction', 'eyeAction'" in refused(files, name="jump.glb", clip="walk")


def test_a_data_set_of_time_steps(files, tmp_path):
    asked = recipe(files, frames={"step": 12}, channels=["rgb", "instances", "depth"])
    planned = plan(asked)
    assert (planned.frames, planned.time_steps, planned.factors) == (6, 3, "1 model x 3 time steps x 2 poses")
    generate(asked, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    assert [(s.pose.time.frame, s.pose.time.seconds) for s in dataset] == [(f, (f - 1) / 24) for f in FRAMES for _ in range(2)]
    assert [(s.objects[0].id, s.objects[0].track, s.objects[0].key) for s in dataset[::2]] == [
        (1, "jump", f"jump-f{frame:04d}") for frame in FRAMES
    ]
    assert len({s.split for s in dataset}) == 1
    # The camera stands still, and the cube jumps before it, above ground.
    assert len({s.camera.t.tobytes() for s in dataset[::2]}) == 1
    lows = [s.objects[0].box3d[:, 2].min() for s in dataset[::2]]
    np.testing.assert_allclose(lows, [0, 1, 0], atol=1e-5)
    assert_holds(tmp_path / "out")
    images = json.loads((tmp_path / "out" / "coco" / "annotations" / f"instances_{dataset[0].split}.json").read_text())
    assert [(i["frame"], i["seconds"]) for i in images["images"]] == [(f, (f - 1) / 24) for f in FRAMES for _ in range(2)]
    assert {a["id_track"] for a in images["annotations"]} == {"jump"}
    poses = json.loads((tmp_path / "out" / "native" / "dataset1.json").read_text())["poses"]
    assert [pose["frame"] for pose in poses.values()] == [1, 1, 13, 13, 25, 25]


def test_models_are_chosen_with_all_time_steps_or_by_one(files, tmp_path):
    generate(recipe(files, frames={"step": 12}, channels=["rgb", "instances"], formats=["native"]), tmp_path / "out")
    import_dataset("native", tmp_path / "out" / "native", tmp_path / "in")
    for name in ("out", "in"):

        def found(*models, folder=tmp_path / name):
            return [(s.objects[0].key, s.objects[0].track) for s in Dataset(folder, Choice(models))]

        first, middle, last = ([(f"jump-f{frame:04d}", "jump")] * 2 for frame in FRAMES)
        assert found() == found("jump") == found("*") == first + middle + last
        assert found("jump-f0013") == middle
        assert found("jump-f002*", "jump-f0001") == first + last
        assert found("jump-f0002") == found("jum") == []


def test_time_steps_are_appended(files, tmp_path):
    generate(recipe(files, frames=[1], formats=[]), tmp_path / "out")
    before = [s.depth.tobytes() for s in Dataset(tmp_path / "out")]
    generate(recipe(files, frames=[1, 25], formats=[]), tmp_path / "out", append=True)
    dataset = Dataset(tmp_path / "out")
    assert [s.pose.time.frame for s in dataset] == [1, 1, 25, 25]
    assert [s.depth.tobytes() for s in dataset[:2]] == before
    assert_holds(tmp_path / "out")


def test_a_camera_may_follow(files):
    asked = recipe(files, viewpoints={"azimuth": 20, "elevation": 15, "distance": 6, "target": "follow"})
    planned, stages = plan(asked), Stages()
    shots = [planned.shot(i, stages.box) for i in range(planned.shot_count)]
    seen = [next(stages.render(shot)).objects[0].box3d_pixels.mean(axis=0) for shot in shots]
    assert np.ptp([pixel[0] for pixel in seen]) < 2
    centers = [next(stages.render(shot)).camera.center for shot in shots]
    np.testing.assert_allclose(np.subtract(centers[2], centers[0]), [2, 0, 0], atol=1e-4)


def test_both_engines_have_the_same_labels(files):
    shots = []
    for engine in ({"name": "raster"}, {"name": "cycles", "samples": 1}):
        asked = recipe(files, frames=[13], engine=engine, channels=["rgb", "instances", "depth"])
        planned, stages = plan(asked), Stages()
        shots.append(next(stages.render(planned.shot(0, stages.box))))
    assert shots[0].instances.tobytes() == shots[1].instances.tobytes()
    assert shots[0].depth.tobytes() == shots[1].depth.tobytes()
    assert shots[0].instances.any()


# Cameras.


@pytest.mark.parametrize("kind", ["blend", "usdc", "fbx", "glb"])
def test_cameras_see_what_blender_sees(files, kind):
    clip = {"camera": "eye", "size": [160, 120]} if kind != "blend" else {}
    clip |= {"clip": "eyeAction"} if kind in ("fbx", "glb") else {}
    viewpoints = {"kind": "file", "path": str(files / f"jump.{kind}"), "frames": FRAMES, **clip}
    asked = recipe(files, poses="moving", viewpoints=viewpoints, centring="as_is", camera={"of_viewpoints": True})
    planned, stages = plan(asked), Stages()
    lens = planned.intrinsics
    if kind == "glb":  # glTF has no shift
        lens = lens.model_copy(update={"cx": lens.cx - 8, "cy": lens.cy - 16})
    assert (lens.width, lens.height) == (160, 120)
    seen = json.loads((files / "seen.json").read_text())
    assert planned.frames == planned.shot_count == 3
    for shot in (planned.shot(i, stages.box) for i in range(3)):
        camera = camera_of(lens, shot.instants[0].viewpoint, (0, 0, 0))
        vertices = stages.model(shot.things[0].model, shot.things[0].step).vertices.astype(float)
        pixels, _ = project(lens, vertices @ camera.R.T + camera.t)
        expected = np.array(seen[str(shot.instants[0].viewpoint.time.frame)])
        gaps = np.linalg.norm(pixels[:, None] - expected, axis=2)
        assert gaps.min(axis=0).max() < 1e-3
        assert gaps.min(axis=1).max() < 1e-3


def test_an_object_may_be_the_cameras_world(files):
    def center(**fields):
        viewpoints = {"kind": "file", "path": str(files / "jump.blend"), **fields}
        planned = plan(recipe(files, frames=[1], viewpoints=viewpoints, camera={"of_viewpoints": True}))
        return camera_of(planned.intrinsics, planned.pose_list[0], (0, 0, 0)).center

    np.testing.assert_allclose(center(), (0, -6, 2), atol=1e-5)
    c, s = np.cos(0.5), np.sin(0.5)
    expected = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ (np.array([0, -6, 2]) - (1, 2, 3))
    np.testing.assert_allclose(center(at="spot"), expected, atol=1e-5)


def test_cameras_that_are_none_cost_one_line(files):
    def said(**fields):
        return refused(files, viewpoints={"kind": "file", **fields}, camera={"of_viewpoints": True})

    path = str(files / "jump.blend")
    assert "expected a camera 'ey', found 'eye', 'orthographic'" in said(path=path, camera="ey")
    assert "expected a perspective lens, found ortho" in said(path=path, camera="orthographic")
    assert "viewpoints.frames: expected frames of 1 to 25, as " in said(path=path, frames=[0])
    assert "expected one camera, found none at all" in said(path=str(files / "still.blend"))
    (files.parent / "poses.csv").write_text("azimuth,elevation,distance\n1,2,3\n")
    assert "viewpoints.camera: expected a 3D file" in said(path=str(files.parent / "poses.csv"), camera="eye")


# Being inspected.


@pytest.mark.parametrize("kind", KINDS)
def test_inspect_lists_frames_rate_and_clips_of_every_format(files, kind):
    line = describe(files / f"jump.{kind}").animation
    assert (line.first, line.last, line.fps) == (1, 25, 24)
    cube, eye = Clip("cubeAction", 1, 25), Clip("eyeAction", 1, 25)
    assert line.clips == {"usdc": (), "abc": ()}.get(kind, (cube, eye))


def test_inspect_says_nothing_of_a_blend_file_in_which_nothing_moves(files):
    assert describe(files / "still.blend").animation is None


@pytest.mark.usefixtures("blender")
def test_inspect_lists_the_frames_that_each_clip_has(tmp_path):
    seconds = {"Walk": 1, "Wave": 0.5}
    leaf(tmp_path / "leaf.gltf", seconds)
    report = describe(tmp_path / "leaf.gltf")
    assert [clip.name for clip in report.animation.clips] == list(seconds)
    with Blenders.none_yet() as blenders:
        for clip in report.animation.clips:
            line = blenders.timeline(tmp_path / "leaf.gltf", True, clip.name)
            assert (clip.first, clip.last) == (line.first, line.last)
            assert line.seconds(clip.last) == seconds[clip.name]
    lines = list(report_lines(report))
    assert "  animation  frames 0 to 24, 24 fps: 1 s" in lines
    at = lines.index("  clips      2 (choose one by clip)")
    assert lines[at + 1 : at + 3] == ["    Walk: frames 0 to 24", "    Wave: frames 0 to 12"]
