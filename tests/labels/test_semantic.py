"""semantic against what stands where, by every lens; names, colours and files; its proof notices other classes."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from cube_dataset import make
from label_scenes import changed, embree, proof, random_sample, rows_of
from proven import told
from quick import quick
from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.codecs.palette import palette
from viewsphere.geometry.rotation import rigid
from viewsphere.labels import channels, observe
from viewsphere.labels.semantic import LABEL
from viewsphere.model.annotations.classes import (
    FIRST_THING,
    GROUND,
    SCENERY,
    SKY,
    STUFF,
    STUFF_IDS,
    class_colors,
    classes_of,
)
from viewsphere.model.fields.files import Files
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Motion, Thing
from viewsphere.store import Dataset, encode
from viewsphere.store.samples.channel_files import decode
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize
from viewsphere_zoo import build_zoo_model, family, family_names

NAMES = ("depth", "instances", "categories", "semantic")


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(3))
def test_things_ground_scenery_and_sky(name, seed):
    sample, geometry, visibility = random_sample(seed, name, NAMES)
    things = sample.instances > 0
    assert (sample.semantic[things] == sample.categories[things] + 31).all()
    assert (sample.semantic[visibility.triangle < 0] == SKY).all()
    ground = visibility.triangle >= geometry.triangle_start[-1]
    assert (sample.semantic[ground] == GROUND).all()
    rest = (visibility.triangle >= 0) & ~ground & ~things
    assert (sample.semantic[rest] == SCENERY).all() and rest.any()


@pytest.mark.parametrize("name", EVERY)
def test_embree_meets_things_of_these_classes(name):
    pytest.importorskip("embreex")
    sample, geometry, _ = random_sample(3, name, NAMES, ground=False)
    triangle, _ = embree(geometry, sample.camera)
    expected = np.where(triangle < 0, SKY, SCENERY)
    for o in sample.objects:
        own = (triangle >= geometry.triangle_start[o.id - 1]) & (triangle < geometry.triangle_start[o.id])
        expected[own] = 31 + o.category_id
    assert (expected == sample.semantic).mean() > 0.99
    told("semantic", "Embree's rays, a share of all pixels", (expected != sample.semantic).mean())


def piece(category, meshes_parts, x=0.0):
    mesh = mesh_of(cube(0.5).vertices, cube(0.5).triangles, parts=np.repeat(np.arange(6), 2))
    return mesh.__class__(**{**mesh.__dict__, "parts": meshes_parts}), Thing(
        id=0,
        model=ModelSpec(key=category or "file", source="m", category=category, category_id=0),
        motion=Motion.still(rows_of(rigid(np.eye(3), (x, 0, 0)))),
        scenery=True,
    )


def test_parts_of_scenery_are_what_they_are_called():
    """The camera sees the face of -Y, the third part: by its name in a file, by its place in the zoo's street."""
    pieces = [
        piece("", ("a", "b", "Scene/Road_Marking.004", "c", "d", "e"), -3.0),
        piece("street", ("road", "lawn", "kerb", "zebra", "e", "f"), 0.0),
        piece("post_box", ("a", "b", "c", "d", "e", "f"), 3.0),
    ]
    geometry = build_geometry([thing for _, thing in pieces], [mesh for mesh, _ in pieces], False, 0.01)
    camera = orbit_camera(lens(96, 32, 1.5), 0, 0, 6.0)
    found = observe(geometry, camera, rasterize(geometry, camera), ["semantic", "categories", "instances", "parts"])
    middle = found["semantic"][16, [20, 48, 76]]
    assert middle.tolist() == [STUFF_IDS[n] for n in ("road marking", "pavement", "street furniture")]
    assert not any(found[n].any() for n in ("categories", "instances", "parts"))


@pytest.mark.parametrize(
    ("category", "part", "stuff"),
    [("", "Road.001", "road"), ("", "Scene/grass", "grass"), ("Building", "x", "building"), ("", "railroad", "scenery"),
     ("house", "gutter", "building"), ("street", "gutter", "pavement"), ("landscape", "hill", "grass"), ("", "", "scenery")],
)  # fmt: skip
def test_names(category, part, stuff):
    assert stuff_of(category, [part]) == [STUFF_IDS[stuff]]


@pytest.mark.parametrize(
    "name", quick([name for name in family_names() if family(name).classes.keys() > {""}], "road_sign", "traffic_light")
)
def test_the_zoo_has_the_parts_that_are_named(name):
    wanted, seed = family(name).classes.keys() - {""}, 0
    while wanted and seed < 8:  # not every member has every part
        spec = ModelSpec(key="m", source=f"zoo:{name}", seed=seed, category="m", category_id=1)
        wanted, seed = wanted - set(build_zoo_model(spec).parts), seed + 1
    assert not wanted


def test_every_family_of_the_zoo_has_a_class():
    assert [name for name in family_names() if family(name).classes == {"": "scenery"}] == []


@pytest.mark.parametrize("category", ["lamp_post", "lamp post"])
def test_a_family_s_name_is_one_with_and_without_underscore(category):
    assert stuff_of(category, [""]) == [STUFF_IDS["pole"]]


def test_ids_of_stuff_stay_what_they_are_and_leave_room_for_things():
    assert list(STUFF)[:5] == ["sky", "ground", "scenery", "road", "road marking"]
    assert len(STUFF) < FIRST_THING == 32
    assert len(set(STUFF.values())) == len(STUFF)


@pytest.mark.parametrize("name", EVERY)
def test_its_proof_notices_other_classes(name):
    sample, *_ = random_sample(1, name, NAMES)
    assert proof(LABEL, sample) == []
    thing, background = (tuple(np.argwhere(mask)[3]) for mask in (sample.instances > 0, sample.instances == 0))
    for change in (
        lambda a: a.__setitem__(thing, a[thing] + 1),
        lambda a: a.__setitem__(thing, GROUND),
        lambda a: a.__setitem__(background, 0),
        lambda a: a.__setitem__(background, SKY),
        lambda a: a.__setitem__(background, len(STUFF) + 1),
        lambda a: a.__setitem__(background, FIRST_THING),
    ):
        assert proof(LABEL, changed(sample, "semantic", change))


def test_other_ids_of_categories_change_things_alone():
    array = np.array([[1, 13, 32, 33, 40]], np.int32)
    assert LABEL.ids["category"](array, {1: 2, 2: 1, 9: 9}).tolist() == [[1, 13, 33, 32, 40]]


def test_things_have_the_colours_of_their_categories():
    assert class_colors()[32:].tolist() == palette()[1:225].tolist()
    assert class_colors(300)[32 + 255].tolist() == palette()[1].tolist() and len(class_colors(5)) == 5


def test_a_file_with_a_palette_has_the_colours_of_the_classes():
    array = np.array([[SKY, 4, 32, 33, 255]], np.int32)
    data = encode(channels()["semantic"], array, Files(masks="png8"))
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    known = {c.id: c.color for c in classes_of([(1, "car"), (2, "chair")])}
    assert [tuple(color) for color in picture[0, :4].tolist()] == [known[i] for i in (SKY, 4, 32, 33)]
    assert np.array_equal(decode(channels()["semantic"], "x.png", lambda: data), array)


def test_the_data_set_says_what_classes_mean(tmp_path):
    dataset = make(tmp_path / "a", channels=("rgb", "instances", "semantic"))
    named = {c.id: (c.name, c.is_thing) for c in dataset.classes}
    assert named[SKY] == ("sky", False) and named[34] == ("car", True) and len(named) == len(STUFF) + 3
    told = json.loads((dataset.root / "store/plan.json").read_text())["classes"]
    assert [(c["id"], c["name"], tuple(c["color"])) for c in told] == [(c.id, c.name, c.color) for c in dataset.classes]
    assert set(np.unique(dataset[8].semantic)) == {SKY, 34}
    other = make(tmp_path / "b", channels=("rgb", "instances"))
    assert "classes" not in json.loads((other.root / "store/plan.json").read_text())
    assert Dataset(other.root).classes == dataset.classes
