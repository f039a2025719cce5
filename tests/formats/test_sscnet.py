"""SSCNet's data, by a reader after its own code: depth, put where the camera says, lies in cells that are not empty."""

from __future__ import annotations

import re
import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.formats.sscnet import FORMAT, Sscnet
from viewsphere.model.annotations.voxels import RUN
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from worlds import stills as recipe

NUMBERS = {"ground": 2, "scenery": 3, "building": 3, "chair": 6, "sky": 0}


@pytest.fixture(scope="module", params=[pytest.param(axes, marks=pytest.mark.slow) for axes in ("view", "world")])
def both(request, tmp_path_factory):
    place = tmp_path_factory.mktemp(request.param)
    kept = {"channels": ["rgb", "depth", "semantic", "voxels"], "labels": {"voxels": {"axes": request.param}}}
    changes = {
        **kept,
        "scenes": {"count": 1, "objects": [3, 4], "layout": "scatter"},
        "annotations": [],
        "splits": {"train": 1},
    }
    generate(recipe(name=request.param, **changes), place / "set", workers=0)
    export(place / "set", "sscnet", output=place)
    return Dataset(place / "set"), place / "sscnet"


def read(file):
    """Corner (3,), camera to world (4, 4), classes (world x, world z, world y)."""
    data = file.read_bytes()
    corner, pose = np.array(struct.unpack_from("<3f", data)), np.array(struct.unpack_from("<16f", data, 12)).reshape(4, 4)
    pairs = np.frombuffer(data, "<u4", offset=76)
    return corner, pose, np.repeat(pairs[::2], pairs[1::2]).reshape(240, 144, 240)


def read_depth(file):
    """Metres, as readDepth.m: turned right by three bits."""
    turned = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert turned.dtype == np.uint16
    return ((turned >> 3) | (turned << 13)).astype(float) / 1000


def test_depth_and_cells(both):
    dataset, folder = both
    numbers = np.zeros(64, int)
    numbers[[c.id for c in dataset.classes]] = [NUMBERS.get(c.name, 36) for c in dataset.classes]
    for sample in dataset:
        name = folder / f"depthbin/train/{sample.index:08d}_still_fl000_rm0000_0000"
        depth, seen = read_depth(name.with_suffix(".png")), np.isfinite(sample.depth)
        equal("sscnet", "a reader after its code: where depth is", depth > 0, seen)
        close(
            "sscnet", "a reader after its code: depth", depth[seen], np.minimum(sample.depth[seen], 65.535), "m", atol=0.000501
        )
        corner, pose, classes = read(name.with_suffix(".bin"))
        grid = sample.voxel_grid
        expected = numbers[np.where(grid.state == 0, 0, grid.classes)]
        equal("sscnet", "a reader after its code: classes", classes.transpose(2, 1, 0), expected)
        k = sample.camera.intrinsics
        v, u = np.nonzero(seen & (sample.depth < 6))
        z = sample.depth[v, u].astype(float)
        points = np.stack(((u + 0.5 - k.cx) * z / k.fx, (v + 0.5 - k.cy) * z / k.fy, z), axis=1) @ pose[:3, :3].T + pose[:3, 3]
        cells = (points - corner) / 0.02
        inside = ((cells >= 0) & (cells < [240, 240, 144])).all(axis=1) & (np.abs(cells - np.rint(cells)) > 2e-3).all(axis=1)
        x, y, up = np.floor(cells[inside]).astype(int).T
        assert inside.sum() > 3000 and (classes[x, up, y] > 0).all()
        shown = numbers[sample.semantic[v, u][inside]]
        assert (classes[x, up, y] == shown).mean() > 0.95  # where two things share a cell, it is one's
        close("sscnet", "a reader after its code: heights of places", points[:, 2].min(), 0, "m", atol=1e-4)  # the ground
        if dataset.name == "world":
            close("sscnet", "a reader after its code: cameras", pose[:3, :3], sample.camera.R.T, "1", atol=1e-6)
            close("sscnet", "a reader after its code: cameras", pose[:3, 3], sample.camera.center, "m", atol=1e-6)
            close("sscnet", "a reader after its code: corners", corner, grid.grid.world_from_grid[:3, 3], "m", atol=1e-6)
        else:
            close("sscnet", "a reader after its code: views", pose[0, 2], 0, "1", atol=1e-6)  # it looks along y


def made(dataset, runs):
    sample = replace(dataset[0], channels={**dataset[0].channels, "voxels": runs}, files={})
    return next(one for one in Sscnet(dataset).sample_files(sample) if one.path.endswith(".bin")).content.make()


def test_rooms(both, tmp_path):
    """Empty cells outside of a room are 255; filled ones keep their class; what no pixel shows is empty."""
    dataset, _ = both
    rows = [(1, 0, 0, 0, 1, 1), (1, 0, 0, 0, 1, 0), (1, 3, 0, 1, 3, 0), (1, 3, 0, 1, 0, 1), (8294400 - 4, 0, 0, 0, 1, 1)]
    (tmp_path / "a.bin").write_bytes(made(dataset, np.array(rows, RUN)))
    classes = read(tmp_path / "a.bin")[2].transpose(2, 1, 0).ravel()
    assert classes[:5].tolist() == [0, 255, 3, 0, 0] and not classes[5:].any()


def test_nothing_at_all(both, tmp_path):
    dataset, _ = both
    (tmp_path / "a.bin").write_bytes(made(dataset, np.array([(8294400, 0, 0, 0, 1, 0)], RUN)))
    assert not read(tmp_path / "a.bin")[2].any() and (tmp_path / "a.bin").stat().st_size == 76 + 8


def test_what_it_refuses(both, drives):
    dataset, _ = both
    assert list(FORMAT.refuses(scope_of(dataset))) == []
    assert list(FORMAT.refuses(scope_of(drives))) == ["expected cameras; found the LiDAR top"]
    sample = replace(dataset[0], options={"voxels": {"size": (24, 14, 24), "cell": 0.2}})
    told = "sscnet: expected voxels of 240 x 144 x 240 cells of 0.02 m; found 24 x 14 x 24 of 0.2 m"
    with pytest.raises(UserError, match=re.escape(told)):
        list(Sscnet(dataset).sample_files(sample))
    (told,) = Sscnet(dataset).notes()
    assert told.endswith("these have 160 x 120 and 171.561")
