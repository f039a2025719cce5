"""Embree's rays prove the distances of panoramas, which have no depth along an axis."""

import numpy as np
import pytest

from sealing import seal_again
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.labels import channels
from viewsphere.store import encode

pytest.importorskip("embreex")

AROUND = {
    "scenes": {"count": 1, "objects": 6, "repeat": True, "layout": "scatter"},
    "viewpoints": {"azimuth": [0, 140], "elevation": 10, "distance": 0.3},
    "formats": [],
}


def rendered(folder, lens, **changes):
    generate(small_recipe(**{"camera": {"projection": lens, "size": [128, 64]}, **AROUND, **changes}), folder, workers=0)
    return Dataset(folder)


def scale(dataset, pixels):
    """Change the distances at pixels of frame 0 by 1 %."""
    sample = dataset[0]
    distance = np.array(sample.channels["depth_ray"])
    distance[pixels] *= np.float32(1.01)
    dataset.path(sample.files["depth_ray"]).write_bytes(encode(channels()["depth_ray"], distance))
    seal_again(dataset.root)


def off_surface(dataset):
    report = check(Dataset(dataset.root), rays=True)
    assert report.checked["surface"] == len(dataset) and "surface" not in report.not_run
    return [(finding.frame, finding.message) for finding in report.findings if finding.check == "surface"]


@pytest.mark.parametrize("lens", ["equirectangular", "cylindrical"])
@pytest.mark.slow
def test_a_changed_distance_of_a_panorama_is_found(tmp_path, lens):
    dataset = rendered(tmp_path / "out", lens, channels=["rgb", "depth_ray", "instances"])
    assert not off_surface(dataset)
    instances = dataset[0].channels["instances"]
    behind = np.zeros_like(instances, bool)
    behind[:, [*range(32), *range(96, 128)]] = True
    assert (behind & (instances > 0)).sum() > 100
    scale(dataset, behind & (instances > 0))
    ((frame, message),) = off_surface(dataset)
    assert frame == 0 and "points are not on the exported model" in message


def test_a_changed_distance_of_the_ground_behind_a_panorama_is_found(tmp_path):
    dataset = rendered(tmp_path / "out", "equirectangular", channels=["rgb", "depth_ray", "instances"])
    sample = dataset[0]
    scale(dataset, (sample.channels["instances"] == 0) & np.isfinite(sample.channels["depth_ray"]))
    ((frame, message),) = off_surface(dataset)
    assert frame == 0 and "points of the background are not where scenery and ground are" in message
