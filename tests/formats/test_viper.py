"""VIPER, read by pandas, Pillow and numpy as its readme says, and by ptlflow's reader where it is installed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.formats.viper import CLASSES, FORMAT, Viper
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from viewsphere.store import Category
from worlds import videos as recipe

FLIP = np.diag([1, -1, -1, 1])
NUMBERS = {"sky": 2, "ground": 6, "car": 24, "chair": 17}


@pytest.fixture(scope="module")
def lone(tmp_path_factory):
    """Two sequences of one camera; one of their models is none of VIPER's classes."""
    place, kept = tmp_path_factory.mktemp("lone"), ["rgb", "instances", "semantic", "flow", "flow_state"]
    models = [*recipe().model_dump(exclude_defaults=True)["models"]]
    models[1] = {**models[1], "category": 'seat, "Bäume"'}
    changes = {"rig": None, "tracks": None, "annotations": [], "channels": kept, "models": models}
    generate(recipe(name="lone", **changes), place, workers=0)
    return Dataset(place)


@pytest.fixture(scope="module")
def written(lone, tmp_path_factory):
    place = tmp_path_factory.mktemp("viper")
    export(lone.root, "viper", output=place)
    return place / "viper"


def number(dataset, sample):
    return f"{dataset.sequences.index(sample.sequence) + 1:03d}"


def pixels(file):
    with Image.open(file) as opened:
        return np.array(opened)


def test_maps(lone, written):
    classes = pd.read_csv(written / "classes.csv").set_index("classname")
    assert len(classes) == 33 and classes.index[32] == 'seat, "Bäume"' and classes.id.tolist() == list(range(33))
    table = {c.id: NUMBERS.get(c.name, 32 if c.is_thing else 0) for c in lone.classes}
    for sample in lone:
        sequence = number(lone, sample)
        name = f"{sequence}/{sequence}_{sample.instant + 1:05d}"
        equal("viper", "Pillow: pictures", pixels(written / sample.split / f"img/{name}.png"), sample.rgb)
        found, expected = pixels(written / sample.split / f"cls/{name}.png"), np.vectorize(table.get)(sample.semantic)
        equal("viper", "Pillow: classes", found, expected)
        r, g, b = np.moveaxis(pixels(written / sample.split / f"inst/{name}.png").astype(int), 2, 0)
        equal("viper", "Pillow: classes of objects", r, expected)
        equal("viper", "Pillow: objects", 256 * g + b, sample.instances)
        flow = written / sample.split / f"flow/{name}.npz"
        assert flow.is_file() == (sample.instant < 5)
        if flow.is_file():
            with np.load(flow) as arrays:
                assert arrays["u"].dtype == arrays["v"].dtype == np.float16
                found = np.dstack((arrays["u"], arrays["v"])).astype(float)
            close("viper", "numpy: flow", found, sample.flow, "px", rtol=2**-11, atol=1e-7)


def test_cameras(lone, written):
    for name in lone.sequences:
        samples = lone.sequence(name)
        rows = np.loadtxt(written / samples[0].split / f"camera/{number(lone, samples[0])}.csv", delimiter=",")
        assert rows.shape == (6, 33) and rows[:, 0].tolist() == [1, 2, 3, 4, 5, 6]
        np.testing.assert_allclose(rows[0, 17:].reshape(4, 4), np.eye(4), atol=1e-11)
        first = np.eye(4)
        first[:3, :3], first[:3, 3] = samples[0].camera.R, samples[0].camera.t
        for sample, row in zip(samples, rows, strict=True):
            projection, view = row[1:17].reshape(4, 4), row[17:].reshape(4, 4)
            now = FLIP @ view @ FLIP @ first  # from the world to the camera, x right, y down, z ahead
            close("viper", "numpy: cameras", now[:3, :3], sample.camera.R, "1", atol=1e-11)
            close("viper", "numpy: cameras", now[:3, 3], sample.camera.t, "m", atol=1e-11)
            for o in sample.objects:
                corners = np.column_stack((o.box3d, np.ones(8))) @ (projection @ view @ FLIP @ first).T
                x, y = (corners[:, :2] / corners[:, 3:]).T
                found = np.column_stack(((x + 1) / 2 * 160, (1 - y) / 2 * 120))
                close("viper", "numpy: projections", found, o.box3d_pixels, "px", atol=1e-9)


def test_sensors_are_sequences(videos, tmp_path):
    export(videos.root, "viper", output=tmp_path)
    for sample in videos:
        sequence = f"{number(videos, sample)}{'-1' * (sample.sensor == 'right')}"
        frame = f"{sequence}/{sequence}_{sample.instant + 1:05d}.png"
        equal("viper", "Pillow: pictures", pixels(tmp_path / "viper" / sample.split / "img" / frame), sample.rgb)
        rows = np.loadtxt(tmp_path / "viper" / sample.split / f"camera/{sequence}.csv", delimiter=",")
        np.testing.assert_allclose(rows[0, 17:].reshape(4, 4), np.eye(4), atol=1e-11)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ptlflow_reads_flow(lone, written):
    ViperDataset = pytest.importorskip("ptlflow.data.datasets").ViperDataset
    for split in lone.splits:
        read, own = ViperDataset(str(written), split), [sample for sample in lone if sample.split == split]
        pairs = [(sample, after) for sample, after in pairwise(own) if after.instant == sample.instant + 1]
        assert len(read) == len(pairs)
        for (sample, after), found in zip(pairs, (read[i] for i in range(len(read))), strict=True):
            images = [image[..., ::-1] for image in found["images"]]
            equal("viper", "ptlflow: pictures", images, [sample.rgb, after.rgb])
            valid = found["valids"][0][..., 0] > 0
            close("viper", "ptlflow: flow", found["flows"][0][valid], sample.flow[valid], "px", rtol=2**-11, atol=1e-7)


def test_frames_of_several_splits_are_an_error(lone, monkeypatch):
    from viewsphere.store import Dataset as Stored

    dataset = Stored(lone.root)
    monkeypatch.setitem(dataset.plan.parts[0].recipe, "splits", {"by": "frame"})
    with pytest.raises(UserError, match="viper: expected splits that keep sequences whole; found "):
        Viper(dataset)


def test_a_picture_without_objects(lone):
    sample = replace(lone[0], objects=())
    assert {one.path.split("/")[1] for one in Viper(lone).sample_files(sample)} == {"img", "cls", "inst", "flow", "camera"}


def test_what_it_refuses(stills, videos, lone):
    assert len(CLASSES.splitlines()) == 32
    assert list(FORMAT.refuses(scope_of(lone))) == []
    assert list(FORMAT.refuses(scope_of(stills))) == ["expected sequences (a recipe's time); found still pictures"]
    assert list(FORMAT.refuses(scope_of(videos))) == []
    many = replace(scope_of(lone), categories=tuple(Category(i, str(i), "") for i in range(300)))
    assert list(FORMAT.refuses(many)) == ["expected at most 200 categories; found 300"]
