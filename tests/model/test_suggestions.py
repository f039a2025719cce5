"""The valid name that an invalid one most likely means."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.validation.errors import one_of
from viewsphere.validation.suggestions import OPPOSITES, edits, suggestion

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
FORMATS = ("bop", "coco", "csv", "hdf5", "kitti", "nuscenes", "voc", "yolo")
LABELS = ("box2d", "category", "depth", "depth_order", "instances", "normals", "semantic")


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("x", AXES, "+x"),
        ("z", AXES, "+z"),
        ("-X", AXES, "-x"),
        ("+ y", AXES, "+y"),
        ("xy", AXES, None),
        ("left", AXES, None),
        ("elephant", ("plant", "car"), None),
        ("--size", ("--seed", "--sensor"), None),
        ("mask", LABELS, "instances"),
        ("masks", LABELS, "instances"),
        ("bbox", LABELS, "box2d"),
        ("dept", LABELS, "depth"),
        ("categories", LABELS, "category"),
        ("yolov8", FORMATS, "yolo"),
        ("YOLO11", FORMATS, "yolo"),
        ("MS_COCO", FORMATS, "coco"),
        ("hdf", FORMATS, "hdf5"),
        ("tfrecord", FORMATS, None),
        ("hdir", ("hdri", "zenith"), "hdri"),
        ("min_height", ("max_height", "width"), None),
        ("of", ("on", "off"), "off"),
        ("noise", ("draw", "shot_noise"), "shot_noise"),
        ("millimetre", ("m", "cm", "mm", "in", "ft"), "mm"),
        ("", FORMATS, None),
        (None, FORMATS, None),
    ],
)
def test_what_is_meant(name, known, meant):
    assert suggestion(name, known) == meant


@pytest.mark.parametrize(("one", "two"), [*OPPOSITES, *(pair[::-1] for pair in OPPOSITES)])
def test_no_suggestion_turns_the_meaning_round(one, two):
    for name, other in ((one, two), (f"{one}_angle", f"{two}_angle"), (f"azimuth_{one}", f"azimuth_{two}")):
        assert suggestion(name, (other,)) != other


@given(st.text("abc", max_size=6), st.text("abc", max_size=6), st.text("abc", max_size=6))
def test_edits_are_a_distance(one, two, three):
    assert edits(one, two) == edits(two, one) >= abs(len(one) - len(two))
    assert (edits(one, two) == 0) == (one == two)
    assert edits(one + three, two + three) <= edits(one, two)


def test_neighbouring_letters_that_are_exchanged_are_one_edit():
    assert edits("hdir", "hdri") == 1 and edits("grene", "green") == 1 and edits("abc", "ca") == 3


def test_the_suggestion_stands_before_the_list():
    assert one_of("coc", FORMATS) == f"'coc' is unknown; did you mean 'coco'? Valid: {', '.join(FORMATS)}"
    assert one_of("x", ()) == "'x' is unknown. Valid: none"
    assert one_of("x", [f"model_{i}" for i in range(500)]).endswith(", model_79, ...")


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("yes", ["auto", "off", "on"], "on"),
        ("no", ["auto", "on", "off"], "off"),
        (True, ["off", "on"], "on"),
        (False, ["none", "box"], "none"),
        ("no", ["sky", "environment", "transparent"], "transparent"),
        ("yes", ["standard", "filmic"], None),
    ],
)
def test_a_boolean_suggests_the_word_that_means_it(name, known, meant):
    assert suggestion(name, known) == meant
