"""Rows of a rolling shutter against whole pictures at the time of each row: triangles, labels and colours."""

from __future__ import annotations

import numpy as np
import pytest
from blurred_scenes import LENS, SCENES, SHUTTER, load, meshes, sharp

from viewsphere.engines import raster
from viewsphere.labels import observe
from viewsphere.labels.shared.context import LabelContext
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.model.shot import Shot
from viewsphere.truth.raster.visibility import rasterize

LABELS = (
    *("depth", "depth_ray", "instances", "parts", "normals", "normals_geometric", "nocs", "coordinates", "barycentrics"),
    "position",
)
PIXELS = {"wheel": 30.0, "car": 40.0, "pan": 60.0}
ROWS = (0, 1, 37, 64, 89, 90, 120, 143, 178, 179)


@pytest.fixture(scope="module")
def known():
    return meshes()


def rolling(shot: Shot, direction: str = "down") -> Shot:
    """The shot, read out row by row during the time for which its shutter was open."""
    lens = LENS.model_copy(update={"rolling": Rolling(readout=SHUTTER, direction=direction)})
    exposures = tuple(exposure and exposure.model_copy(update={"interval": 1.0}) for exposure in shot.exposures)
    return shot.model_copy(update={"shutter": 0.0, "exposures": exposures, "rig": Rig.single(lens)})


def moment_of(row: int, direction: str = "down") -> float:
    moment = ((row + 0.5) / LENS.height - 0.5) * SHUTTER
    return moment if direction == "down" else -moment


@pytest.mark.parametrize(("name", "direction"), [("wheel", "down"), ("car", "up"), ("pan", "down")])
def test_every_row_is_that_of_the_whole_picture_at_its_time(name, direction, known):
    shot = rolling(SCENES[name](PIXELS[name]), direction)
    stage, camera = raster.stage(shot, load(known)), shot.camera(0)
    seen = rasterize(stage.at(0), camera)
    found = observe(stage.at(0), camera, seen, LABELS)
    still_lens = shot.model_copy(update={"rig": Rig.single(LENS)})
    for row in range(LENS.height):
        moment = moment_of(row, direction)
        then, geometry = still_lens.camera_during(0, moment), stage.arrangements.during(0, moment).geometry
        assert then.rows is None
        whole = rasterize(geometry, then, keeps_exact=True)
        np.testing.assert_array_equal(seen.triangle[row], whole.triangle[row])
        np.testing.assert_array_equal(seen.exact[row], whole.exact[row])
        if row in ROWS:
            for label, array in observe(geometry, then, whole, LABELS).items():
                np.testing.assert_allclose(found[label][row], array[row], rtol=1e-6, atol=2e-6, err_msg=f"{label} {row}")
    instant = rasterize(stage.at(0), still_lens.camera(0))
    assert (instant.triangle != seen.triangle).mean() > 0.05


def picture(shot: Shot, known, names=("rgb",)):
    stage = raster.stage(shot, load(known))
    return stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), names)


@pytest.mark.parametrize(("name", "most"), [("pan", 0.35), ("car", 1.2), ("wheel", 3.0)])
@pytest.mark.slow
def test_colours_are_those_of_each_row(name, most, known):
    """Light and shadows are the instant's: where only the camera moves, colours equal those of whole pictures."""
    shot = SCENES[name](PIXELS[name])
    rolled = picture(rolling(shot), known)["rgb"].astype(float)
    off = []
    for row in ROWS:
        whole = picture(sharp(shot, moment_of(row)), known)["rgb"].astype(float)
        off.append(np.abs(rolled[row] - whole[row]))
    assert np.mean(off) < most
    assert np.percentile(off, 99) < 40 * most
    still = picture(sharp(shot, 0.0), known)["rgb"].astype(float)
    assert np.abs(rolled - still).mean() > 3 * np.mean(off)


def test_all_passes_are_painted(known):
    shot = rolling(SCENES["car"](40.0))
    names = ("rgb", "albedo", "shading", "residual", "emission", "roughness", "metallic")
    painted = picture(shot, known, names)
    assert painted.keys() == set(names)
    light = painted["albedo"] * painted["shading"] + painted["residual"]
    assert np.isfinite(light).all() and light.max() > 0.1


def test_an_object_alone_is_seen_in_rows_too(known):
    shot = rolling(SCENES["car"](40.0))
    geometry, camera = raster.stage(shot, load(known)).at(0), shot.camera(0)
    context = LabelContext(geometry, camera, rasterize(geometry, camera))
    alone = context.isolated(0).in_image(camera.width, camera.height)
    own = np.zeros((camera.height, camera.width), bool)
    height, width = alone.inverse_depth.shape
    own[alone.top : alone.top + height, alone.left : alone.left + width] = alone.inverse_depth > 0
    assert (own[context.instances.ids == 1]).all()
    box, whole = context.projected[0]
    rows, columns = np.nonzero(own)
    assert whole
    np.testing.assert_allclose(box, (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1), atol=1.0)
