"""What can be seen through is surface as well: where depth has glass, Embree finds it before what is behind."""

from dataclasses import replace

import pytest

from truth_scenes import cube
from viewsphere import Recipe, generate
from viewsphere.assets.exporting.export import export_glb
from viewsphere.assets.mesh import Material
from viewsphere.check import check
from viewsphere.store import Dataset

GLASS = Material(name="glass", base_color=(0.5, 0.5, 0.5, 0.5), alpha_mode="BLEND")


@pytest.mark.parametrize("sides", [6, 2])
def test_points_of_glass_lie_on_glass(tmp_path, sides):
    """On a cube of glass, or one of which the last two sides are, above and below."""
    whole = cube()
    glass = (whole.triangle_part >= 6 - sides).astype("int32")
    export_glb(replace(whole, materials=(Material(name="solid"), GLASS), triangle_material=glass), tmp_path / "cube.glb")
    recipe = {
        "models": [{"source": str(tmp_path / "cube.glb"), "category": "cube"}],
        "viewpoints": {"azimuth": [20, 100], "elevation": 40, "distance": 4},
        "camera": {"size": [64, 48], "fov_deg": 40},
        "scene": {"ground": "on"},
        "formats": [],
        "splits": {"by": "frame", "train": 1},
    }
    generate(Recipe.model_validate(recipe), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    assert all((sample.channels["instances"] == 1).sum() > 200 for sample in dataset)
    report = check(dataset, sample=None)
    assert report.ok and report.checked["surface"] == 2, report.findings
