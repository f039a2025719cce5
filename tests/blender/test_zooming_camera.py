"""A camera of a .blend that moves and zooms, as one trajectory: K per instant, as Blender animates it."""

import math
import subprocess

import numpy as np
import pytest

import viewsphere as vs
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.generate import generate
from viewsphere.run.shots.stages import Stages

SCRIPT = """
import sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.frame_start, scene.frame_end = 1, 5
scene.render.resolution_x, scene.render.resolution_y = 96, 72
camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.data.sensor_fit, camera.data.sensor_width = "HORIZONTAL", 36
for frame, lens, x in ((1, 35.0, 0.0), (5, 70.0, 0.4)):
    camera.data.lens = lens
    camera.data.keyframe_insert("lens", frame=frame)
    camera.location, camera.rotation_euler = (x, -4, 0.5), (1.5707963267948966, 0, 0)
    camera.keyframe_insert("location", frame=frame)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""


@pytest.fixture(scope="module")
def scene(blender, tmp_path_factory):
    folder = tmp_path_factory.mktemp("zoom")
    subprocess.run([blender, "-c", SCRIPT, str(folder / "eye.blend")], capture_output=True, check=True)
    return folder


def recipe(folder, **more) -> Recipe:
    said = {
        "models": [{"source": "zoo:chair"}], "viewpoints": {"kind": "file", "path": "eye.blend"},
        "camera": {"of_viewpoints": True}, "time": {"frames": 9, "fps": 50}, "channels": ["depth", "instances"],
        "formats": ["native"], **more,
    }  # fmt: skip
    return Recipe.model_validate(said, context={"folder": folder})


def test_a_file_s_camera_zooms(scene, tmp_path):
    """Five frames of the file at 50 a second last four steps, so nine instants would be more than it has."""
    with pytest.raises(RecipeError, match=r"viewpoints\.path: expected poses for 0\.16 s; found 5"):
        generate(recipe(scene), tmp_path / "long")
    generate(recipe(scene, time={"frames": 5, "fps": 50}), tmp_path / "out", workers=0)
    found = vs.Dataset(tmp_path / "out")
    assert [s.instant for s in found] == list(range(5))
    for i, sample in enumerate(found):
        share = 3 * (i / 4) ** 2 - 2 * (i / 4) ** 3  # Blender's Bezier curve between two keys
        assert math.isclose(sample.camera.intrinsics.fx, 96 * (35 + 35 * share) / 36, rel_tol=1e-6)
        np.testing.assert_allclose(sample.camera.center, [0.4 * share, -4, 0.5], atol=1e-6)
    assert found[4].objects[0].area > 2 * found[0].objects[0].area
    report = check(found, sample=None)
    assert report.ok, report.findings


def test_with_a_lens_of_its_own_a_recipe_does_not_zoom(scene):
    planned = plan(recipe(scene, camera={"size": [64, 48]}, time={"frames": 5, "fps": 50}))
    shot = planned.shot(0, Stages().box)
    assert {shot.camera(i).intrinsics.fx for i in range(5)} == {shot.rig.sensors[0].intrinsics.fx}


def test_still_pictures_need_one_lens(scene):
    with pytest.raises(RecipeError, match="one camera for all frames"):
        plan(recipe(scene, time=None, viewpoints={"kind": "file", "path": "eye.blend", "frames": "all"}))
