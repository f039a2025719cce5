"""A LiDAR in the report: its range image above its points from above stand for the picture that it does not have."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

import viewsphere as vs
from deadline import until
from seen import pixels
from viewsphere.labels.shared.drawing.scan_map import from_above
from viewsphere.report import write_report
from viewsphere.report.frames import frame_data
from viewsphere.report.pictures import NO_RETURN, Scale, layers, scan_picture, scan_size
from viewsphere.store import Dataset


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A post box that moves, by a camera and a LiDAR, at three instants."""
    out = tmp_path_factory.mktemp("scans") / "out"
    said = {
        "models": [{"source": "zoo:post_box", "category": "box", "motion": {"kind": "constant", "velocity": [0.5, 0, 0]}}],
        "viewpoints": {"azimuth": [30], "elevation": [10], "distance": 4},
        "time": {"frames": 3, "fps": 5},
        "rig": {
            "sensors": {
                "front": {},
                "top": {"lidar": {"rings": 12, "elevation": [-30, 6], "azimuth_step": 4, "range": [0.5, 50]}},
            }
        },
        "camera": {"size": [64, 48], "fov_deg": 50},
        "channels": ["rgb", "instances"],
        "formats": [],
        "splits": {"by": "sequence", "train": 1},
    }
    vs.generate(vs.Recipe.model_validate(said), out, workers=0)
    return Dataset(out)


def test_a_scan_has_a_picture_of_its_ranges_above_its_points(scans):
    sample = next(sample for sample in scans if sample.sensor == "top")
    frame, scale = frame_data(sample), Scale(640, 80, 320)
    assert frame["scan"] == [12, 90] and frame["size"] == [640, 640 + round(640 * 12 / 90)] == list(scan_size(sample))
    shown = scan_picture(sample, scale)
    assert shown.shape == (frame["size"][1], 640, 3)
    np.testing.assert_array_equal(shown[-640:], from_above(sample, 640))
    strip, rows = shown[:-640], sample.channels["lidar"]
    ring, column = ((np.array([rows["ring"], rows["column"]]) + 0.5) * [[len(strip) / 12], [640 / 90]]).astype(int)
    light = strip[ring, column].astype(int) @ [2, 7, 1]  # viridis: near is light
    order = np.argsort(rows["range"], kind="stable")
    assert (np.diff(light[order]) <= 10).all() and light[order[0]] > light[order[-1]] + 500
    assert (strip == NO_RETURN).all(axis=2).mean() == pytest.approx(1 - len(rows) / (12 * 90), abs=0.02)
    found = layers(sample, Scale(160, 80, 120))
    small = Image.open(io.BytesIO(base64.b64decode(found["rgb"].partition(",")[2])))
    assert set(found) == {"rgb"} and small.size == (160, round(frame["size"][1] / 4))


def test_a_camera_beside_it_is_as_ever(scans):
    sample = next(sample for sample in scans if sample.sensor == "front")
    frame = frame_data(sample)
    assert frame["scan"] is None and frame["size"] == [64, 48] and "rgb" in layers(sample, Scale(160, 80, 120))


@pytest.mark.slow
def test_the_page_plays_it_beside_its_camera(scans, open_page, settle, tmp_path):
    write_report(scans, tmp_path / "report.html")
    page = open_page(file=tmp_path / "report.html")
    top = page.locator(".sensors figure", has_text="top")
    assert page.locator(".sensors figure").count() == 2
    assert until(lambda: (np.abs(pixels(top) - NO_RETURN).max(axis=2) < 12).mean() > 0.3)
    before = pixels(top.locator("canvas"))
    for name in ("boxes", "masks"):
        page.click(f"#layers [data-layer={name}]")
        settle(page)
        assert (np.abs(pixels(top.locator("canvas")) - before) < 12).all(), name
    top.locator("button").click()
    page.wait_for_selector("text=12 rings × 90 columns")
