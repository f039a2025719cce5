"""The scripts of examples/, at small size: what they find is what the recipes say."""

import importlib.util
import json
import sys

import pytest

from small import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


def ran(name, monkeypatch, capsys, *arguments):
    """What an example prints."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
    module.main()
    return json.loads(capsys.readouterr().out)


def test_a_camera_is_calibrated_from_rendered_chessboards(tmp_path, monkeypatch, capsys):
    pytest.importorskip("cv2")
    found = ran("calibration", monkeypatch, capsys, tmp_path / "out", "--views", 12)
    exact, seen = found["camera"]["from_keypoints"], found["camera"]["from_pictures"]
    assert exact["views"] == 12 and seen["views"] >= 6
    assert exact["focal_share"] < 2e-4 and exact["principal_point_px"] < 0.05 and exact["distortion_share"] < 0.01
    assert found["camera"]["corners_px"] < 0.03 and seen["reprojection_px"] < 0.04
    assert seen["focal_share"] < 4e-4 and seen["principal_point_px"] < 0.4 and seen["distortion_share"] < 0.03
    assert found["camera"]["pnp_deg"] < 0.05
    assert found["stereo"]["pairs"] >= 3 and found["stereo"]["baseline_m"] < 1e-4 and found["stereo"]["rotation_deg"] < 0.05


def test_a_scene_is_reconstructed_from_rendered_pictures(tmp_path, monkeypatch, capsys):
    pytest.importorskip("pycolmap")
    found = ran("reconstruction", monkeypatch, capsys, tmp_path / "out", "--views", 20)
    assert found["registered"] == found["pictures"] == 20
    assert found["ate_share"] < 0.005 and found["reprojection_px"] < 0.6
