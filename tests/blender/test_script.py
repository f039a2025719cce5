"""Users' own scripts: run only where they are allowed, given what they need, and part of what a data set is."""

from __future__ import annotations

import os

import numpy as np
import pytest

from command_line import viewsphere
from viewsphere import Recipe, generate, plan, render
from viewsphere.blender.interpreter import SCRIPTS
from viewsphere.errors import RecipeError, UserError

RED = """
def shade(scene, objects, shot):
    for one, told in objects.items():
        if told["category"] == "chair" and told["id"] == 1:
            for material in one.data.materials:
                shader = material.node_tree.nodes.new("ShaderNodeEmission")
                shader.inputs["Color"].default_value = (1, 0, 0, 1)
                out = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
                material.node_tree.links.new(shader.outputs[0], out.inputs["Surface"])
"""
OF = "import bpy\n\ndef shade(scene, objects, shot):\n    one, told = next(iter(objects.items()))\n    "
"""How a script of one line about the first object begins."""

LABELLED = {
    "moved": "one.location.x += 1",
    "carried by the camera": "one.parent = scene.camera",
    "reshaped": "one.data.vertices[0].co.x += 0.5",
    "with other triangles": "one.data.flip_normals()",
    "modified": "one.modifiers.new('thick', 'SOLIDIFY').thickness = 0.1",
    "hidden": "one.hide_render = True",
    "not seen by cameras": "one.visible_camera = False",
    "a holdout": "one.is_holdout = True",
    "a catcher": "one.is_shadow_catcher = True",
    "of another number": "one.pass_index = 7",
    "unknown": "del one['viewsphere order']",
    "left out": "bpy.data.objects.remove(one)",
    "excluded": "scene.collection.objects.unlink(one)",
    "added": "scene.collection.objects.link(bpy.data.objects.new('more', one.data))",
    "displaced": (
        "m = one.data.materials[0]; m.displacement_method = 'DISPLACEMENT'; t = m.node_tree; "
        "t.links.new(t.nodes.new('ShaderNodeDisplacement').outputs[0], "
        "next(n for n in t.nodes if n.type == 'OUTPUT_MATERIAL').inputs['Displacement'])"
    ),
    "another lens": "scene.camera.data.type = 'PANO'",
}
"""Lines that change what labels depend on, by what is changed then."""

LOOKS = {
    "materials": "one.data.materials.clear()",
    "lights": (
        "lamp = bpy.data.objects.new('lamp', bpy.data.lights.new('lamp', 'POINT')); lamp.data.energy = 500; "
        "lamp.location = (0, -2, 2); scene.collection.objects.link(lamp)"
    ),
    "the world": "scene.world.node_tree.nodes.clear()",
    "shadows": "one.visible_diffuse = False",
}
"""Lines that change how things look."""


@pytest.fixture
def recipe(tmp_path, monkeypatch):
    """A recipe with a script of this text, in whose folder the script lies."""
    monkeypatch.setenv(SCRIPTS, "0")

    def made(text=RED):
        (tmp_path / "mine.py").write_text(text)
        told = {
            "name": "mine",
            "models": [{"source": "zoo:chair", "count": 1}],
            "viewpoints": {"azimuth": [30], "elevation": [20], "distance": 2.0},
            "camera": {"size": [64, 48], "fov_deg": 45},
            "scene": {"ground": "off", "background": {"color": [0, 0, 0]}},
            "engine": {"name": "cycles", "samples": 4, "denoise": "off", "script": "mine.py"},
            "channels": ["rgb", "instances"],
            "formats": [],
            "splits": {"train": 1.0},
        }
        (tmp_path / "recipe.yaml").write_text(Recipe(**told).to_yaml())
        return Recipe.load(tmp_path / "recipe.yaml")

    return made


@pytest.mark.usefixtures("blender")
def test_a_script_paints_what_it_is_given(recipe, monkeypatch):
    monkeypatch.setenv(SCRIPTS, "1")
    channels = next(iter(render(recipe()))).channels
    seen = channels["rgb"][channels["instances"] == 1]
    assert (seen[:, 0] > 2 * seen[:, 1:].max(axis=1).astype(int)).mean() > 0.9


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("line", LABELLED.values(), ids=LABELLED)
def test_a_script_that_changes_what_labels_depend_on_is_refused(recipe, monkeypatch, line):
    monkeypatch.setenv(SCRIPTS, "1")
    with pytest.raises(
        UserError, match=r"mine.py: expected objects that stand where they stood.* (changed|gone|added): change"
    ):
        list(render(recipe(OF + line)))


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("line", LOOKS.values(), ids=LOOKS)
def test_a_script_may_change_looks(recipe, monkeypatch, line):
    monkeypatch.setenv(SCRIPTS, "1")
    changed, plain = (next(iter(render(recipe(OF + text)))).channels for text in (line, "pass"))
    assert not np.array_equal(changed["rgb"], plain["rgb"])
    assert np.array_equal(changed["instances"], plain["instances"])


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def shade(scene, objects, shot):\n    nothing()\n", ["mine.py, line 2: NameError"]),
        ("import sys\n\ndef shade(scene, objects, shot):\n    sys.exit('enough')\n", ["mine.py, line 4: SystemExit: enough"]),
        ("def shade(scene, objects, shot):\n    raise KeyboardInterrupt\n", ["mine.py, line 2: KeyboardInterrupt"]),
        ("x = 1\n", ["expected a function shade(scene, objects, shot)"]),
    ],
)
def test_a_script_that_fails_is_one_line(recipe, monkeypatch, text, words):
    monkeypatch.setenv(SCRIPTS, "1")
    with pytest.raises(UserError) as caught:
        list(render(recipe(text)))
    assert "\n" not in str(caught.value)
    assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.parametrize("run", [generate, lambda made, _: list(render(made))])
def test_a_script_that_nobody_allowed_does_not_run(recipe, tmp_path, run):
    with pytest.raises(
        RecipeError, match=r"engine.script: expected --allow-scripts .*VIEWSPHERE_ALLOW_SCRIPTS=1.*found neither"
    ):
        run(recipe("open('ran', 'w')"), tmp_path / "out")
    assert not (tmp_path / "ran").exists()


def test_the_command_line_allows_it(recipe, tmp_path):
    """By its option alone; a script that is not there is told before Blender is asked."""
    recipe()
    command = ["render", tmp_path / "recipe.yaml", "-o", tmp_path / "out", "--workers", 0]
    refused = viewsphere(*command)
    assert refused.returncode == 2
    assert "expected --allow-scripts" in refused.stderr.splitlines()[-1]
    assert os.environ[SCRIPTS] == "0"
    (tmp_path / "mine.py").unlink()
    missing = viewsphere(*command, "--allow-scripts")
    assert "expected a Python file; found none at" in missing.stderr.splitlines()[-1]
    assert os.environ[SCRIPTS] == "1"


def test_a_changed_script_makes_another_data_set(recipe):
    first, same, other = plan(recipe()).digest, plan(recipe()).digest, plan(recipe(RED + "# now different")).digest
    assert first == same != other
