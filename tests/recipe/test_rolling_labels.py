"""Labels of points under a rolling shutter in a data set that is checked."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from sealing import seal_again
from viewsphere import Dataset, Recipe, generate, render
from viewsphere.check import check
from viewsphere.labels import channels
from viewsphere.labels.tracks import positions
from viewsphere.store import encode
from viewsphere.truth.surface_points.raster import BEHIND, INVALID, OCCLUDED, OUTSIDE, VISIBLE


def rolling_recipe(**changes) -> Recipe:
    """Bicycles that slide along, and a camera that goes around them."""
    values = {
        "name": "rolling",
        "models": [
            {
                "source": "zoo:bicycle",
                "category": "bicycle",
                "count": 2,
                "scale": {"length": 0.18},
                "motion": {"kind": "constant", "velocity": [0.9, 0, 0]},
            }
        ],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 60], "elevation": 20, "distance": 0.5},
        "time": {"frames": 4, "fps": 10},
        "camera": {"size": [96, 72], "fov_deg": 45, "rolling": {"readout": 0.0771}},
        "scene": {"ground": True},
        "channels": ["depth", "instances", "tracks"],
        "tracks": {"grid": 9, "at": [1]},
        "annotations": ["keypoints", "obb"],
        "splits": {"by": "sequence"},
        "formats": [],
    }
    return Recipe.model_validate(values | changes)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("rolling") / "out"
    generate(rolling_recipe(), out, workers=0)
    return out


def test_check_proves_them(whole):
    report = check(Dataset(whole))
    assert not report.findings and not report.not_run
    assert report.checked["keypoints"] == report.checked["obb"] == report.checked["tracks"] == len(Dataset(whole)) == 8


def test_keypoints_are_seen_where_they_stand_at_the_time_of_their_row(whole):
    """A point that pixels show is inside the object's mask, within the rows that its pixel has; and it differs from a picture
    of the instant.
    """
    states, moved = set(), 0.0
    for sample in Dataset(whole):
        for o in sample.objects:
            states |= set(o.keypoint_states.tolist())
            placed = np.column_stack([o.keypoints3d, np.ones(len(o.keypoints3d))]) @ sample.camera.P.T
            moved = max(moved, float(np.nanmax(np.abs(placed[:, :2] / placed[:, 2:] - o.keypoints))))
            for (x, y), state in zip(o.keypoints, o.keypoint_states, strict=True):
                if state in (VISIBLE, OCCLUDED):
                    around = sample.channels["instances"][max(int(y) - 1, 0) : int(y) + 2, max(int(x) - 1, 0) : int(x) + 2]
                    assert state == OCCLUDED or (around == o.id).any()
    assert {VISIBLE, OCCLUDED} <= states and moved > 2


def test_tracks_start_where_they_were_picked_and_end_where_rows_show_them(whole):
    states = set()
    for sample in Dataset(whole):
        rows, xy = sample.channels["tracks"], positions(sample)
        if sample.instant == 1:
            np.testing.assert_allclose(xy[rows["state"] < INVALID], rows["query"][rows["state"] < INVALID], atol=1e-6)
        inside = ((xy >= 0) & (xy < (96, 72))).all(axis=1)
        np.testing.assert_array_equal(inside, rows["state"] <= OCCLUDED)
        np.testing.assert_array_equal(np.isnan(xy[:, 0]), rows["state"] >= BEHIND)
        seen = rows["state"] == VISIBLE
        column, row = xy[seen].astype(int).T
        shown = sample.channels["instances"][row, column]
        assert (shown == rows["object"][seen]).mean() > 0.9  # others are at edges, within a pixel
        states |= set(rows["state"].tolist())
    assert {VISIBLE, OCCLUDED, OUTSIDE} <= states


def test_labels_do_not_depend_on_the_cut_into_shots(whole):
    """Shots of one frame hold the rows of other instants, too, at which points are picked and with which labels compare."""
    for kept, sample in zip(Dataset(whole), render(rolling_recipe(shot_frames=1)), strict=True):
        for name, array in sample.channels.items():
            np.testing.assert_array_equal(kept.channels[name], array, name)
        for o, other in zip(kept.objects, sample.objects, strict=True):
            np.testing.assert_array_equal(o.keypoint_states, other.keypoint_states)


@pytest.fixture
def copied(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "out")


@pytest.mark.parametrize("field", ["state", "point"])
def test_changed_tracks_are_found(copied, field):
    sample = Dataset(copied)[2]
    array = np.array(sample.channels["tracks"])
    at = np.flatnonzero(array["state"] == VISIBLE)[0]
    array[field][at] = OCCLUDED if field == "state" else array[field][at] + (1e-3, 0, 0, 0)
    (copied / sample.files["tracks"]).write_bytes(encode(channels()["tracks"], array))
    seal_again(copied)
    assert any(sample.index == finding.frame for finding in check(Dataset(copied)).findings)
