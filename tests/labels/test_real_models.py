"""Labels of real models; skipped where there are none."""

from pathlib import Path

import numpy as np
import pytest
from pycocotools import mask as coco
from test_object_labels import scene

from viewsphere.assets.cache import load_normalised
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.truth.raster.visibility import rasterize

MODELS = Path(__file__).parents[2].parent / "shared" / "models"
NAMES = ("car/NormalCar1.obj", "bicycle/Bicycle.obj", "chair/deck_chair.glb", "boat/Boat.obj")
LENS = Intrinsics(width=320, height=240, fx=330, fy=330, cx=160, cy=120)
STILL = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("distance", [2.5, 1.1])
def test_labels_of_a_real_model(name, distance, cache):
    if not (MODELS / name).is_file():
        pytest.skip("no real models here")
    spec = ModelSpec(key="m", source=str(MODELS / name), category="c", category_id=1, scale=1.5)
    mesh = load_normalised(spec, folder=cache)
    for azimuth, elevation in ((35, 20), (200, -10), (0, 90)):
        pose = Viewpoint(index=0, azimuth_deg=azimuth, elevation_deg=elevation, distance=distance)
        (o,), camera, geometry, *_ = scene([mesh], [STILL], pose, LENS, ground=elevation > 0)
        large = rasterize(geometry, camera, object_id=1, window=(-320, -240, 640, 480)).triangle >= 0
        assert o.visibility == o.area / large.sum()
        assert o.truncation == pytest.approx(1 - large[240:480, 320:640].sum() / large.sum(), abs=1e-15)
        again = coco.decode(coco.merge(coco.frPyObjects(o.polygons, 240, 320)))
        np.testing.assert_array_equal(again, o.mask)
        assert o.area == o.mask.sum() > 500
        x0, y0, x1, y1 = o.box2d_projected
        assert np.all(np.array(o.box2d) >= (x0 - 0.5, y0 - 0.5, 0, 0))
        assert np.all(np.array(o.box2d) <= (320, 240, x1 + 0.5, y1 + 0.5))
        if o.box2d_unclipped and o.box3d_in_front.all():
            low, high = o.box3d_pixels.min(axis=0), o.box3d_pixels.max(axis=0)
            assert np.all(o.box2d_unclipped[:2] >= low - 1e-6)
            assert np.all(o.box2d_unclipped[2:] <= high + 1e-6)
