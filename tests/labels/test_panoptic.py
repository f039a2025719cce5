"""panoptic is semantic and instances in one number, by every lens; its proof notices other numbers."""

from dataclasses import replace

import numpy as np
import pytest

from label_scenes import changed, proof, random_sample
from proven import equal
from truth_scenes import EVERY
from viewsphere.errors import StoreError
from viewsphere.labels import LabelContext, channels
from viewsphere.labels.panoptic import LABEL, MOST, class_of, compute, object_of, picture, renumbered
from viewsphere.store import encode
from viewsphere.store.samples.channel_files import decode
from viewsphere.truth.raster.triangle_labels import TriangleLabels

NAMES = ("depth", "instances", "semantic", "panoptic")


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(3))
def test_it_decodes_to_what_semantic_and_instances_are(name, seed):
    sample, *_ = random_sample(seed, name, NAMES)
    equal("panoptic", "semantic and instances", sample.panoptic >> 16, sample.semantic)
    equal("panoptic", "semantic and instances", sample.panoptic & 65535, sample.instances)
    assert sample.panoptic.dtype == np.int32 and len(np.unique(object_of(sample.panoptic))) > 3


def test_the_greatest_numbers_decode_exactly_also_from_a_file():
    classes, objects = (a.ravel() for a in np.meshgrid([0, 1, 31, 32, MOST[1]], [0, 1, MOST[0]]))
    codes = (classes << 16 | objects).astype(np.int32)[None]
    data = encode(channels()["panoptic"], codes)
    back = decode(channels()["panoptic"], "x.tiff", lambda: data)
    assert (class_of(back)[0] == classes).all() and (object_of(back)[0] == objects).all()


def test_more_than_the_number_has_room_for_is_an_error():
    sample, geometry, visibility = random_sample(0, "pinhole", NAMES)
    higher = TriangleLabels((), (), (lambda: geometry.triangle_class + 32768,))
    for more in ({"object_count": 65536}, {"labels": higher}):
        with pytest.raises(StoreError, match=r"channel panoptic: expected objects of 0\.\.65535, classes of 0\.\.32767; found"):
            compute(LabelContext(replace(geometry, **more), sample.camera, visibility))


def test_its_proof_notices_other_numbers():
    sample, *_ = random_sample(1, "barrel", NAMES)
    assert proof(LABEL, sample) == []
    thing, background = (tuple(np.argwhere(mask)[3]) for mask in (sample.instances > 0, sample.instances == 0))
    for change in (
        lambda a: a.__setitem__(thing, a[thing] + 1),
        lambda a: a.__setitem__(thing, a[thing] + 65536),
        lambda a: a.__setitem__(thing, a[background]),
        lambda a: a.__setitem__(background, a[background] + 1),
        lambda a: a.__setitem__(background, 0),
        lambda a: a.__setitem__(background, 1 << 16),
    ):
        assert proof(LABEL, changed(sample, "panoptic", change))


def test_other_ids_of_categories_change_classes_of_things_alone():
    codes = np.array([[2 << 16, 32 << 16 | 7, 33 << 16 | 65535]], np.int32)
    assert renumbered(codes, {1: 5, 2: 1}).tolist() == [[2 << 16, 36 << 16 | 7, 32 << 16 | 65535]]


def test_its_picture_tells_things_of_one_class_apart():
    codes = np.array([[1 << 16, 32 << 16 | 1, 32 << 16 | 2]], np.int32)
    assert len({tuple(color) for color in picture(codes)[0].tolist()}) == 3
