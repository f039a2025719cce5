"""A recording of AirSim, read by pandas and by a reader of its PFM: the same poses, depth and objects."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from proven import close, equal
from viewsphere.errors import UserError
from viewsphere.formats.airsim import FORMAT, KINDS, AirSim
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.preparing import Views
from viewsphere.run.exports.scope import scope_of

NED = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
AXES = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # of a body (ahead, right, down), of a camera's (right, down, ahead)


@pytest.fixture(scope="module", params=["stills", "videos"])
def both(request, tmp_path_factory):
    dataset = request.getfixturevalue(request.param)
    kinds = [kind for kind in KINDS if request.param == "videos" or kind != "disparity_normalized"]
    place = tmp_path_factory.mktemp("airsim")
    export(dataset.root, [{"airsim": {"images": kinds}}], output=place)
    return Views(dataset).for_format(FormatEntry(name="airsim", options={"images": kinds}), None), place / "airsim", kinds


def pfm(file):
    """As AirSim's Python client reads it: rows as they come."""
    with file.open("rb") as stream:
        assert stream.readline() == b"Pf\n"
        width, height = map(int, stream.readline().split())
        assert float(stream.readline()) < 0
        return np.frombuffer(stream.read(), "<f4").reshape(height, width)


def rgb(file):
    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[..., ::-1]


def test_log_and_images(both):
    dataset, folder, kinds = both
    logs = {file.parent.name: pd.read_csv(file, sep="\t") for file in folder.rglob("airsim_rec.txt")}
    colors = dict(line.split("\t") for line in (folder / "seg_rgbs.txt").read_text().splitlines())
    assert sum(map(len, logs.values())) == len(dataset)
    for sample in dataset:
        root = sample.sequence or sample.split
        log, time = logs[root], sample.time * 1000 if sample.sequence else sample.index
        assert log.columns.tolist()[:3] == ["VehicleName", "TimeStamp", "POS_X"]
        (row,) = log[(log.VehicleName == sample.sensor) & (log.TimeStamp == round(time))].to_dict("records")
        place = NED.T @ [row[f"POS_{axis}"] for axis in "XYZ"]
        close("airsim", "pandas: places", place, sample.camera.center, "m", atol=1e-12)
        turned = Rotation.from_quat([row[f"Q_{axis}"] for axis in "XYZW"]).as_matrix()
        close("airsim", "pandas, SciPy: rotations", NED.T @ turned @ AXES, sample.camera.R.T, "1", atol=1e-12)
        files = dict(zip(kinds, row["ImageFile"].split(";"), strict=True))
        for kind, name in files.items():
            vehicle, camera, number, nanos = name.removeprefix("img_").rpartition(".")[0].rsplit("_", 3)
            assert (vehicle, camera, int(number)) == (sample.sensor, "0", KINDS[kind][0])
            assert int(nanos) == round(time * 1e6)
        images = {kind: folder / root / "images" / name for kind, name in files.items()}
        equal("airsim", "OpenCV: pictures", rgb(images["scene"]), sample.rgb)
        for kind, channel in (("depth_planar", "depth"), ("depth_perspective", "depth_ray")):
            expected = np.where(np.isfinite(sample.channels[channel]), sample.channels[channel], 65504)
            equal("airsim", f"PFM: {channel}", pfm(images[kind]), expected)
        if "disparity_normalized" in kinds:
            expected = np.nan_to_num(sample.disparity)
            close("airsim", "PFM: disparity", pfm(images["disparity_normalized"]) * 160, expected, "px", atol=1e-5)
        equal("airsim", "OpenCV: infrared", rgb(images["infrared"]), np.dstack([sample.instances] * 3))
        found = rgb(images["segmentation"])
        for o in sample.objects:
            equal("airsim", "OpenCV: objects", (found == json.loads(colors[str(o.id)])).all(-1), sample.instances == o.id)


def test_settings(both):
    dataset, folder, kinds = both
    for sample in dataset:
        said = json.loads((folder / (sample.sequence or sample.split) / "settings.json").read_text())
        captured = said["Vehicles"][sample.sensor]["Cameras"]["0"]["CaptureSettings"]
        assert [one["ImageType"] for one in captured] == [KINDS[kind][0] for kind in kinds]
        focal = captured[0]["Width"] / 2 / np.tan(np.radians(captured[0]["FOV_Degrees"]) / 2)
        close("airsim", "settings: focal length", focal, sample.camera.intrinsics.fx, "px", atol=1e-9)


def test_a_lens_that_zooms_is_an_error(stills):
    tree = AirSim(stills, FORMAT.options())
    with pytest.raises(UserError, match="expected sensors of one lens each; found several in train"):
        tree.layout("train/settings.json", {'["a", 1]': 1, '["a", 2]': 1})


def test_what_it_needs_and_refuses(stills, videos):
    assert FORMAT.needs(FORMAT.options(images=("scene",))) == ()
    assert FORMAT.needs(FORMAT.options()) == ("depth", "instances")
    with pytest.raises(ValidationError):
        FORMAT.options(images=("lidar",))
    scope = scope_of(stills)
    assert list(FORMAT.refuses(scope, FORMAT.options())) == []
    told = "expected two rectified cameras (rig: {kind: stereo, baseline: 0.1}); found camera"
    assert list(FORMAT.refuses(scope, FORMAT.options(images=("disparity_normalized",)))) == [told]
    many = replace(scope, most_objects=300)
    assert list(FORMAT.refuses(many, FORMAT.options())) == ["expected at most 255 objects in a picture; found 300"]
    assert list(FORMAT.refuses(many, FORMAT.options(images=("scene", "depth_planar")))) == []
