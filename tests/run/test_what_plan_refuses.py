"""Mistakes that `viewsphere plan` tells, as `render` does, without reading a model."""

import pytest
import yaml

from command_line import viewsphere

LIDAR = {"rings": 4, "elevation": [-10, 0], "azimuth_step": 2}


@pytest.fixture
def planned(tmp_path):
    """Runs the command on a recipe of two files that are no meshes."""

    def run(**changes):
        for name in ("box.stl", "cup.stl"):
            (tmp_path / name).write_bytes(b"no mesh")
        models = [{"source": name, "category": "thing"} for name in ("box.stl", "cup.stl")]
        views = {"azimuth": [0], "elevation": [9], "distance": 2}
        said = {"models": models, "viewpoints": views, "formats": [], **changes}
        (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(said))
        return viewsphere("plan", tmp_path / "recipe.yaml", cwd=tmp_path)

    return run


def test_sidecars_that_cannot_be_read(planned, tmp_path):
    """Of all models at once, a line each; without them the same recipe passes."""
    box, cup = tmp_path / "box.stl.viewsphere.yaml", tmp_path / "cup.stl.viewsphere.yaml"
    box.write_text("axes: object\nkeypoint: {}\n")
    cup.write_text("keypoints: {points: {top: [0, 0, .nan]}}")
    found = planned()
    assert found.returncode == 2
    first, second = found.stderr.splitlines()
    assert f"{box}:2: keypoint" in first and f"{cup}:1: keypoints.points.top[2]" in second
    for sidecar in (box, cup):
        sidecar.write_text("axes: object")
    assert planned().returncode == 0


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"channels": ["depth"]}, "channels: expected rgb, which format coco needs; found depth: add it, or leave coco out"),
        (
            {"channels": ["rgb", "lidar"], "rig": {"sensors": {"front": {}, "top": {"lidar": LIDAR}}}},
            "rig.sensors.top.channels: expected rgb, which format coco needs; found lidar: leave coco out",
        ),
    ],
)
def test_formats_that_lack_a_channel(planned, changes, problem):
    found = planned(formats=["coco"], **changes)
    assert found.returncode == 2 and problem in found.stderr
    assert planned(formats=[], **changes).returncode == 0
