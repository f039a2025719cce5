"""Users' own .blend files as scenes: what is rendered is what is labelled, and the file stays what it is."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere import Dataset, Recipe, generate, plan, render
from viewsphere.assets.cache import load_normalised
from viewsphere.blender.interpreter import SCRIPTS
from viewsphere.check import check
from viewsphere.engines import cycles
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.staging import camera_request
from viewsphere.errors import RecipeError, UserError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.rendering.view import develop
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import rasterize

pytestmark = [pytest.mark.usefixtures("blender", "blenders")]

LABELS = [
    {"name": "Car*", "category": "car"},
    {"collection": "Trees", "category": "tree"},
    {"property": "class", "category": "*"},
]
IN_TURN = {"planes": {"one_of": "plane*", "order": "in_turn"}}
ENGINE = {"name": "cycles", "samples": 1, "bounces": 1, "denoise": "off"}
SHARP = {"pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
INDEX = {"car": 11, "tree": 12, "aerial": 13}
"""Object index of each category in the files."""


def recipe_of(file, engine=ENGINE, **changed):
    blend = {"file": str(file)} | changed.pop("blend", {})
    given = {
        "name": "in a scene",
        "models": [{"source": "zoo:chair", "count": 1}],
        "viewpoints": {"azimuth": [0, 40, 310], "elevation": [20], "distance": 6.0},
        "camera": {"size": [96, 72], "fov_deg": 45},
        "scene": {"blend": blend} | changed.pop("scene", {}),
        "engine": engine,
        "channels": ["rgb", "instances", "depth"],
        "formats": [],
    }
    return Recipe(**(given | changed))


def street(made, name="street", **changed):
    blend = {"at": "Spot", "labels": LABELS, "variants": IN_TURN} | changed.pop("blend", {})
    return recipe_of(made / f"{name}.blend", blend=blend, **changed)


def refusal(recipe):
    with pytest.raises(RecipeError) as caught:
        plan(recipe)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_objects_are_labelled_as_the_rules_say(made):
    planned = plan(street(made))
    own = {spec.category: set(spec.parts.only) for spec in planned.kept_specs if spec.parts}
    assert own == {"car": {"Car.001", "Cabin"}, "aerial": {"Aerial"}, "tree": {"Oak"}}
    assert [c.name for c in planned.categories] == ["chair", "aerial", "car", "tree"]
    assert planned.max_objects == 4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["street", "feet"])
def test_labels_are_what_cycles_sees(made, name):
    recipe = street(made, name, engine=ENGINE | {"settings": SHARP}, camera={"size": [320, 240], "fov_deg": 45})
    assert met_by_cycles(recipe) == {0, 1, 11, 12, 13}


@pytest.mark.slow
def test_labelled_objects_move(made):
    """What drives is where Cycles sees it at each time step; its pose says how far it drove and turned."""
    blend = {"labels": [{"name": "Car", "category": "car"}, {"name": "Post", "category": "tree"}], "frames": [1, 11, 21]}
    recipe = recipe_of(
        made / "moving.blend", engine=ENGINE | {"settings": SHARP}, blend=blend, viewpoints={"azimuth": [0], "distance": 7}
    )
    assert met_by_cycles(recipe) == {0, 1, 11, 12}
    stages = Stages()
    shots = list(plan(recipe).shots(stages.box))
    cars = [p for shot in shots for p in shot.objects if p.model.category == "car"]
    places = np.array([p.world_from_object for p in cars])
    assert np.allclose(places[:, :3, 3], [[-2, 2, 0], [0, 2, 0], [2, 2, 0]], atol=1e-5)
    assert np.allclose(np.degrees(np.arctan2(places[:, 1, 0], places[:, 0, 0])), [0, 45, 90], atol=1e-4)
    for car in cars:
        assert np.allclose(np.ptp(stages.box(car.model, car.step), axis=0), [1, 2, 1.3], atol=1e-5)
        assert car.id == cars[0].id


@pytest.mark.parametrize("name", ["street", "feet", "moving", "grown"])
def test_a_script_may_change_the_looks_of_a_files_own_objects_alone(made, tmp_path, monkeypatch, name):
    monkeypatch.setenv(SCRIPTS, "1")

    def pictured(line):
        script = tmp_path / "mine.py"
        solid = "solid = [one for one in scene.objects if one.type == 'MESH']"
        script.write_text(f"def shade(scene, objects, shot):\n    {solid}\n    {line}\n")
        recipe = recipe_of(made / f"{name}.blend", ENGINE | {"script": str(script)}, viewpoints={"azimuth": [0], "distance": 7})
        return next(iter(render(recipe))).channels["rgb"]

    lights = (
        "import bpy; sun = bpy.data.lights.new('sun', 'SUN'); scene.collection.objects.link(bpy.data.objects.new('sun', sun))"
    )
    assert not np.array_equal(pictured(lights), pictured("pass"))
    with pytest.raises(UserError, match=r"expected objects that stand where they stood.* '.*' changed"):
        pictured("[setattr(one, 'scale', (2, 2, 2)) for one in solid]")


@pytest.mark.parametrize("name", ["appearing", "linking"])
def test_what_appears_and_vanishes_is_labelled_while_it_is_there(made, name):
    """Whichever of a group is shown, the animation of the file or its library does not hide it; what has a slash in its name
    is no instance.
    """
    labels = [{"name": n, "category": c} for n, c in (("Oak", "tree"), ("plane*", "aerial"), ("Late", "car"), ("Early", "car"))]
    blend = {"labels": labels, "frames": [1, 4, 9], "variants": IN_TURN}
    recipe = recipe_of(
        made / f"{name}.blend", engine=ENGINE | {"settings": SHARP}, blend=blend, viewpoints={"azimuth": [0], "distance": 7}
    )
    assert met_by_cycles(recipe) == {0, 1, 11, 12, 13}
    planned = plan(recipe)
    for shot, (late, plane) in zip(planned.shots(Stages().box), ((0, 0), (0, 1), (1, 0)), strict=True):
        assert [p.id for p in shot.objects] == [1, 2, 3, 4]
        names = {name for p in shot.objects if p.model.parts for name in p.model.parts.only}
        assert names == {"Oak", f"plane{plane}", "Late" if late else "Early"}
        assert {p.model.key for p in shot.objects if p.model.parts} <= {spec.key for spec in planned.kept_specs}
        assert all(p.key == f"{p.model.key}-f{p.step.frame:04d}" for p in shot.objects if p.model.parts)


def met_by_cycles(recipe):
    """Ids of what is seen, where Cycles' own pass of object indices agrees, looked at through the pixels' middles."""
    stages, met = Stages(), set()
    for shot in plan(recipe).shots(stages.box):
        stage = cycles.stage(shot, stages.model).arrangement(0)
        camera = shot.camera(0)
        truth = rasterize(stage.geometry, camera).triangle
        process = stage.keeper.process_for(stage)
        out = process.folder / "asked.npy"
        told = FileFrame.from_blend(shot.scene.blend).camera(camera_request(camera))
        process.ask("render", camera=told, transparent=False, border=None, passes=["index"], out=str(out))
        seen = np.load(out.with_suffix(".index.npy"))[..., 0].astype(int)
        index = {p.id: INDEX.get(p.model.category, p.id) for p in shot.objects}
        ids = np.where(truth < 0, 0, stage.geometry.triangle_object[truth])
        expected = np.vectorize(lambda i, index=index: index.get(i, 0))(ids)
        assert (expected != seen).sum() <= 5
        met |= set(np.unique(expected).tolist())
    return met


@pytest.mark.slow
def test_places_turns_and_units_of_a_file_do_not_matter(made):
    """The same street in feet, elsewhere and turned, gives the same pictures and labels around its spot."""
    engine = ENGINE | {"samples": 16}
    lamps = [{"kind": "point", "at": {"azimuth": 20, "elevation": 40, "distance": 2}, "strength": 4}]
    pairs = zip(
        render(street(made, engine=engine, scene={"lights": lamps})),
        render(street(made, "feet", engine=engine, scene={"lights": lamps})),
        strict=True,
    )
    for metres, feet in pairs:
        assert (metres.channels["instances"] != feet.channels["instances"]).sum() <= 2
        depths = metres.channels["depth"], feet.channels["depth"]
        near = np.isfinite(depths).all(axis=0)
        assert np.percentile(np.abs(depths[0][near] - depths[1][near]), 99) < 1e-3
        a, b = (s.channels["rgb"].astype(float) for s in (metres, feet))
        assert abs(a.mean() - b.mean()) < 1
        assert np.percentile(np.abs(a - b), 90) < 12  # noise
        for one, other in zip(metres.objects, feet.objects, strict=True):
            assert np.allclose(one.box3d_camera, other.box3d_camera, atol=1e-4)


def test_objects_have_the_axes_of_the_files(made):
    """A car that is turned by 30 degrees has a box that is turned likewise: as wide and long as the car."""
    recipe = street(made)
    stages = Stages()
    shot = plan(recipe).shot(0, stages.box)
    car = next(p for p in shot.objects if p.model.category == "car")
    box = stages.box(car.model)
    assert np.allclose(np.ptp(box, axis=0), [1, 2, 1.3], atol=1e-5)
    spot = np.array(shot.scene.blend.world_from_file)
    turn = spot[:3, :3].T @ np.array(car.world_from_object)[:3, :3]
    assert np.degrees(np.arctan2(turn[1, 0], turn[0, 0])) == pytest.approx(30, abs=1e-3)


def test_variants_take_turns_with_what_is_parented_to_them(made):
    samples = render(street(made, viewpoints={"azimuth": [0, 1, 2, 3], "distance": 6}))
    middles = [s.channels["rgb"][10:40, 35:65].astype(int) for s in samples]
    assert [int(np.argmax(coloured(m))) for m in middles] == [0, 1, 2, 0]


def coloured(picture):
    """Pixels whose red, green or blue is more than twice the others."""
    return [(picture[..., i] > 2 * np.delete(picture, i, axis=2).max(axis=2)).sum() for i in range(3)]


def test_variants_are_drawn_by_names_alone(made):
    few, more = hidden(made, 20), hidden(made, 5)
    assert {azimuth: more[azimuth] for azimuth in few} == few
    assert len(set(more.values())) == 3
    assert {len(group) for group in more.values()} == {4}  # two planes and their frames


def hidden(made, step):
    """What is not shown, by the camera's azimuth."""
    recipe = street(
        made, blend={"variants": {"planes": "plane*"}}, viewpoints={"azimuth": list(range(0, 60, step)), "distance": 6}
    )
    shots = plan(recipe).shots(Stages().box)
    return {frame.viewpoint.azimuth_deg: shot.scene.blend.hidden for shot in shots for frame in shot.instants}


def test_depth_sees_the_variant_that_is_shown_and_no_other(made):
    """Where planes stand one behind another, only the one that is shown has depth."""
    samples = list(render(street(made, viewpoints={"azimuth": [0, 1, 2], "distance": 6})))
    middles = [s.channels["depth"][24, 48] for s in samples]
    assert np.ptp(middles) < 0.1
    recipe = street(made, blend={"variants": {}}, viewpoints={"azimuth": [0], "distance": 6})
    assert next(iter(render(recipe))).channels["depth"][24, 48] == pytest.approx(middles[0], abs=0.05)


def test_the_compositor_acts_on_colours_alone_and_writes_nothing(made):
    plain = list(render(recipe_of(made / "no_output.blend")))
    for composed, without in zip(render(recipe_of(made / "composed.blend")), plain, strict=True):
        assert composed.channels["rgb"][..., 1:].max() == 0
        assert composed.channels["rgb"][..., 0].std() > 5
        for name in ("instances", "depth"):
            assert composed.channels[name].tobytes() == without.channels[name].tobytes()
        red, grey = (np.asarray(s.channels["rgb"][..., 0], float) for s in (composed, without))
        assert np.abs(red - grey).max() <= 1
    assert not (made / "written").exists()


@pytest.mark.parametrize("name", ["none", "flat", "muted"])
def test_a_compositor_without_layers_is_left_out(made, name):
    one, plain = (recipe_of(made / f"{file}.blend", viewpoints={"distance": 6}) for file in (f"layers_{name}", "no_output"))
    assert np.array_equal(*(next(iter(render(recipe))).channels["rgb"] for recipe in (one, plain)))
    said = [line for line in plan(one).warnings if "compositor" in line]
    assert [line[: line.index(" (")] for line in said] == (
        [] if name == "none" else [f"scene.blend: layers_{name}.blend: the compositor has no render layers"]
    )


def test_warnings_of_a_file_name_the_file(made, tmp_path):
    """Not one of the models that are parts of it; only what a model alone is warned of carries its key."""
    labels = [{"name": "Floor", "category": "floor"}, {"name": "Far", "category": "box"}]
    recipe = recipe_of(
        made / "apart" / "foreign.blend", blend={"labels": labels, "confined": False}, viewpoints={"distance": 6}
    )
    warnings = generate(recipe, tmp_path / "out").warnings
    assert list(warnings.files) == ["foreign.blend"] and warnings.models == {}
    said = warnings.files["foreign.blend"]
    assert len(said) == len(set(said)) > 0


def test_the_compositor_has_the_passes_that_it_asks_for(made):
    """Here the distance: what is farther is brighter, whatever it is."""
    scene = {"view": {"exposure": -5}}
    recipe = recipe_of(made / "foggy.blend", engine=ENGINE | {"settings": SHARP}, scene=scene, viewpoints={"distance": 6})
    channels = next(iter(render(recipe))).channels
    near = np.isfinite(channels["depth"]) & (channels["depth"] < 15)
    red = channels["rgb"][near, 0].astype(int)[np.argsort(channels["depth"][near])]
    assert np.ptp(red) > 30
    assert (red >= np.maximum.accumulate(red) - 1).all()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no_output", "compositor has no output"),
        ("dark", "no light and no world"),
        ("scripted", "scripts that would run on opening do not run: 'startup.py'"),
        ("scripted", "drivers with Python do not run: 'Moving: location'"),
    ],
)
def test_what_the_file_lacks_is_said(made, name, said):
    assert any(said in line for line in plan(recipe_of(made / f"{name}.blend")).warnings)


def test_hair_of_particles_and_displacement_are_said(made):
    """Of what a render shows: they are in pictures and in no label."""
    said = [line for line in plan(recipe_of(made / "grown.blend")).warnings if "no label knows" in line]
    assert [line.partition(";")[0] for line in said] == [
        "scene.blend: grown.blend: particle hair is rendered, but no label knows of it: 'Bush'",
        "scene.blend: grown.blend: displacement by materials is rendered, but no label knows of it: 'displacement'",
    ]


def test_what_needs_others_is_said(made):
    """Add-ons, and files outside of the scene's folder, which are read only with consent."""
    bound, free = (
        "\n".join(plan(recipe_of(made / "apart" / "foreign.blend", blend={"confined": confined})).warnings)
        for confined in (True, False)
    )
    for said in (bound, free):
        assert "needs add-ons, which are not loaded, for the nodes 'Stranger'" in said
        assert "hair is rendered, but no label knows of it: 'Hair'" in said
    for what in ("library.blend' is outside", "picture 'paint.png' is outside"):
        assert what in bound
        assert what not in free


@pytest.mark.slow
def test_libraries_outside_are_rendered_with_consent_alone(made):
    def depth(confined):
        recipe = recipe_of(made / "apart" / "foreign.blend", blend={"confined": confined}, viewpoints={"distance": 6})
        return np.minimum(next(iter(render(recipe))).channels["depth"], 100)

    assert (depth(confined=True) - depth(confined=False)).max() > 0.3


def test_a_model_that_needs_add_ons_says_so(made):
    mesh = load_normalised(
        ModelSpec(key="m", source=str(made / "apart" / "foreign.blend"), category="c", category_id=1), folder=made / "cache"
    )
    assert any("needs add-ons" in warning for warning in mesh.warnings)


@pytest.mark.parametrize(("part", "height"), [("", 2.0), ("/Collection/Trees", 2.0), ("/Object/Car.001", 1.9)])
def test_a_place_may_be_a_part_of_a_file(made, part, height):
    """By the raster engine, which takes the meshes alone."""
    scene = {"place": f"{made}/street.blend{part}", "ground": "off"}
    recipe = Recipe(**(recipe_of("none").model_dump() | {"scene": scene, "engine": "raster", "channels": ["depth"]}))
    stages = Stages()
    shot = plan(recipe).shot(0, stages.box)
    (placed,) = [p for p in shot.things if p.scenery]
    assert stages.box(placed.model)[:, 2].max() == pytest.approx(height, abs=1e-5)
    assert len(list(render(recipe))) == 3


def test_a_place_in_a_file_that_is_not_there_is_one_line(made):
    for source, words in (
        (f"{made}/street.blend/Mesh/Car", "street.blend/Object/NAME"),
        ("none.blend/Object/Car", "found none at"),
    ):
        recipe = Recipe(**(recipe_of("none").model_dump() | {"scene": {"place": source}, "engine": "raster"}))
        assert words in refusal(recipe)


def test_a_scene_without_light_is_lit(made):
    assert next(iter(render(recipe_of(made / "dark.blend")))).channels["rgb"].mean() > 60


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"blend": {"at": "Spott"}}, ["scene.blend.at", "'Spott'", "did you mean 'Spot'"]),
        ({"blend": {"labels": [{"name": "Bus*", "category": "bus"}]}}, ["labels[0].name", "'Bus*', which fits none"]),
        ({"blend": {"labels": [{"collection": "Bush*", "category": "b"}]}}, ["labels[0].collection", "Trees"]),
        ({"blend": {"labels": [{"property": "kind", "category": "*"}]}}, ["labels[0].property", "class"]),
        ({"blend": {"variants": {"walls": "walls*"}}}, ["scene.blend.variants.walls", "fits none"]),
        ({"blend": {"file": "nowhere.blend"}}, ["scene.blend.file", "found none at"]),
        ({"engine": {"name": "raster"}}, ["scene.blend", "expected engine: cycles", "scene.place"]),
    ],
)
def test_mistakes_are_one_line(made, changed, words):
    said = refusal(street(made, **changed))
    assert all(word in said for word in words), said


def test_files_that_are_none_are_one_line(made, tmp_path):
    (tmp_path / "cut.blend").write_bytes((made / "street.blend").read_bytes()[:5000])
    (tmp_path / "text.blend").write_text("hello")
    for name in ("cut", "text"):
        said = refusal(recipe_of(tmp_path / f"{name}.blend"))
        assert f"{name}.blend" in said


@pytest.mark.slow
def test_data_sets_are_made_resumed_checked_and_the_same_whatever_the_workers(made, tmp_path):
    recipe = street(made, formats=["coco", "native"], camera={"size": [48, 36], "fov_deg": 45})
    generate(recipe, tmp_path / "one", workers=0)
    assert check(Dataset(tmp_path / "one")).ok
    again = generate(recipe, tmp_path / "one", workers=0)
    assert again.rendered == 0
    generate(recipe, tmp_path / "two", workers=2)
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(tmp_path / "two") for p in (tmp_path / "two").rglob("*") if p.is_file())
    for file in files:
        if "log" not in file.name:
            assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file


@pytest.mark.slow
def test_the_light_of_a_file_comes_in_parts(made):
    """The sky, lamps and materials are the file's own; composed its light is the picture, within a byte's rounding."""
    names = ["rgb", "albedo", "shading", "residual", "emission"]
    engine = ENGINE | {"samples": 8}
    sample = next(iter(render(street(made, engine=engine, channels=names, viewpoints={"azimuth": [0], "distance": 7}))))
    light = np.dstack([sample.albedo * sample.shading + sample.residual, np.ones((72, 96), np.float32)])
    composed = develop(light, None, sample.origin.shot.finish(0).view)
    assert np.abs(composed.astype(int) - sample.rgb).max() <= 1
    assert sample.albedo.max() > 0.5
    assert (sample.albedo * sample.shading).max() > 0.05


@pytest.mark.parametrize("name", ["roughness", "metallic"])
def test_what_a_file_s_materials_are_made_of_is_not_known(made, name):
    assert refusal(street(made, channels=["rgb", name])).startswith(f"channels[1]: expected no {name} with scene.blend")
