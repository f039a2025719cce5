"""Fields of a data set as PyTorch's loaders take them."""

from __future__ import annotations

import pathlib
import pickle
import tracemalloc

import numpy as np
import pytest

from cube_dataset import make
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.store.samples import dataset as reading


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Four frames of three boxes, one of them out of sight."""
    return make(tmp_path_factory.mktemp("selection") / "out", several=True)


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    """Twelve frames of one box each, of three models; those of the last one are in val."""
    return make(tmp_path_factory.mktemp("single") / "out")


def test_items_are_the_fields(dataset):
    fields = ("rgb", "depth", "index", "split", "camera.K", "pose.azimuth_deg", "pose.category")
    selection = dataset.select(*fields)
    assert len(selection) == len(dataset)
    for item, sample in zip(selection, dataset, strict=True):
        assert tuple(item) == fields
        np.testing.assert_array_equal(item["rgb"], sample.rgb)
        np.testing.assert_array_equal(item["depth"], sample.depth)
        np.testing.assert_array_equal(item["camera.K"], sample.camera.K)
        assert (item["index"], item["split"]) == (sample.index, sample.split)
        assert (item["pose.azimuth_deg"], item["pose.category"]) == (sample.pose.azimuth_deg, sample.pose.category)


def test_objects_become_arrays(dataset):
    item, sample = dataset.select(*(f"objects.{n}" for n in KINDS))[1], dataset[1]
    for name, (dtype, shape) in KINDS.items():
        value = item[f"objects.{name}"]
        assert (value.dtype, value.shape) == (dtype, (3, *shape))
        told = [getattr(o, name) for o in sample.objects]
        if name == "view":
            told = [(v.azimuth_deg, v.elevation_deg, v.distance, v.tilt_deg) for v in told]
        told = [np.full(shape, np.nan) if v is None else v for v in told]
        np.testing.assert_array_equal(value, told)
    assert any(o.box2d is None for o in sample.objects)
    assert dataset.select("objects.category")[1]["objects.category"] == [o.category for o in sample.objects]


KINDS = {
    "id": (np.int64, ()),
    "category_id": (np.int64, ()),
    "visibility": (np.float64, ()),
    "box2d": (np.float64, (4,)),
    "real_size": (np.float64, (3,)),
    "box3d_camera": (np.float64, (8, 3)),
    "box3d_in_front": (np.bool_, (8,)),
    "camera_from_object": (np.float64, (4, 4)),
    "view": (np.float64, (4,)),
    "mask": (np.bool_, (72, 96)),
}


ASKED = ("amodal", "occluders", "obb", "contour", "birds_eye")


def test_labels_on_request_become_arrays_masks_or_lists(tmp_path):
    dataset = make(tmp_path / "out", several=True, annotations=ASKED)
    names = ("amodal", "box2d_amodal", "obb", "hull", "occluders", "birds_eye", "birds_eye_corners", "rle")
    item, sample = dataset.select(*(f"objects.{name}" for name in names))[1], dataset[1]
    assert item["objects.amodal"].shape == item["objects.rle"].shape == (3, 72, 96)
    for mask, o in zip(item["objects.amodal"], sample.objects, strict=True):
        assert (mask & ~o.mask).any() == (o.occluders != ())
    assert item["objects.obb"].shape == (3, 4, 2) and item["objects.box2d_amodal"].shape == (3, 4)
    assert np.isnan(item["objects.obb"][2]).all()  # out of sight
    assert [len(hull) for hull in item["objects.hull"]] == [len(o.hull) for o in sample.objects]
    assert item["objects.occluders"] == [o.occluders for o in sample.objects]
    assert item["objects.birds_eye"] == [o.birds_eye for o in sample.objects]
    assert item["objects.birds_eye_corners"].shape == (3, 4, 2)


def test_what_nobody_asked_for_is_told(dataset):
    with pytest.raises(UserError, match=r"found objects\.amodal: add amodal to the recipe's annotations"):
        dataset.select("objects.amodal")
    with pytest.raises(UserError, match=r"found camera_from_next: add ego_motion to the recipe's annotations"):
        dataset.select("camera_from_next")


def test_one_sensor_of_a_rig_is_selected(tmp_path):
    eyes = small_recipe(
        rig={"kind": "stereo", "baseline": 0.1}, channels=["instances"], annotations=["sensor_poses"], formats=[]
    )
    generate(eyes, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    names = sorted({sample.sensor for sample in dataset})
    for name in names:
        chosen = dataset.select("sensor", "index", "camera_from_sensors", sensor=name)
        assert len(chosen) == len(dataset) / 2
        assert {item["sensor"] for item in chosen} == {name}
        assert len(chosen[0]["camera_from_sensors"]) == 2
    both = [item["index"] for name in names for item in dataset.select("index", sensor=name)]
    assert sorted(both) == [sample.index for sample in dataset]
    with pytest.raises(UserError, match="select: sensor: expected one that took pictures; found 'third'"):
        dataset.select("index", sensor="third")


def test_frames_without_objects_have_arrays_of_no_rows(dataset, monkeypatch):
    monkeypatch.setattr(Dataset, "shown", lambda self, sample: type(sample)(**{**sample.__dict__, "objects": ()}))
    item = Dataset(dataset.root).select("objects.box2d", "objects.mask", "objects.view", "objects.category")[0]
    assert item["objects.box2d"].shape == (0, 4)
    assert item["objects.mask"].shape == (0, 72, 96)
    assert item["objects.view"].shape == (0, 4)
    assert item["objects.category"] == []


def test_a_split_slices_and_places_from_the_end(single):
    everything, val = single.select("index"), single.select("index", split="val")
    assert [item["index"] for item in val] == [sample.index for sample in single if sample.split == "val"] == [8, 9, 10, 11]
    assert everything[-1] == {"index": 11} == val[-1]
    assert everything[2:6:3] == [{"index": 2}, {"index": 5}]
    assert val[:2] == [{"index": 8}, {"index": 9}]
    for selection, past in ((everything, 12), (val, 4), (everything, -13), (val, -5)):
        with pytest.raises(IndexError):
            selection[past]


def test_what_is_not_there_is_told(dataset):
    with pytest.raises(UserError, match=r"select: 'dept' is unknown; did you mean 'depth'\? Valid: rgb, .*"):
        dataset.select("dept")
    with pytest.raises(UserError, match=r"did you mean 'objects\.box2d'"):
        dataset.select("objects.box2")
    with pytest.raises(UserError, match=r"select: split: 'test' is unknown\. Valid: train, val"):
        dataset.select("rgb", split="test")


def test_only_what_is_asked_for_is_decoded(dataset, monkeypatch):
    decoded = []

    def noted(channel, *rest):
        decoded.append(channel.name)
        return decode(channel, *rest)

    decode = reading.decode
    monkeypatch.setattr(reading, "decode", noted)
    dataset.select("depth", "objects.box2d", "split")[2]
    assert decoded == ["depth"]


def test_any_frame_costs_the_reading_of_one_shot(single, monkeypatch):
    read = []
    opened = Dataset(single.root)
    selection = opened.select("index")
    assert len(selection) == 12
    monkeypatch.setattr(opened.store, "labelled", lambda key, found=opened.store.labelled: read.append(key) or found(key))
    assert [selection[i]["index"] for i in (9, 0, 5, 10)] == [9, 0, 5, 10]
    assert len(read) == 3  # the shots of three models, the last of which was read before


@pytest.mark.slow
def test_memory_does_not_grow_with_what_was_read(single):
    """By a small share of what was read: tables of Python's own fill, and tracemalloc counts what its own snapshots hold."""
    selection = Dataset(single.root).select("rgb", "depth", "objects.box2d")

    def held(rounds):
        for i in range(rounds * len(selection)):
            selection[i % len(selection)]
        kept = tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(False, pathlib.__file__)])
        return sum(trace.size for trace in kept.traces)

    tracemalloc.start()
    try:
        first = held(2)
        assert held(10) - first < 10 * len(selection) * selection[0]["rgb"].nbytes / 4
    finally:
        tracemalloc.stop()


def test_it_travels_without_what_was_read(single):
    selection = single.select("rgb", split="val")
    selection[0]
    sent = pickle.dumps(selection)
    assert len(sent) < 2_000
    np.testing.assert_array_equal(pickle.loads(sent)[1]["rgb"], single[9].rgb)


@pytest.mark.parametrize("start", ["fork", "spawn"])
@pytest.mark.filterwarnings("default:.*multi-threaded.*fork:DeprecationWarning")
def test_loaders_batch_it_in_workers(single, start):
    data = pytest.importorskip("torch.utils.data")
    selection = single.select("rgb", "index", "objects.box2d", "objects.category", split="train")
    loader = data.DataLoader(selection, batch_size=4, num_workers=2, multiprocessing_context=start)
    batches = list(loader)
    assert [batch["index"].tolist() for batch in batches] == [[0, 1, 2, 3], [4, 5, 6, 7]]
    for batch in batches:
        pictures = [single[i].rgb for i in batch["index"].tolist()]
        np.testing.assert_array_equal(batch["rgb"].numpy(), pictures)
        assert tuple(batch["objects.box2d"].shape) == (4, 1, 4)
    assert batches[0]["objects.category"] == [("hair_drier",) * 4]


def test_loaders_shuffle_it(single):
    torch = pytest.importorskip("torch")
    from torch.utils.data import DataLoader

    order = torch.Generator().manual_seed(0)
    found = [
        n for batch in DataLoader(single.select("index"), batch_size=5, shuffle=True, generator=order) for n in batch["index"]
    ]
    assert [int(n) for n in found] != list(range(12))
    assert sorted(int(n) for n in found) == list(range(12))
