"""All labels at once are the same, byte for byte, whichever engine paints: of stills, of sequences, and in a .blend file."""

from __future__ import annotations

import pytest

import viewsphere as vs
from viewsphere.check import check
from viewsphere.labels import LabelSpec, channel_labels, labels, on_request

CYCLES = {"name": "cycles", "samples": 1, "bounces": 1, "denoise": "off"}
RASTER = {"name": "raster", "ambient_occlusion": "off", "bounces": "off"}
TOLD = {"plan.json", "shot.json", "manifest.json", "scenery.json"}
"""Files that say which engine painted, from which files, and what pictures' digests are."""

LABELS = [
    {"name": "Car*", "category": "car"},
    {"collection": "Trees", "category": "tree"},
    {"property": "class", "category": "*"},
]


def is_still(label: LabelSpec) -> bool:
    """Return whether pictures of one camera that stand alone have the label."""
    return not any(need.SECTION for need in label.needs)


def still_recipe(engine, *, motion=None, **changed):
    box = {"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.6}, "symmetries": "found", "keypoints": 8}
    given = {
        "name": "everything",
        "models": [{"source": "zoo:car", "category": "car", "scale": {"length": 1.8}, "motion": motion}, box],
        "viewpoints": {"azimuth": [20, 60], "elevation": 15, "distance": 3.5},
        "camera": {"size": [64, 48], "fov_deg": 50},
        "scene": {"ground": True, "company": 1},
        "channels": ["rgb", *(name for name, label in channel_labels().items() if is_still(label))],
        "annotations": [name for name, label in on_request().items() if is_still(label)],
        "labels": {"voxels": {"size": [80, 48, 80], "cell": 0.06}},
        "engine": engine,
        "formats": [],
        "splits": {"by": "frame", "train": 1},
    }
    return vs.Recipe.model_validate(given | changed)


def moving_recipe(engine, **changed):
    """A stereo pair and a LiDAR that go around a car which drives and turns."""
    lidar = {"rings": 8, "elevation": [-25, 5], "azimuth": [-60, 60], "azimuth_step": 2, "sigma": 0.02, "dropout": 0.02}
    given = {
        "motion": {"kind": "constant", "velocity": [0, -0.8, 0], "spin_deg": [0, 0, 15]},
        "viewpoints": {"kind": "orbit", "azimuth": [20, 40], "elevation": [15, 20], "distance": [3.5, 3.2]},
        "time": {"frames": 3, "fps": 5},
        "tracks": {"count": 10, "on": "all", "at": [0, 2]},
        "rig": {"sensors": {"left": {}, "right": {"position": [0.1, 0, 0]}, "top": {"position": [0, -0.2, 0], "lidar": lidar}}},
        "channels": ["rgb", *(name for name in channel_labels() if name != "tracks")],
        "annotations": list(on_request()),
        "splits": {"by": "sequence"},
    }
    return still_recipe(engine, **(given | changed))


def kept(folder):
    """Contents by name of all that a data set keeps besides pictures and what says how they were made."""
    found = {path.relative_to(folder).as_posix(): path for path in (folder / "store").rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if path.name not in TOLD and "/rgb/" not in name}


def assert_same_labels(recipes, folder):
    """That two recipes, which differ in their engines, make the same of all labels that they name, and different pictures."""
    first, second = (folder / "first", folder / "second")
    for recipe, out in zip(recipes, (first, second), strict=True):
        vs.generate(recipe, out)
    ours, theirs = kept(first), kept(second)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
    dataset = vs.open(first)
    asked = {*recipes[0].channels, *recipes[0].annotations} & labels().keys()
    assert asked <= {name for name, label in labels().items() for sample in dataset if label.is_in(sample)}
    assert any((a.rgb != b.rgb).any() for a, b in zip(dataset, vs.open(second), strict=True) if "rgb" in a.files)
    assert all(any(o.visibility > 0 for o in sample.objects) for sample in dataset)


@pytest.mark.parametrize("recipe", [still_recipe, moving_recipe])
def test_all_labels_are_the_same_on_raster_and_in_cycles(blender, tmp_path, recipe):
    assert_same_labels((recipe(RASTER), recipe(CYCLES)), tmp_path)


def heap_recipe(engine):
    """Mugs and books that fell on the table of a room."""
    return still_recipe(
        engine,
        models=[{"source": ["zoo:mug", "zoo:book"], "count": 2, "symmetries": "found", "keypoints": 8}],
        scenes={"count": 1, "objects": 4, "repeat": True, "layout": "fall"},
        viewpoints={"kind": "sphere", "count": 2, "elevation": [35, 60], "distance": [0.7, 0.9]},
        min_visibility=0.3,
        scene={"place": "zoo:table_top"},
    )


@pytest.mark.slow
def test_all_labels_of_things_that_fell_in_a_room_are_the_same_on_raster_and_in_cycles(blender, tmp_path):
    pytest.importorskip("mujoco")
    assert_same_labels((heap_recipe(RASTER), heap_recipe(CYCLES)), tmp_path)


@pytest.mark.parametrize("recipe", [still_recipe, moving_recipe])
def test_labels_in_a_blend_file_are_those_of_its_meshes_on_raster(made, tmp_path, recipe):
    """The file as Cycles opens it, and its meshes alone as a place on raster."""
    file = str(made / "street.blend")
    ours = recipe(RASTER, scene={"place": file, "ground": "off"})
    assert_same_labels((ours, recipe(CYCLES, scene={"blend": file})), tmp_path)


def test_labels_of_a_blend_file_s_own_objects_are_made_again_without_blender(made, tmp_path):
    """What the file's rules label, with variants: truth makes the same labels of the exported models."""
    blend = {"file": str(made / "street.blend"), "at": "Spot", "labels": LABELS, "variants": {"planes": "plane*"}}
    recipe = still_recipe(CYCLES, scene={"blend": blend})
    vs.generate(recipe, tmp_path)
    dataset = vs.open(tmp_path)
    report = check(dataset, sample=None)
    assert report.ok, report.findings
    assert {report.checked[name] for name in (*channel_labels().keys() & {*recipe.channels}, *recipe.annotations)} == {4}
    assert {o.category for sample in dataset for o in sample.objects} == {"car", "post box", "tree", "aerial"}
