"""The scripts of examples/, at small size: what they find is what the recipes say."""

import importlib.util
import json
import sys

import pytest

from small import ROOT
from torchvision_here import torchvision_here

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


def loaded(name):
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def ran(name, monkeypatch, capsys, *arguments):
    """What an example prints."""
    monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
    loaded(name).main()
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


def test_a_detector_learns_from_rendered_pictures(tmp_path, monkeypatch, capsys):
    torchvision_here()
    found = ran("detection", monkeypatch, capsys, tmp_path / "out", "--sizes", 8, 16, "--steps", 2, "--models", 5)
    assert [one["pictures"] for one in found["curve"]] == [8, 16] and found["test_pictures"] > 0
    assert all(0 <= one["ap"] <= one["ap50"] <= 1 for one in found["curve"])
    train, test = (set(found["models"][split]) for split in ("train", "test"))
    assert train and test and not train & test
    assert_the_truth_is_found(loaded("detection"), tmp_path / "out" / "detection" / "coco")


def assert_the_truth_is_found(example, coco):
    """A detector that says what the labels say is judged to be without fault, and one that says another category not to be."""
    import torch

    labels = example.labelled(coco, "test")
    pictures, true = example.pictures(coco, "test", labels), example.targets(labels)

    def ap(categories):
        said = iter(
            [{"boxes": t["boxes"], "labels": categories(t["labels"]), "scores": torch.ones(len(t["labels"]))} for t in true]
        )
        return example.judged(lambda _: [next(said)], pictures, labels)

    assert ap(lambda own: own) == {"ap": pytest.approx(1), "ap50": pytest.approx(1)}
    assert ap(lambda own: own % 4 + 1)["ap50"] < 0.5
