"""Skies baked to maps, against closed forms; the sun taken out of a picture; the sky seen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from called import called

from quick import quick
from viewsphere.engines.raster.records import PictureRays
from viewsphere.engines.raster.shading import kernels_block as rows
from viewsphere.engines.raster.shading.kernels_light import light_around
from viewsphere.engines.raster.sky.environment import bake_surrounding, sky_behind, sky_lights, without_sun
from viewsphere.errors import UserError
from viewsphere.model.scene import Daylight, Environment, Sky, Sun
from viewsphere.rendering.sky.daylight import air, daylight_picture
from viewsphere.rendering.sky.sun import sun_light

N = rows.BLOCK
lit_around = called(light_around)
HDRI = Path(__file__).parents[3] / "shared" / "models" / "hdri"


def directions(height):
    """Unit vectors (H, 2H, 3) and solid angles (H, 1) of an equirectangular picture, as Blender lays it out."""
    row = (0.5 - (np.arange(height) + 0.5) / height) * np.pi
    turn = np.pi - (np.arange(2 * height) + 0.5) / (2 * height) * 2 * np.pi
    x, y = np.outer(np.cos(row), np.cos(turn)), np.outer(np.cos(row), np.sin(turn))
    z = np.repeat(np.sin(row)[:, None], 2 * height, axis=1)
    return np.stack([x, y, z], axis=-1), (np.cos(row) * (np.pi / height) ** 2)[:, None]


def save(path: Path, pixels: np.ndarray) -> str:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, np.float32)}) as file:
        file.write(str(path))
    return str(path)


def seen(surrounding, normals, rough=None, bounce=1.0):
    """Radiance of a white matt surface with these normals (3, K), or of a perfect mirror lobe around them, (K, 3)."""
    normals = np.asarray(normals, float)
    b = np.zeros(rows.ROWS * N, np.float32)
    for axis, row in enumerate((rows.T0, rows.T1, rows.T2)):
        b[row : row + N] = np.resize(normals[axis], N)
    b[rows.T6 : rows.T6 + N] = -1 if rough is None else rough
    b[rows.BOUNCE : rows.BOUNCE + N] = bounce
    lit_around(N, surrounding, b)
    return np.stack([b[row : row + N] for row in (rows.T3, rows.T4, rows.T5)], axis=-1)[: normals.shape[1]].astype(float)


def sphere(rng):
    v = rng.normal(size=(3, N))
    return v / np.linalg.norm(v, axis=0)


def test_even_sky_lights_evenly(tmp_path):
    sky = Environment(file=save(tmp_path / "even.exr", np.full((32, 64, 3), [0.5, 1.0, 2.0])), strength=3)
    surrounding = bake_surrounding(sky, None, None)
    normals = sphere(np.random.default_rng(0))
    for rough in (None, 0.0, 0.13, 0.5, 0.77, 1.0):
        assert seen(surrounding, normals, rough) == pytest.approx(np.tile([1.5, 3.0, 6.0], (N, 1)), rel=2e-3)
    assert surrounding.up == pytest.approx([1.5, 3.0, 6.0], rel=2e-3)


def test_cosine_sky_has_its_closed_form(tmp_path):
    """Radiance max(0, d . x): irradiance over pi is (2 / 3 pi) (sin t + (pi - t) cos t) at angle t from x."""
    d, _ = directions(64)
    picture = np.repeat(np.maximum(d[..., :1], 0), 3, axis=2)
    surrounding = bake_surrounding(Environment(file=save(tmp_path / "c.exr", picture)), None, None)
    normals = sphere(np.random.default_rng(1))
    angle = np.arccos(normals[0])
    expected = 2 / (3 * math.pi) * (np.sin(angle) + (math.pi - angle) * np.cos(angle))
    assert seen(surrounding, normals)[:, 0] == pytest.approx(expected, abs=4e-3)


def test_mirror_shows_the_texel_in_its_direction(tmp_path):
    d, _ = directions(256)
    picture = 0.5 + 0.5 * d
    surrounding = bake_surrounding(Environment(file=save(tmp_path / "d.exr", picture)), None, None)
    normals = sphere(np.random.default_rng(2))
    assert seen(surrounding, normals, 0.0) == pytest.approx(0.5 + 0.5 * normals.T, abs=0.01)


@pytest.fixture(scope="module")
def glow(tmp_path_factory):
    """A picture that is brightest in one direction, and its file."""
    picture = np.exp(6 * (directions(128)[0] @ np.array([0.6, 0.0, 0.8]) - 1))[..., None] * [1.0, 0.5, 0.2] + 0.05
    return picture, save(tmp_path_factory.mktemp("sky") / "g.exr", picture)


@pytest.mark.parametrize("rough", quick([1 / 7, 2 / 7, 4 / 7, 6 / 7], 2 / 7, 6 / 7))
def test_prefiltered_levels_are_ggx_lobes(glow, rough):
    """Against a sum over all texels of the picture, weighted as Karis 2013: GGX of the half vector times the cosine."""
    d, area = directions(128)
    picture, file = glow
    surrounding = bake_surrounding(Environment(file=file), None, None)
    normals = sphere(np.random.default_rng(3))
    found = seen(surrounding, normals, rough)
    for k in range(0, N, 8):
        cosine = d @ normals[:, k]
        weight = np.where(cosine > 0, cosine / ((1 + cosine) / 2 * (rough**4 - 1) + 1) ** 2, 0) * area
        expected = (weight[..., None] * picture).sum(axis=(0, 1)) / weight.sum()
        assert found[k] == pytest.approx(expected, rel=0.06, abs=0.01)


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    """The file of a picture that is bright in its middle."""
    picture = np.full((64, 128, 3), 0.01)
    picture[24:40, 56:72] = 1.0
    return save(tmp_path_factory.mktemp("sky") / "m.exr", picture)


@pytest.mark.parametrize(("turn", "toward"), [(0, (1, 0, 0)), (90, (0, 1, 0)), (180, (-1, 0, 0)), (-90, (0, -1, 0))])
def test_middle_of_the_picture_lies_towards_x_and_turns_counter_clockwise(window, turn, toward):
    surrounding = bake_surrounding(Environment(file=window, rotation_deg=turn), None, None)
    assert seen(surrounding, np.array(toward)[:, None], 0.0)[0] == pytest.approx(1, rel=0.01)
    assert seen(surrounding, -np.array(toward)[:, None], 0.0)[0] == pytest.approx(0.01, rel=0.05)


def test_right_of_the_middle_is_clockwise(tmp_path):
    picture = np.full((64, 128, 3), 0.01)
    picture[:, 90:102] = 1.0  # a quarter to the right
    surrounding = bake_surrounding(Environment(file=save(tmp_path / "r.exr", picture)), None, None)
    assert seen(surrounding, np.array([[0], [-1], [0]]), 0.0)[0] == pytest.approx(1, rel=0.01)


def with_sun(height, where, radius_deg, radiance):
    d, area = directions(height)
    where = np.array(where) / np.linalg.norm(where)
    inside = d @ where > math.cos(math.radians(radius_deg))
    picture = np.full((height, 2 * height, 3), 0.2, np.float32)
    picture[inside] += np.array(radiance, np.float32)
    return picture, where, (inside * area).sum()


@pytest.mark.parametrize("radius", [0.6, 2.0])
def test_sun_is_taken_out_with_all_its_light(radius):
    picture, where, area = with_sun(512, (0.5, 0.3, 0.6), radius, (3e4, 2e4, 1e4))
    left, sun = without_sun(picture)
    assert sun is not None
    assert np.degrees(np.arccos(np.dot(sun.direction, where))) < 0.1
    assert sun.irradiance == pytest.approx(area * np.array([3e4, 2e4, 1e4]), rel=0.01)
    assert sun.angle_deg == pytest.approx(2 * radius, rel=0.15)
    assert left.max() < 1
    d, solid = directions(512)
    for normal in np.eye(3):
        cosine = np.maximum(d @ normal, 0) * solid
        before = (cosine[..., None] * picture).sum(axis=(0, 1))
        after = (cosine[..., None] * left).sum(axis=(0, 1)) + np.array(sun.irradiance) * max(np.dot(sun.direction, normal), 0)
        assert after == pytest.approx(before, rel=0.005)


def test_no_sun_in_an_even_sky_below_the_horizon_or_in_a_large_window():
    for picture in (
        np.full((64, 128, 3), 0.5, np.float32),
        with_sun(128, (0.5, 0.3, -0.6), 1.0, (3e4, 3e4, 3e4))[0],
        with_sun(128, (0.5, 0.3, 0.6), 25.0, (30, 30, 30))[0],
    ):
        left, sun = without_sun(picture)
        assert sun is None
        assert left is picture


def test_photographed_sun_turns_with_its_sky(tmp_path):
    picture, where, _ = with_sun(128, (1.0, 0.0, 1.0), 1.5, (2e4, 2e4, 2e4))
    file = save(tmp_path / "s.exr", picture)
    (sun,) = sky_lights(Environment(file=file, rotation_deg=90, strength=2), None, True)
    (plain,) = sky_lights(Environment(file=file), None, True)
    assert sun.direction == pytest.approx([-where[1], where[0], where[2]], abs=0.01)
    assert sun.irradiance == pytest.approx(2 * np.array(plain.irradiance))


def test_ground_shines_with_what_it_receives():
    white = Sky(zenith=(1, 1, 1), horizon=(1, 1, 1))
    (sun,) = sky_lights(white, Sun(elevation=30, strength=math.pi, color=(1, 1, 1)), True)
    surrounding = bake_surrounding(white, Sun(), np.array([0.5, 0.2, 0.1]), (sun,))
    assert surrounding.up == pytest.approx(1, abs=0.01)
    assert surrounding.below == pytest.approx(1.5 * np.array([0.5, 0.2, 0.1]), rel=0.01)
    down, up = np.array([[0], [0], [-1]]), np.array([[0], [0], [1]])
    assert seen(surrounding, down)[0] == pytest.approx(surrounding.below, rel=0.02)
    assert seen(surrounding, down, bounce=0)[0] == pytest.approx(0, abs=0.02)
    assert seen(surrounding, up, bounce=0)[0] == pytest.approx(1, abs=0.02)
    level = seen(surrounding, np.array([[1.0], [0], [0]]))[0]
    assert level == pytest.approx((1 + surrounding.below) / 2, rel=0.02)


def test_gradient_and_hemisphere_lights_have_their_closed_forms():
    """Zenith's share is 1 - (1 - z)^3: a level white floor gets 2 z of it, which is 9 / 10."""
    sky = Sky(zenith=(1, 0, 2), horizon=(0, 1, 2), strength=2)
    surrounding = bake_surrounding(sky, None, np.zeros(3), even=np.array([[0.5, 0.0, 0.0], [0.0, 7.0, 0.0]]))
    assert surrounding.up == pytest.approx([2 * 0.9 + 0.5, 2 * 0.1, 4], abs=0.02)
    mirrored = seen(surrounding, np.array([[0.6], [0], [0.8]]), 0.0)[0]
    assert mirrored == pytest.approx([2 * (1 - 0.2**3) + 0.5, 2 * 0.2**3, 4], abs=0.02)


def test_horizon_is_mirrored_without_a_step():
    surrounding = bake_surrounding(Sky(), None, np.zeros(3))
    z = np.linspace(-0.06, 0.06, N)
    light = seen(surrounding, np.stack([np.sqrt(1 - z * z) * 0.6, np.sqrt(1 - z * z) * 0.8, z]), 0.0)[:, 1]
    assert (np.diff(light) > -2e-3).all()
    assert np.diff(light).max() < 0.06
    assert light[0] < 0.01 and light[-1] > 0.85


def test_air_dims_and_reddens_a_low_sun_and_leaves_a_high_one():
    assert air(60, Daylight()) == pytest.approx(1, abs=1e-9)
    assert air(90, Daylight()) == pytest.approx(1.05, abs=0.03)
    last = air(60, Daylight())
    for elevation in (30, 15, 8, 3, 1):
        now = air(elevation, Daylight())
        assert (now < last).all()
        assert now[2] / now[0] < last[2] / last[0]
        last = now
    assert (air(40, Daylight(turbidity=8)) < air(40, Daylight(turbidity=2))).all()
    assert (air(40, Daylight(clouds=1)) == 0).all()
    assert sun_light(Daylight(clouds=1), Sun()) is None
    assert sun_light(Sky(), None) is None


def test_daylight_is_a_sky():
    picture = daylight_picture(30, Daylight(), 128)
    assert np.isfinite(picture).all() and (picture >= 0).all()
    zenith = picture[0].mean(axis=0)
    assert zenith[2] > 1.5 * zenith[0]  # blue
    brightest = np.unravel_index(picture.sum(axis=2).argmax(), picture.shape[:2])
    assert abs(brightest[1] - 128) <= 2 and abs((0.5 - (brightest[0] + 0.5) / 128) * 180 - 30) < 12  # around the sun
    overcast = daylight_picture(30, Daylight(clouds=1), 128)
    assert overcast[0, 0] == pytest.approx(3 * overcast[63, 0], rel=0.05)  # CIE: three times the horizon


@pytest.mark.parametrize("turbidity", [1.8, 3, 10])
@pytest.mark.parametrize("elevation", [0.1, 5, 45, 90])
def test_daylight_is_finite_everywhere(turbidity, elevation):
    for clouds in (0.0, 0.5, 1.0):
        picture = daylight_picture(elevation, Daylight(turbidity=turbidity, clouds=clouds), 32)
        assert np.isfinite(picture).all() and (picture >= 0).all() and picture.max() < 100


def look(width, height, focal, toward=(1.0, 0.0, 0.0)):
    forward = np.array(toward) / np.linalg.norm(toward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward]).astype(np.float32)
    lens = np.array([[1 / focal, 0, -width / 2 / focal], [0, 1 / focal, -height / 2 / focal]], np.float32)
    none = np.zeros((0, 3), np.float32)
    return PictureRays(np.zeros(3, np.float32), rotation, lens, none, np.uint32(width), np.float32(1 / focal), np.float32(1))


def background(view, surrounding, width, height):
    out = np.zeros((width * height, 4), np.float32)
    sky_behind(view, surrounding, out)
    return out.reshape(height, width, 4)


@pytest.fixture(scope="module")
def coloured(tmp_path_factory):
    """The file of a picture whose colours are directions."""
    return save(tmp_path_factory.mktemp("sky") / "b.exr", 0.5 + 0.5 * directions(256)[0])


@pytest.mark.parametrize(
    "toward",
    [
        pytest.param((-1, 0.001, 0.2), marks=pytest.mark.slow),
        pytest.param((1, 0, 0), marks=pytest.mark.slow),
        (0.3, -0.7, 0.6),
        pytest.param((0.1, 0.1, -0.9), marks=pytest.mark.slow),
    ],
)
def test_background_shows_the_picture_where_it_is(coloured, toward):
    surrounding = bake_surrounding(Environment(file=coloured, rotation_deg=30), None, None)
    view = look(160, 120, 100.0, toward)
    found = background(view, surrounding, 160, 120)
    x, y = np.meshgrid(np.arange(160) + 0.5, np.arange(120) + 0.5)
    rays = np.stack([(x - 80) / 100, (y - 60) / 100, np.ones_like(x)], axis=-1) @ view.rotation.astype(float)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    turned = np.stack([c * rays[..., 0] + s * rays[..., 1], c * rays[..., 1] - s * rays[..., 0], rays[..., 2]], axis=-1)
    assert found[..., :3] == pytest.approx(0.5 + 0.5 * turned, abs=0.012)
    assert (found[..., 3] == 1).all()


def test_background_takes_a_coarser_level_where_pixels_are_large(tmp_path):
    picture = np.zeros((256, 512, 3))
    picture[:, ::2] = 1.0
    surrounding = bake_surrounding(Environment(file=save(tmp_path / "l.exr", picture)), None, None)
    far = background(look(64, 48, 20.0), surrounding, 64, 48)[..., 0]
    assert far[20:28] == pytest.approx(0.5, abs=0.02)
    near = background(look(64, 48, 2000.0), surrounding, 64, 48)[..., 0]
    assert near.min() < 0.1 and near.max() > 0.9


def test_background_of_rays_without_direction_of_covered_pixels_and_of_samples():
    surrounding = bake_surrounding(Sky(), None, None)
    view = look(64, 4, 50.0)
    rays = np.tile(np.array([0.0, 0.1, 1.0], np.float32), (256, 1))
    rays[100] = np.nan
    found = background(view._replace(rays=rays), surrounding, 64, 4).reshape(-1, 4)
    assert (found[100] == 0).all()
    assert (np.delete(found, 100, axis=0)[:, 3] == 1).all()
    whole = background(view, surrounding, 64, 4).reshape(-1, 4)
    half = np.tile(np.array([0.2, 0.1, 0.3, 0.5], np.float32), (256, 1))
    half[:128, 3] = 1
    before = half.copy()
    sky_behind(view, surrounding, half)
    np.testing.assert_array_equal(half[:128], before[:128])
    np.testing.assert_allclose(half[128:], before[128:] + 0.5 * whole[128:], rtol=1e-6)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(4) + 0.5)
    samples = view._replace(places=np.stack([x, y], axis=-1).reshape(-1, 2).astype(np.float32)[::-1].copy())
    np.testing.assert_allclose(background(samples, surrounding, 64, 4).reshape(-1, 4)[::-1], whole, rtol=1e-6)


def test_sun_stands_in_daylight():
    sun = Sun(azimuth=90, elevation=20, angle_deg=3)
    surrounding = bake_surrounding(Daylight(), sun, None)
    at = np.array([math.cos(math.radians(20)), 0, math.sin(math.radians(20))])  # azimuth 90: towards +X
    found = background(look(101, 101, 400.0, tuple(at)), surrounding, 101, 101)[..., 1]
    assert found[50, 50] > 10
    wide = (found > 10).sum()
    assert wide == pytest.approx(math.pi * (400 * math.tan(math.radians(1.5))) ** 2, rel=0.1)


def test_missing_file_is_said(tmp_path):
    with pytest.raises(UserError, match=r"environment .*none\.exr: expected"):
        bake_surrounding(Environment(file=str(tmp_path / "none.exr")), None, None)


@pytest.mark.slow
@pytest.mark.skipif(not HDRI.is_dir(), reason="no models")
def test_real_skies_light_as_their_pictures():
    from viewsphere.rendering.sky.environment_file import read_environment

    for path in sorted(HDRI.iterdir()):
        sky = Environment(file=str(path))
        pixels = read_environment(path).pixels
        lights = sky_lights(sky, None, False)
        surrounding = bake_surrounding(sky, None, None)
        d, area = directions(pixels.shape[0])
        for normal in ((0, 0, 1), (1, 0, 0), (0, 0.6, 0.8), (0, -1, 0)):
            expected = ((np.maximum(d @ normal, 0) * area)[..., None] * pixels).sum(axis=(0, 1)) / math.pi
            found = seen(surrounding, np.array(normal, float)[:, None])[0]
            found = found + sum(np.array(s.irradiance) * max(np.dot(s.direction, normal), 0) / math.pi for s in lights)
            assert found == pytest.approx(expected, rel=0.04), path.name
