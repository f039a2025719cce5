"""Pictures of 16 and 64 samples in a pixel: coverage beside truth's rasteriser, parts of light, and what is too large."""

from __future__ import annotations

import numpy as np
import pytest
from test_edges_behind_glass import LENSES, turned
from test_raster import camera, card, mesh_of, picture, stage_of, unlit

from shots import with_camera
from viewsphere.codecs.srgb import linear
from viewsphere.engines import raster
from viewsphere.engines.raster.staging import larger
from viewsphere.errors import RecipeError
from viewsphere.model.channel import LIGHT_PASSES
from viewsphere.model.scene import Background, Finish, Scene, Sun, ViewTransform
from viewsphere.truth.raster.visibility import rasterize

SIZE, FINE = 48, 16
DARK = Scene(sun=None, finish=Finish(background=Background(color=(0.0, 0.0, 0.0)), view=ViewTransform(transform="raw")))


def view_of(lens, size=SIZE):
    return camera(size, size, 40.0 * size / SIZE, distance=3.0, distortion=lens)


def slanted():
    return mesh_of(turned(card(1.3, 1.7), 17), unlit(color=(1.0, 1.0, 1.0, 1.0)))


@pytest.mark.parametrize("lens", LENSES)
def test_coverage_comes_ever_nearer_to_the_true_share(lens):
    """Twice as many samples each way nearly halve the error of a pixel that a straight edge divides."""
    view, mesh = view_of(LENSES[lens]), slanted()
    truth = rasterize(stage_of(mesh, DARK).at(0), larger(view, FINE)).triangle >= 0
    share = truth.reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))
    is_edge = (share > 0) & (share < 1)
    assert is_edge.sum() > 60
    errors = []
    for antialias in (4, 16, 64):
        shown = linear(picture(mesh, DARK, view, antialias=antialias)[..., 1] / 255)
        full = shown[~is_edge & (share == 1)]
        assert np.ptp(full) == 0
        assert not shown[share == 0].any()
        off = np.abs(shown / full[0] - share)[is_edge]
        errors.append((off.mean(), off.max()))
    mean, most = np.array(errors).T
    assert (mean < (0.11, 0.05, 0.025)).all()
    assert (most < (0.3, 0.15, 0.08)).all()
    assert (mean[:-1] > 1.6 * mean[1:]).all()


@pytest.mark.parametrize("lens", LENSES)
def test_a_larger_camera_sees_the_same_in_finer_pixels(lens):
    """A pixel's centre is the corner of four finer ones, and between two of three by three."""
    view, geometry = view_of(LENSES[lens]), stage_of(slanted(), DARK).at(0)
    once, thrice = rasterize(geometry, view), rasterize(geometry, larger(view, 3))
    assert np.array_equal(once.triangle, thrice.triangle[1::3, 1::3])
    assert np.allclose(once.inverse_depth, thrice.inverse_depth[1::3, 1::3], rtol=1e-6, atol=0)


def test_parts_of_light_are_means_of_those_of_finer_pixels():
    scene = Scene(sun=Sun(azimuth=60, elevation=40))
    mesh, view = mesh_of(turned(card(1.3, 1.7), 17)), view_of(None)

    def parts_of(view, antialias):
        stage = stage_of(mesh, scene, antialias=antialias)
        stage = stage.for_shot(with_camera(stage.shot, view, None))
        return stage.paint(0, 0, rasterize(stage.at(0), view), (*LIGHT_PASSES, "rgb"))

    found, fine = parts_of(view, 16), parts_of(larger(view, 2), 4)

    def mean(values):
        return values.reshape(SIZE, 2, SIZE, 2, 3).mean(axis=(1, 3))

    assert np.ptp(found["albedo"]) > 0.1
    assert np.allclose(found["albedo"], mean(fine["albedo"]), atol=1e-6)
    diffuse = fine["albedo"] * fine["shading"]
    assert np.allclose(found["albedo"] * found["shading"], mean(diffuse), atol=1e-5)
    whole = found["albedo"] * found["shading"] + found["residual"]
    assert np.allclose(whole, mean(diffuse + fine["residual"]), atol=1e-5)


def test_pictures_that_are_too_large_are_told_before_they_are_painted():
    stage = stage_of(slanted(), DARK, antialias=64)
    shot = stage.shot.model_copy(update={"rig": with_camera(stage.shot, view_of(None, 4097), None).rig})
    with pytest.raises(
        RecipeError, match=r"engine.antialias: 64 samples in a pixel want at most 4,096 pixels a side, found 4,097"
    ):
        raster.stage(shot, lambda _: slanted())
