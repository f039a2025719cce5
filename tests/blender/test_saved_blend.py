"""A data set as .blend files: opened in plain bpy, they show the frames they were made from."""

from __future__ import annotations

import getpass
import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from viewsphere import Dataset, Recipe, generate
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store import Choice

pytestmark = [pytest.mark.slow]

DRIERS = {"source": "zoo:hair_drier", "category": "hair drier", "supercategory": "appliance", "count": 2}
FRAMES = [1, 4, 6]


def recipe_of(**changed) -> Recipe:
    """Two driers, one beside the other, from six sides, through an oblique lens of oblong pixels."""
    given = {
        "name": "driers",
        "models": [DRIERS | {"scale": {"length": 0.3}}],
        "viewpoints": {"azimuth": [10, 130, 250], "elevation": [20, 55], "distance": [1.4], "tilt": [9]},
        "camera": {"size": [96, 72], "K": [[100.0, 0, 51.5], [0, 90.0, 33.0], [0, 0, 1]]},
        "scene": {"company": 1, "ground": "on"},
        "splits": {"train": 1.0},
        "channels": ["rgb", "instances"],
        "formats": [],
        "shot_frames": 4,
    }
    return Recipe(**(given | changed))


def opened(python, file: Path, folder: Path, **wanted) -> dict:
    """What bpy alone finds in a file; the frames it renders lie in the folder."""
    folder.mkdir(exist_ok=True)
    script = Path(__file__).with_name("open_export.py")
    run = subprocess.run([python, script, file, folder, json.dumps(wanted)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-3000:]
    return json.loads((folder / "said.json").read_text())


def shown(dataset: Dataset, key: str) -> list:
    """A model's samples: the frames of its file's timeline."""
    return [sample for sample in dataset if sample.objects[0].key == key]


def numbers(folder: Path, frame: int) -> np.ndarray:
    """The objects' numbers in a frame's picture, (H, W)."""
    import OpenEXR

    channels = OpenEXR.File(str(folder / f"index{frame}.exr")).channels()
    return np.rint(channels["RGB"].pixels[..., 0]).astype(int)


def picture(folder: Path, frame: int) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(folder / f"picture{frame}.png")).astype(float)


@pytest.fixture(scope="module")
def driers(blender, tmp_path_factory):
    """The data set, its export, and what is in the first model's file; do not change them."""
    out = tmp_path_factory.mktemp("export") / "driers"
    generate(recipe_of(), out)
    assert export(out, ["blend"]) == ()
    found = opened(blender, out / "blend" / "hair_drier_000.blend", out / "opened", index=FRAMES, picture=[1, 4], samples=32)
    return Dataset(out), found


def test_a_file_a_model(driers):
    dataset, _ = driers
    assert sorted(path.name for path in (dataset.root / "blend").glob("*.blend")) == [
        "hair_drier_000.blend",
        "hair_drier_001.blend",
    ]


def test_bpy_sees_the_same_objects_in_the_same_pixels(driers):
    dataset, _ = driers
    samples = shown(dataset, "hair_drier_000")
    for frame in FRAMES:
        truth = samples[frame - 1].channels["instances"]
        assert set(np.unique(truth)) == {0, 1, 2}
        assert (numbers(dataset.root / "opened", frame) != truth).sum() <= 5


def test_a_render_is_the_data_sets_picture(driers):
    dataset, _ = driers
    samples = shown(dataset, "hair_drier_000")
    for frame in (1, 4):
        apart = np.abs(picture(dataset.root / "opened", frame) - samples[frame - 1].channels["rgb"])
        assert apart.mean() < 3
        assert apart.mean() < np.abs(picture(dataset.root / "opened", frame) - samples[frame % 6].channels["rgb"]).mean() / 3


def test_the_camera_is_the_samples(driers):
    dataset, found = driers
    samples = shown(dataset, "hair_drier_000")
    assert found["range"] == [1, len(samples)] == [1, 6]
    for sample, matrix in zip(samples, np.array(found["cameras"]), strict=True):
        axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
        np.testing.assert_allclose(axes, sample.camera.R.T @ np.diag([1, -1, -1]), atol=1e-6)
        np.testing.assert_allclose(matrix[:3, 3], sample.camera.center, atol=1e-6)
    lens, sensor, x, y = found["lens"]
    width, height = found["size"]
    (fx, _, cx), (_, fy, cy), _ = samples[0].camera.K
    assert [width, height] == [96, 72]
    assert lens / sensor * width == pytest.approx(fx, rel=1e-6)
    assert [(0.5 - x) * width, height / 2 + y * width * fy / fx] == pytest.approx([cx, cy], abs=1e-4)


def test_the_sphere_carries_the_camera(driers):
    dataset, found = driers
    assert found["chain"] == ["camera", "viewing sphere", "target"]
    assert found["interpolations"] == ["CONSTANT"]
    samples = shown(dataset, "hair_drier_000")
    assert list(found["markers"].values()) == [f"frame {s.index} {s.pose.category}" for s in samples]
    assert found["collections"]["rig"] == ["camera", "target", "viewing sphere"]


def test_objects_say_what_they_are(driers):
    dataset, found = driers
    samples = shown(dataset, "hair_drier_000")
    labelled = {told["index"]: told for told in found["objects"].values() if told["index"]}
    assert sorted(labelled) == [1, 2]
    for o in samples[0].objects:
        told = labelled[o.id]
        assert (told["id"], told["category"], told["supercategory"], told["model"]) == (
            o.id,
            "hair drier",
            "appliance",
            o.key,
        )
        assert list(told["pose categories"].values()) == [s.objects[o.id - 1].pose_category for s in samples]
    assert found["collections"]["models"] == ["hair_drier_000", "hair_drier_001"]
    assert found["collections"]["scenery"] == ["ground"]
    assert found["lights"] == ["SUN"]
    assert found["world"]
    assert found["properties"]["frames"] == [s.index for s in samples]


def test_nothing_leads_out_of_the_file(driers):
    imagecodecs = pytest.importorskip("imagecodecs")
    dataset, found = driers
    assert found["unpacked"] == []
    for file in (dataset.root / "blend").glob("*.blend"):
        content = imagecodecs.zstd_decode(file.read_bytes())
        assert content.startswith(b"BLENDER")
        for place in {dataset.root.parent, Path.home(), Path.cwd(), Path(__file__).parents[2]} - {Path("/")}:
            assert str(place).encode() not in content
        assert f"/{getpass.getuser()}/".encode() not in content


def test_the_same_data_set_gives_the_same_scene(driers, blender, tmp_path):
    dataset, found = driers
    export(dataset.root, ["blend"], output=tmp_path, choice=Choice(("hair_drier_000",)))
    assert [path.name for path in (tmp_path / "blend").glob("*.blend")] == ["hair_drier_000.blend"]
    again = opened(blender, tmp_path / "blend" / "hair_drier_000.blend", tmp_path / "opened", index=[4])
    assert {k: v for k, v in again.items() if k != "paths"} == {k: v for k, v in found.items() if k != "paths"}
    assert np.array_equal(numbers(tmp_path / "opened", 4), numbers(dataset.root / "opened", 4))


def test_backgrounds_exposures_and_distances_change_from_frame_to_frame(blender, tmp_path):
    scene = {
        "background": {"color": {"choice": ["#c02040", "#20a060", "#3040c0"]}},
        "view": {"exposure": {"uniform": [-1, 1]}},
        "ground": False,
    }
    generate(recipe_of(scene=scene, viewpoints={"azimuth": [0, 120, 240], "distance": [0.8, 1.6]}, seed=3), tmp_path / "out")
    export(tmp_path / "out", ["blend"], output=tmp_path, choice=Choice(("*_001",), ((0, 100),)))
    samples = shown(Dataset(tmp_path / "out"), "hair_drier_001")
    behind = [tuple(np.median(s.channels["rgb"][s.channels["instances"] == 0], axis=0)) for s in samples]
    frames = [behind.index(color) + 1 for color in dict.fromkeys(behind)]
    assert len(frames) > 1
    opened(blender, tmp_path / "blend" / "hair_drier_001.blend", tmp_path / "opened", picture=frames, samples=16)
    for frame in frames:
        truth, rendered = samples[frame - 1].channels["rgb"].astype(float), picture(tmp_path / "opened", frame)
        plain = (truth == behind[frame - 1]).all(axis=-1)
        assert plain.sum() > 1000
        assert (np.abs(rendered - truth)[plain] > 2).mean() < 0.03  # shown as it is
        mask = samples[frame - 1].channels["instances"] > 0
        np.testing.assert_allclose(rendered[mask].mean(), truth[mask].mean(), rtol=0.15, atol=6)
    assert len(list((tmp_path / "blend" / "hair_drier_001").glob("*.png"))) == 6


def test_a_scene_a_file_without_sources_without_background(blender, tmp_path):
    """Suns drawn for every frame; the model's own file is gone, and the engine was Cycles."""
    import trimesh

    trimesh.creation.icosphere(1, 0.4).export(tmp_path / "ball.glb")
    sun = {"azimuth": {"uniform": [0, 360]}}
    recipe = recipe_of(
        models=[{"source": str(tmp_path / "ball.glb"), "category": "ball"}],
        scene={"draw": "per_frame", "sun": sun, "background": "transparent", "ground": False},
        viewpoints={"azimuth": [0, 90], "elevation": [30], "distance": 2.0},
        channels=["rgba", "instances"],
        engine={"name": "cycles", "quality": "draft", "samples": 1},
    )
    generate(recipe, tmp_path / "out")
    (tmp_path / "ball.glb").unlink()
    export(tmp_path / "out", ["blend"])
    files = sorted((tmp_path / "out" / "blend").glob("*.blend"))
    assert [file.name for file in files] == ["ball-000000.blend", "ball-000001.blend"]
    samples = list(Dataset(tmp_path / "out"))
    for file, sample in zip(files, samples, strict=True):
        found = opened(blender, file, tmp_path / "opened", picture=[1], index=[1])
        assert found["range"] == [1, 1]
        mask = sample.channels["instances"] > 0
        assert (numbers(tmp_path / "opened", 1) != mask).sum() <= 5
        alpha = picture(tmp_path / "opened", 1)[..., 3]
        assert (alpha[mask] > 127).mean() > 0.95 and not alpha[0].any()


def test_merged_and_unlit_data_sets(driers, blender, tmp_path):
    """A merged data set has its scenes; one that says nothing of its light still has its models and cameras."""
    dataset, _ = driers
    shutil.copytree(dataset.root, tmp_path / "copy")
    merge([dataset.root, tmp_path / "copy"], tmp_path / "both")
    merged = Dataset(tmp_path / "both")
    key, places = next(merged.shots())
    assert merged.store.shot(key) == dataset.store.shot(next(dataset.shots())[0])
    for file in (tmp_path / "both" / "store").rglob("shot.json"):
        file.unlink()
    last = len(merged) - 1
    export(merged.root, ["blend"], output=tmp_path, choice=Choice((), ((last, last + 1),)))
    (file,) = (tmp_path / "blend").glob("*.blend")
    found = opened(blender, file, tmp_path / "opened", index=[1])
    assert found["lights"] == ["SUN"]
    assert (numbers(tmp_path / "opened", 1) != merged[last].channels["instances"]).sum() <= 5
    assert math.isclose(np.linalg.norm(np.array(found["cameras"][0])[:3, 0]), 1.4, rel_tol=1e-6)
    assert len(places) == 3


MOVING = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.frame_start, scene.frame_end = 20, 40
scene.unit_settings.scale_length = 0.5
bpy.ops.mesh.primitive_plane_add(size=20)
bpy.ops.mesh.primitive_cube_add(size=1)
cube = bpy.context.object
for frame, x in ((1, -3), (40, 3)):
    cube.location = (x, 1.5, 0.5)
    cube.keyframe_insert("location", frame=frame)
light = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
light.data.energy = 2
scene.collection.objects.link(light)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])
"""


def test_a_users_own_scene_is_held_still(blender, tmp_path):
    """Its moment is another frame than the first of the poses' timeline."""
    own = tmp_path / "own.blend"
    subprocess.run([blender, "-c", MOVING, own], capture_output=True, check=True)
    recipe = recipe_of(
        models=[{"source": "zoo:chair", "category": "chair", "count": 1}],
        scene={"blend": {"file": str(own), "labels": [{"name": "Cube", "category": "crate"}]}},
        viewpoints={"azimuth": [0, 40], "elevation": [25], "distance": 5.0},
        camera={"size": [96, 72], "fov_deg": 50},
        engine={"name": "cycles", "samples": 8},
    )
    generate(recipe, tmp_path / "out")
    assert export(tmp_path / "out", ["blend"]) == ()
    (file,) = (tmp_path / "out" / "blend").glob("*.blend")
    opened(blender, file, tmp_path / "opened", index=[1, 2], picture=[1])
    samples = list(Dataset(tmp_path / "out"))
    assert {"crate", "chair"} == {o.category for o in samples[0].objects}
    for frame, sample in enumerate(samples, 1):
        truth = sample.channels["instances"]
        assert set(np.unique(truth)) == {0, 1, 2}
        assert (numbers(tmp_path / "opened", frame) != truth).sum() <= 5
    assert np.abs(picture(tmp_path / "opened", 1) - samples[0].channels["rgb"]).mean() < 6


@pytest.fixture(scope="module")
def instanced(blender, tmp_path_factory):
    """The data set of a user's scene with instances of all kinds and a library, and its exported file, moved elsewhere."""
    folder = tmp_path_factory.mktemp("instanced")
    script = Path(__file__).with_name("make_instances.py")
    done = subprocess.run([blender, script, folder], capture_output=True, text=True)
    assert (folder / "instances.blend").exists(), done.stderr[-3000:]
    names = {"Crate": "crate", "Bush": "bush", "Hedge": "bush", "Car": "car", "Body42": "car"}
    recipe = recipe_of(
        models=[{"source": "zoo:chair", "category": "chair", "count": 1}],
        scene={
            "blend": {
                "file": str(folder / "instances.blend"),
                "labels": [{"name": name, "category": category} for name, category in names.items()],
            }
        },
        viewpoints={"azimuth": [0, 40], "elevation": [25], "distance": 6.0},
        camera={"size": [160, 120], "fov_deg": 50},
        engine={"name": "cycles", "samples": 8},
    )
    generate(recipe, folder / "out")
    export(folder / "out", ["blend"])
    (file,) = (folder / "out" / "blend").glob("*.blend")
    (folder / "elsewhere").mkdir()
    return Dataset(folder / "out"), file.replace(folder / "elsewhere" / file.name)


def test_instances_have_the_numbers_of_what_they_belong_to(instanced, blender, tmp_path):
    """An `id` of the user's stays and does not count; a leaf that two bushes and the floor share is each one's own."""
    dataset, file = instanced
    found = opened(blender, file, tmp_path / "opened", index=[1, 2], picture=[1])
    samples = list(dataset)
    for frame, sample in enumerate(samples, 1):
        truth = sample.channels["instances"]
        assert set(np.unique(truth)) == {0, 1, 2, 3, 4, 5, 6}
        assert (numbers(tmp_path / "opened", frame) != truth).sum() <= 8
    assert found["objects"]["Crate"]["id"] == 77
    assert found["objects"]["Crate"]["category"] == "crate"
    assert np.abs(picture(tmp_path / "opened", 1) - samples[0].channels["rgb"]).mean() < 6


def test_an_exported_scene_needs_no_library(instanced, blender):
    _, file = instanced
    script = "import bpy, sys; bpy.ops.wm.open_mainfile(filepath=sys.argv[-1]); assert not bpy.data.libraries; print('alone')"
    assert "alone" in subprocess.run([blender, "-c", script, file], capture_output=True, text=True).stdout
