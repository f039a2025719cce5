"""Labels of points under a rolling shutter in a data set that is checked."""

from __future__ import annotations

import shutil
from itertools import pairwise

import numpy as np
import pytest

from rolling_scenes import sliding
from sealing import seal_again
from viewsphere import Dataset, Recipe, generate, matches, render
from viewsphere.check import check
from viewsphere.labels import channels
from viewsphere.labels.tracks import positions
from viewsphere.store import encode
from viewsphere.truth.surface_points.raster import BEHIND, INVALID, OCCLUDED, OUTSIDE, VISIBLE

MOTION = ["flow", "flow_state", "flow_backward", "flow_backward_state", "motion_boundaries", "scene_flow"]
CHANNELS = ["depth", "instances", "tracks", *MOTION]


def rolling_recipe(**changes) -> Recipe:
    """Bicycles that slide along, and a camera that goes around them."""
    asked = {"channels": CHANNELS, "tracks": {"grid": 9, "at": [1]}, "annotations": ["keypoints", "obb"]}
    return Recipe.model_validate(sliding("zoo:bicycle", 0.5, 4) | asked | changes)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("rolling") / "out"
    generate(rolling_recipe(), out, workers=0)
    return out


@pytest.mark.slow
def test_check_proves_them(whole):
    report = check(Dataset(whole))
    assert not report.findings and not report.not_run
    assert (
        report.checked["keypoints"]
        == report.checked["obb"]
        == report.checked["flow"]
        == report.checked["tracks"]
        == len(Dataset(whole))
        == 8
    )


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


def test_flow_leads_to_the_rows_of_the_next_picture(whole):
    """Where a point is visible in the next picture, the pixel there shows its object; and its flow leads back to its pixel,
    but for half a pixel in which the surface is another.
    """
    samples, ends = list(Dataset(whole)), np.array((95, 71))
    agreed, back = list[bool](), list[float]()
    for now, then in pairwise(samples):
        if now.sequence != then.sequence:
            continue
        found, centers = matches(now, then), np.stack(np.meshgrid(np.arange(96), np.arange(72)), axis=-1) + 0.5
        np.testing.assert_allclose(found.xy - centers, now.channels["flow"], rtol=1e-5, atol=1e-4)
        y, x = np.nonzero((now.channels["flow_state"] == VISIBLE) & (now.channels["instances"] > 0))
        there = np.column_stack((x, y)) + 0.5 + now.channels["flow"][y, x]
        column, row = np.minimum(there.astype(int), ends).T
        padded = np.pad(then.channels["instances"], 1)  # a bicycle's tubes are thinner than a pixel
        around = [padded[row + v, column + u] for v in range(3) for u in range(3)]
        agreed += (np.array(around) == now.channels["instances"][y, x]).any(axis=0).tolist()
        flow = then.channels["flow_backward"][row, column]
        back += np.linalg.norm(there + flow - np.column_stack((x, y)) - 0.5, axis=1).tolist()
    assert np.mean(agreed) > 0.9 and np.nanmedian(back) < 0.5 and len(back) > 300


@pytest.mark.slow
def test_rectified_cameras_roll_together(tmp_path):
    """Rows with one number are exposed together, so disparity is baseline x focal length / depth in every row."""
    names = ["depth", "disparity", "disparity_state", "disparity_change"]
    recipe = rolling_recipe(rig={"kind": "stereo", "baseline": 0.03}, channels=names, tracks=None, annotations=[])
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    report = check(dataset)
    assert not report.findings and report.checked["disparity"] == len(dataset) == 16
    for sample in dataset:
        depth, disparity = sample.channels["depth"], sample.channels["disparity"]
        np.testing.assert_allclose(disparity * depth, sample.camera.K[0, 0] * 0.03, rtol=1e-5)
        assert set(np.unique(sample.channels["disparity_state"])) <= {VISIBLE, OCCLUDED, OUTSIDE}


@pytest.mark.slow
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


@pytest.mark.parametrize("name", MOTION)
@pytest.mark.slow
def test_a_changed_pixel_of_motion_is_found(copied, name):
    sample = Dataset(copied)[1]
    array = np.array(sample.channels[name])
    array[30, 40] = array[30, 40] + np.ones_like(array[30, 40]) * (0.01 if array.dtype.kind == "f" else 1)
    (copied / sample.files[name]).write_bytes(encode(channels()[name], array))
    seal_again(copied)
    assert any(sample.index == finding.frame for finding in check(Dataset(copied)).findings)


@pytest.mark.parametrize("field", ["state", "point"])
@pytest.mark.slow
def test_changed_tracks_are_found(copied, field):
    sample = Dataset(copied)[2]
    array = np.array(sample.channels["tracks"])
    at = np.flatnonzero(array["state"] == VISIBLE)[0]
    array[field][at] = OCCLUDED if field == "state" else array[field][at] + (1e-3, 0, 0, 0)
    (copied / sample.files["tracks"]).write_bytes(encode(channels()["tracks"], array))
    seal_again(copied)
    assert any(sample.index == finding.frame for finding in check(Dataset(copied)).findings)
