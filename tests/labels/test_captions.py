"""captions and referring: what sentences say holds, in scenes and among objects that are made for it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import viewsphere as vs
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import labels
from viewsphere.labels.referring import Scene
from viewsphere.labels.shared.captions.english import listed, number, plural, with_article
from viewsphere.labels.shared.captions.statements import Company, of_one, phrases, place_of, side_of
from viewsphere.run.datasets.merging import merge
from viewsphere.store import Dataset

SIZE = (300, 300)


def seen(id, category="chair", box=(0, 0, 30, 30), at=(0, 0, 0), half=0.5, distance=None, **more):
    """A visible object with a cube's 3D box around a place of the world."""
    cube = Box3d.between(np.subtract(at, half), np.add(at, half)).corners
    area = int((box[2] - box[0]) * (box[3] - box[1]))
    view = SimpleNamespace(distance=distance or 10.0, azimuth_deg=0.0, elevation_deg=0.0)
    own = {"category": category, "category_id": 1, "visibility": 1.0, "truncation": 0.0, "area": area, "view": view}
    return SimpleNamespace(id=id, box2d=box, box3d=cube, **{**own, **more})


def recipe(**changes):
    said = {
        "models": [
            {"source": "zoo:post_box", "category": "post_box", "count": 2},
            {"source": "zoo:wheelie_bin", "category": "bin", "count": 1, "color": "navy"},
        ],
        "scenes": {"count": 2, "objects": 4, "layout": "scatter", "repeat": True},
        "viewpoints": {"azimuth": [20], "elevation": [15], "distance": 5},
        "camera": {"size": [96, 72], "fov_deg": 50},
        "channels": ["instances"],
        "annotations": ["captions", "referring", "looks"],
        "formats": [],
    }
    return vs.Recipe.model_validate({**said, **changes})


@pytest.mark.parametrize(
    ("noun", "expected"),
    [
        *[("chair", "chairs"), ("bus", "buses"), ("box", "boxes"), ("bench", "benches"), ("toothbrush", "toothbrushes")],
        *[("toy", "toys"), ("lorry", "lorries"), ("wine glass", "wine glasses"), ("person", "people"), ("Person", "People")],
        *[("knife", "knives"), ("teddy bear", "teddy bears"), ("sheep", "sheep"), ("cactus", "cacti"), ("guy", "guys")],
    ],
)
def test_plurals(noun, expected):
    assert plural(noun, {"cactus": "cacti"}) == expected


def test_articles_numbers_and_lists():
    words = ("car", "apple", "hour", "honest face", "unicorn", "umbrella", "one", "Orange car", "European car", "ufo")
    articles = ("a", "an", "an", "an", "a", "an", "a", "an", "a", "a")
    assert [with_article(word) for word in words] == [f"{a} {word}" for a, word in zip(articles, words, strict=True)]
    assert [number(n) for n in (0, 1, 12, 13)] == ["no", "one", "twelve", "13"]
    assert [listed(words) for words in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]


def test_adjectives_stand_in_their_order():
    assert [p for p, _ in phrases(seen(1), ("red", "glossy"))] == ["chair", "red chair", "glossy chair", "glossy red chair"]
    assert [p for p, _ in phrases(seen(1, "hair_drier"), ("red", "metal"))][-1] == "red metal hair drier"
    assert [p for p, _ in phrases(seen(1), ("", "wooden"))] == ["chair", "wooden chair"]


def test_places():
    middles = [40, 150, 260]
    found = [[place_of((x, y, x, y), *SIZE) for x in middles] for y in middles]
    assert found == [
        ["at the top left", "at the top", "at the top right"],
        ["on the left", "in the middle", "on the right"],
        ["at the bottom left", "at the bottom", "at the bottom right"],
    ]
    assert place_of((100, 200, 100, 200), *SIZE) == "in the middle"


def test_sides():
    def side(azimuth, elevation=0.0):
        return side_of(seen(1, view=SimpleNamespace(azimuth_deg=azimuth, elevation_deg=elevation)))

    assert [side(a) for a in (0, 22.4, 22.5, 90, 180, 270, 337.4, 337.5, 359)] == [
        *["its front", "its front", "its front left", "its left", "its back", "its right", "its front right"],
        *["its front", "its front"],
    ]
    assert side(90, 45) == "its left and from above" and side(90, -30) == "its left and from below"
    assert side(90, 60) == "above" and side(90, -75) == "below"


def test_what_is_said_of_one_object():
    def said(form, has_front=True, **more):
        return of_one(form, seen(1, **more), SIZE, has_front)

    assert said("place") == "is at the top left of the picture"
    assert said("size", area=18_000) == "fills a large part of the picture" and said("size", area=17_999) == ""
    assert said("size", area=900) == "fills a small part of the picture" and said("size", area=901) == ""
    assert said("hidden", visibility=0.6, truncation=0.1) == "is partly hidden"
    assert said("hidden", visibility=0.7, truncation=0.1) == ""
    assert said("cut", truncation=0.1) == "is partly outside the picture" and said("cut", truncation=0.09) == ""
    assert said("view") == "is seen from its front" and said("view", has_front=False) == ""


def holding(one, other):
    relations = Company((one, other)).relations
    return [name for name, holds in relations.items() if holds[0, 1]]


def test_relations():
    near = {"distance": 5.0}
    far_apart = {"at": (9, 0, 0)}
    assert holding(seen(1), seen(2, box=(30, 0, 60, 30), **far_apart)) == ["to the left of"]
    assert holding(seen(1, box=(30, 0, 60, 30)), seen(2, **far_apart)) == ["to the right of"]
    assert holding(seen(1, **near), seen(2, box=(20, 0, 50, 30), **far_apart)) == ["in front of"]
    assert holding(seen(1), seen(2, box=(20, 0, 50, 30), **far_apart, **near)) == ["behind"]
    assert holding(seen(1, distance=9.1), seen(2, box=(20, 0, 50, 30), **far_apart)) == []
    assert holding(seen(1, at=(0, 0, 1)), seen(2)) == ["above"] and holding(seen(1), seen(2, at=(0, 0, 1))) == ["below"]
    assert holding(seen(1, at=(0, 0, 0.9)), seen(2)) == ["next to"]  # sunk by more than a twentieth
    assert holding(seen(1), seen(2, at=(1.2, 0, 0))) == ["next to"] and holding(seen(1), seen(2, at=(2.2, 0, 0))) == []
    assert holding(seen(1), seen(2, box=(40, 0, 60, 30), at=(1.2, 0, 0))) == ["to the left of", "next to"]


def expressions(*objects, **words):
    """By the ids; words for looks by names such as o1."""
    scene = Scene(objects, {o.id: words.get(f"o{o.id}", ("", "")) for o in objects}, SIZE)
    found = [scene.expression(i) for i in range(len(objects))]
    return [one and one.text for one in found]


def test_referring_expressions_are_as_short_as_can_be():
    left, right = seen(1, box=(0, 0, 30, 30)), seen(2, box=(250, 0, 280, 30), at=(9, 0, 0))
    assert expressions(left, seen(2, "car")) == ["the chair", "the car"]
    assert expressions(left, right, o1=("red", "matte"), o2=("black", "matte")) == ["the red chair", "the black chair"]
    assert expressions(left, right, o1=("", "metal")) == ["the metal chair", "the chair at the top right of the picture"]
    assert expressions(left, right) == ["the chair at the top left of the picture", "the chair at the top right of the picture"]
    beside = seen(2, box=(31, 0, 61, 30), at=(9, 0, 0))
    assert expressions(left, beside) == ["the leftmost chair", "the rightmost chair"]
    nearer = seen(2, box=(0, 0, 33, 30), at=(9, 0, 0), distance=5.0)
    assert expressions(left, nearer) == ["the farthest chair", "the nearest chair"]
    three = left, right, seen(3, box=(250, 3, 280, 33), at=(20, 0, 0))
    words = {"o1": ("red", "matte"), "o2": ("red", "metal"), "o3": ("gray", "metal")}
    assert expressions(*three, **words) == ["the matte chair", "the red metal chair", "the gray chair"]


def test_a_landmark_is_singled_out_by_itself():
    same = (0, 0, 30, 30)
    chairs = seen(1, box=same), seen(2, box=same, at=(9, 0, 0)), seen(3, "car", box=same, at=(9, 1.2, 0))
    assert expressions(*chairs) == [None, "the chair that is next to the car", "the car"]
    cars = seen(4, "car", box=same, at=(-9, 0, 0))
    assert expressions(*chairs, cars) == [None, None, None, None]
    found = expressions(*chairs, cars, o3=("red", ""))
    assert found == [None, "the chair that is next to the red car", "the red car", None]


def test_nothing_singles_out_what_is_alike():
    assert expressions(seen(1), seen(2, at=(9, 0, 0))) == [None, None]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    root = tmp_path_factory.mktemp("captions") / "out"
    vs.generate(recipe(), root)
    return Dataset(root)


@pytest.mark.slow
def test_they_are_kept_as_they_are_in_memory(kept):
    for one, again in zip(kept, vs.render(recipe()), strict=True):
        assert one.captions == again.captions and one.referring == again.referring
        assert 1 < len(one.captions) <= 5 and len({caption.text for caption in one.captions}) == len(one.captions)
        assert one.captions[0].form == "count"
        assert {o.color for o in one.objects if o.category == "bin"} <= {"navy"}
    others = [sample.captions for sample in vs.render(recipe(seed=4, labels={"captions": {"seed": 9}}))]
    assert others != [sample.captions for sample in kept]


def test_proofs_find_other_words(kept):
    models = {info.key: info for info in kept.models}
    captions, referring = labels()["captions"], labels()["referring"]
    for sample in kept:
        assert not list(captions.prove(sample, models)) and not list(referring.prove(sample, models))
        for i, one in enumerate(sample.captions):
            for old, new in (("picture", "image"), (" is ", " is not "), ("its ", "my "), ("bin", "car"), ("navy", "red")):
                if one.form != "count" and old in one.text:
                    other = changed(sample, "captions", i, text=one.text.replace(old, new))
                    assert list(captions.prove(other, models)), other.captions[i]
            if one.form == "count":
                more, fewer = one.text.replace("bin", "bin and a dog"), one.objects[:-1]
                for parts in ({"text": more}, {"objects": fewer}, {"text": "No object can be seen.", "objects": ()}):
                    assert more != one.text and list(captions.prove(changed(sample, "captions", i, **parts), models)), parts
            if one.form in ("place", "view"):
                assert list(captions.prove(changed(sample, "captions", i, objects=(99,)), models))
        for i, one in enumerate(sample.referring):
            assert list(referring.prove(changed(sample, "referring", i, text=one.text + "s"), models))
            assert list(referring.prove(changed(sample, "referring", i, extreme="middlemost"), models))
        fewer = replace(sample, extra={**sample.extra, "referring": sample.referring[1:]})
        assert sample.referring and list(referring.prove(fewer, models))


def changed(sample, name, i, **parts):
    """The sample with other parts of one of its captions or expressions."""
    found = list(sample.extra[name])
    found[i] = replace(found[i], **parts)
    return replace(sample, extra={**sample.extra, name: tuple(found)})


def test_scenes_are_painted_and_have_weather():
    """A tint counts, daylight is told of, and what is too little visible is not."""
    scene = {"sky": {"daylight": {"clouds": 0.9}}, "materials": [{"tint": [0.6, 0.02, 0.02], "material": "*"}]}
    told = {"captions": {"count": 100, "min_visibility": 1.0}, "referring": {"min_visibility": 1.0}}
    for sample in vs.render(recipe(scene=scene, labels=told)):
        forms = {caption.form for caption in sample.captions}
        texts = [caption.text for caption in sample.captions]
        whole = {o.id for o in sample.objects if o.visibility == 1}
        assert {id for caption in sample.captions for id in caption.objects} == whole
        assert {one.object for one in sample.referring} <= whole
        assert "The sky is overcast." in texts and "place" in forms
        assert not {"navy", "yellow", "green"} & {word for text in texts for word in text.split()}


@pytest.mark.slow
def test_sentences_hold_in_a_merged_data_set_whose_categories_have_other_numbers(tmp_path):
    models = [{"source": f"zoo:{name}", "category": name, "count": 1} for name in ("post_box", "wheelie_bin")]
    scenes = {"count": 1, "objects": 2, "layout": "row"}
    splits = {"by": "frame", "train": 1}
    for name, own in (("a", models), ("b", models[::-1])):
        vs.generate(recipe(models=own, scenes=scenes, splits=splits), tmp_path / name)
    report = check(merge([tmp_path / "a", tmp_path / "b"], tmp_path / "c"))
    assert report.ok and report.checked["captions"] == 2, report.findings


def test_one_s_own_sentences():
    templates = ["a photo of {list}", "{{a}} {description}, {place}", "{count} {categories}", "it is {weather}"]
    options = {"count": 50, "templates": templates, "plurals": {"post box": "letter boxes"}}
    for sample in vs.render(recipe(labels={"captions": options})):
        texts = [caption.text for caption in sample.captions]
        assert {caption.form for caption in sample.captions} == {"template"}
        assert sum(text.startswith("A photo of ") for text in texts) == sum(text.startswith("Four ") for text in texts) == 1
        assert sum(text.startswith("{a} a") for text in texts) == len({text for text in texts if text.startswith("{a} a")}) > 0
        assert not any(text.startswith("It is") for text in texts)  # there is no weather
        boxes = sum(o.category == "post_box" for o in sample.objects)
        assert boxes < 2 or any("letter boxes" in text for text in texts)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"templates": ["a {colour} car"]}, r"templates\[0\]: field {colour}: 'colour' is unknown; did you mean 'color'"),
        ({"templates": ["{list", "b"]}, r"templates\[0\]: expected fields in pairs of braces"),
        ({"templates": ["{list:>9}"]}, r"templates\[0\]: expected fields without a format"),
        ({"templates": ["{object.id}"]}, r"templates\[0\]: field {object.id}"),
        ({"templates": ["{}"]}, r"templates\[0\]: field {}"),
        ({"plurals": {"box": ""}}, r"plurals\.box: expected printable text; found ''"),
        ({"plurals": {"box": "bo\nxes"}}, r"plurals\.box: expected printable text"),
        ({"templates": [" "]}, r"templates\[0\]: expected a line of printable text"),
        ({"count": 0}, r"count: expected a number greater than or equal to 1"),
        ({"min_visibility": float("nan")}, r"min_visibility: expected"),
        ({"sentences": 3}, r"sentences: 'sentences' is unknown"),
    ],
)
def test_mistakes_are_told_before_rendering(options, told):
    with pytest.raises(RecipeError, match=rf"labels\.captions\.{told}"):
        vs.plan(recipe(labels={"captions": options}))


@pytest.mark.slow
def test_nothing_is_told_of_nothing():
    found = [
        sample
        for sample in vs.render(recipe(empty=0.5, viewpoints={"azimuth": [0, 90, 180], "elevation": [15], "distance": 5}))
    ]
    assert {bool(sample.objects) for sample in found} == {True, False}
    for sample in found:
        if not sample.objects:
            assert [caption.text for caption in sample.captions] == ["No object can be seen."] and sample.referring == ()


def test_a_lidar_s_picture_has_no_captions():
    rig = {"sensors": {"camera": {}, "top": {"lidar": {"rings": 8, "elevation": [-20, 10], "azimuth_step": 10}}}}
    found = [s for s in vs.render(recipe(rig=rig, channels=["instances", "lidar"]))]
    assert {bool(s.captions) for s in found if s.sensor == "camera"} == {True}
    assert {(s.captions, s.referring) for s in found if s.sensor == "top"} == {((), ())}
    assert not [problem for s in found for problem in labels()["referring"].prove(s, {})]
