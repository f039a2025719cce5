"""Models of the YCB object set."""

from __future__ import annotations

import pytest

from asset_trees import faces_front, planned, pointer, put


@pytest.mark.parametrize("file", ["google_16k/textured.obj", "google_512k/textured.obj", "tsdf/textured.obj", "textured.obj"])
def test_a_model_has_its_name_axes_and_licence(tmp_path, file):
    put(tmp_path / "063-b_marbles" / file, pointer("+z", "-y", 0.05))
    put(tmp_path / "scripts" / "textured.obj", pointer("+z", "-y", 0.05))
    plan = planned(f"ycb:{tmp_path}")
    (spec,) = plan.model_specs
    assert (spec.key, spec.category, spec.real_size) == ("063-b_marbles", "marbles", "file")
    assert faces_front(spec, 0.05)
    assert plan.credits[spec.key].licence == "CC-BY-4.0"


def test_scans_come_before_coarse_reconstructions(tmp_path):
    put(tmp_path / "025_mug" / "tsdf" / "textured.obj", pointer("+z", "-y", 0.3))
    put(tmp_path / "025_mug" / "google_64k" / "textured.obj", pointer("+z", "-y", 0.1))
    assert faces_front(planned(f"ycb:{tmp_path}").model_specs[0], 0.1)
