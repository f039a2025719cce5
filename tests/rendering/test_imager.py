"""The imager: noise, mosaic, colours, optics and exposure in closed form; and the recipes that may have it."""

import io
import itertools
import math
import re
import tarfile

import numpy as np
import pytest
from PIL import Image

from small import small_recipe
from viewsphere import Dataset, Recipe, generate, plan, plugins, render
from viewsphere.check import check
from viewsphere.codecs.srgb import encoded
from viewsphere.errors import RecipeError, UserError
from viewsphere.labels.shared.drawing.passes import picture
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.imager import SUNLIT, MountedImager
from viewsphere.plugins.format import FormatSpec
from viewsphere.preview.frame import draw_sample
from viewsphere.recipe.cameras.imager import PRESETS
from viewsphere.recipe.formats import FormatEntry
from viewsphere.rendering.imager.metering import KEY, Reading, Settings
from viewsphere.rendering.imager.optics import through_lens
from viewsphere.rendering.imager.sensor import developed, digital_numbers
from viewsphere.rendering.view import bytes_of_words
from viewsphere.run.opening import check_formats

PATTERNS = ("rggb", "bggr", "grbg", "gbrg")
QUIET = {"full_well": 1e9, "read_noise": 0.0, "bits": 16, "cos4": False}
"""Photon noise of 1 / 31,623 of white, which is 2 of 65,535."""


def imager(**fields):
    return MountedImager(**{**QUIET, **fields})


def flat(color, height=8, width=8):
    return np.broadcast_to(np.array(color, np.float32), (height, width, 3))


def lens(width=40, height=30, focal=25.0):
    return Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2 + 2.5, cy=height / 2 - 1)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("gain", [1, 4])
def test_a_thousand_flat_fields_give_gain_and_read_noise(name, gain):
    """The photon transfer curve (EMVA 1288): variance = K mean + K^2 s^2 + 1/12, in digital numbers above the black level."""
    sensor = MountedImager(**PRESETS[name])
    levels, size, each = np.linspace(0.02, 0.7, 20), 16, 50
    k = (sensor.white_level - sensor.black_level) / sensor.full_well * gain
    read = math.hypot(sensor.read_noise, sensor.adc_noise / gain)
    means, variances = [], []
    for i, level in enumerate(levels):
        light = flat((level, level, level), size, size)
        seeds = range(each * i, each * (i + 1))
        fields = np.array([digital_numbers(light, sensor, sensor.base_iso * gain, seed) for seed in seeds], np.float64)
        green = fields[:, 0::2, 1::2].reshape(each, -1) - sensor.black_level
        means.append(green.mean())
        variances.append(green.var(axis=0, ddof=1).mean())
    means, variances = np.array(means), np.array(variances)
    expected = k * means + (k * read) ** 2 + 1 / 12
    spread = expected * math.sqrt(2 / ((each - 1) * size * size / 4))  # standard error of a variance of normal numbers
    assert (np.abs(variances - expected) < 4.5 * spread).all()
    slope, intercept = np.polyfit(means, variances, 1, w=1 / spread)
    weighted = np.stack([means, np.ones_like(means)], axis=1) / spread[:, None]
    error = np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))
    assert abs(slope - k) < 4.5 * error[0]
    assert abs(intercept - (k * read) ** 2 - 1 / 12) < 4.5 * error[1]
    assert means == pytest.approx(levels * (sensor.white_level - sensor.black_level), rel=0.01)


def test_read_noise_of_a_dark_field_is_its_sigma():
    sensor = imager(full_well=4095.0, bits=12, black_level=200, read_noise=3.0, adc_noise=8.0)
    for gain in (1.0, 2.0, 8.0):
        dark = digital_numbers(flat((0, 0, 0), 200, 200), sensor, 100 * gain, 1).astype(float)
        k = 3895 / 4095 * gain
        assert dark.mean() == pytest.approx(200, abs=0.5)
        assert dark.std() == pytest.approx(k * math.hypot(3.0, 8.0 / gain), rel=0.02)


def test_noise_follows_from_its_seed_and_has_no_pattern():
    sensor, light = MountedImager(**PRESETS["phone"]), flat((0.3, 0.3, 0.3), 64, 64)
    first, again, other = (digital_numbers(light, sensor, 55, seed).astype(float) for seed in (4, 4, 5))
    assert (first == again).all()
    green, beside = (field[0::2, 1::2].ravel() - field[0::2, 1::2].mean() for field in (first, other))
    assert abs(np.corrcoef(green, beside)[0, 1]) < 0.15
    assert abs(np.corrcoef(green[1:], green[:-1])[0, 1]) < 0.15


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_mosaic_has_the_colour_of_each_filter(pattern):
    color = np.array([0.2, 0.5, 0.8])
    raw = digital_numbers(flat(color, 6, 7), imager(pattern=pattern), 100, 0)
    expected = [color["rgb".index(name)] * 65535 for name in pattern]
    for (y, x), value in zip(itertools.product(range(2), repeat=2), expected, strict=True):
        assert np.abs(raw[y::2, x::2] - value).max() < 12


def test_filters_take_the_colours_of_the_matrix_and_the_picture_has_those_of_the_light():
    sensor = imager(response=(0.4, 1.0, 0.7), matrix=((1.6, -0.4, -0.2), (-0.3, 1.9, -0.6), (-0.1, -0.5, 1.6)))
    color = np.array([0.5, 0.3, 0.2])
    raw = digital_numbers(flat(color), sensor, 100, 0)
    red, green, blue = np.array(sensor.response) * np.linalg.solve(np.array(sensor.matrix), color)
    assert raw[0, 0] / 65535 == pytest.approx(red, abs=2e-4)
    assert raw[0, 1] / 65535 == pytest.approx(green, abs=2e-4)
    assert raw[1, 1] / 65535 == pytest.approx(blue, abs=2e-4)
    assert developed(raw, sensor) == pytest.approx(flat(color), abs=1e-3)


def test_what_saturates_is_white_whatever_the_balance():
    sensor = imager(response=(0.4, 1.0, 0.7), full_well=5000.0)
    raw = digital_numbers(flat((3, 3, 3)), sensor, 100, 0)
    for white in ((1, 1, 1), (3.0, 1.0, 0.3), (0.4, 1.0, 1.9)):
        assert (developed(raw, sensor, white) == 1).all()


def test_white_balance_makes_the_colour_of_the_light_grey():
    warm = np.array([0.45, 0.3, 0.15], np.float32)
    sensor = imager(response=(0.4, 1.0, 0.7), white_balance="auto")
    white = Settings.of(sensor, Reading.of(flat(warm))).white
    picture = developed(digital_numbers(flat(warm), sensor, 100, 0), sensor, white)
    assert np.ptp(picture, axis=2).max() < 1e-3
    kelvin = Settings.of(imager(white_balance=3000.0), None).white
    assert kelvin[0] > 1 > kelvin[2] and Settings.of(imager(white_balance=6500.0), None).white == pytest.approx((1, 1, 1))


def kernel(rows):
    return np.array(rows) / 8


PUBLISHED = {
    "green": kernel([[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]]),
    "in_row": kernel([[0, 0, 0.5, 0, 0], [0, -1, 0, -1, 0], [-1, 4, 5, 4, -1], [0, -1, 0, -1, 0], [0, 0, 0.5, 0, 0]]),
    "opposite": kernel([[0, 0, -1.5, 0, 0], [0, 2, 0, 2, 0], [-1.5, 0, 6, 0, -1.5], [0, 2, 0, 2, 0], [0, 0, -1.5, 0, 0]]),
}
"""Figure 2 of Malvar, He and Cutler (2004)."""


def interpolated(mosaic, pattern, y, x, color):
    """One colour of one pixel, by the published kernels."""
    own = pattern[2 * (y % 2) + x % 2]
    if own == color:
        return mosaic[y, x]
    row = pattern[2 * (y % 2) : 2 * (y % 2) + 2]
    taps = PUBLISHED["green"] if color == "g" else PUBLISHED["opposite"]
    if own == "g":
        taps = PUBLISHED["in_row"] if color in row else PUBLISHED["in_row"].T
    return (mosaic[y - 2 : y + 3, x - 2 : x + 3] * taps).sum()


@pytest.mark.parametrize("pattern", PATTERNS)
def test_demosaicing_is_that_of_the_paper(pattern):
    raw = np.random.default_rng(1).integers(20000, 40000, (11, 12)).astype(np.uint16)
    picture = developed(raw, imager(pattern=pattern))
    for y, x, (channel, color) in itertools.product(range(2, 9), range(2, 10), enumerate("rgb")):
        expected = np.clip(interpolated(raw / 65535, pattern, y, x, color), 0, 1)
        assert picture[y, x, channel] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("pattern", "code"), [("rggb", "BG"), ("bggr", "RG"), ("grbg", "GB"), ("gbrg", "GR")])
def test_bilinear_demosaicing_is_that_of_opencv(pattern, code):
    cv2 = pytest.importorskip("cv2")
    raw = np.random.default_rng(2).integers(0, 65536, (24, 32)).astype(np.uint16)
    reference = cv2.cvtColor(raw, getattr(cv2, f"COLOR_Bayer{code}2RGB")).astype(float)
    picture = developed(raw, imager(pattern=pattern, demosaic="bilinear")).astype(float) * 65535
    assert np.abs(picture - reference)[2:-2, 2:-2].max() <= 1


@pytest.mark.parametrize("method", ["malvar", "bilinear"])
@pytest.mark.parametrize("size", [(1, 1), (1, 5), (2, 2), (3, 2), (9, 14)])
def test_grey_stays_grey_in_pictures_of_every_size(method, size):
    raw = np.full(size, 30000, np.uint16)
    picture = developed(raw, imager(demosaic=method))
    assert picture.shape == (*size, 3)
    assert picture == pytest.approx(np.full((*size, 3), 30000 / 65535), abs=1e-6)


@pytest.mark.parametrize("method", ["malvar", "bilinear"])
def test_even_changes_of_grey_are_interpolated_without_error(method):
    y, x = np.mgrid[:20, :30]
    ramp = (1000 + 900 * x + 700 * y).astype(np.uint16)
    picture = developed(ramp, imager(demosaic=method))[2:-2, 2:-2]
    assert picture == pytest.approx(np.repeat(ramp[2:-2, 2:-2, None] / 65535, 3, axis=2), abs=1e-6)


def test_natural_vignetting_is_cos4_of_the_angle():
    camera = lens()
    y, x = np.mgrid[:30, :40] + 0.5
    tangent2 = ((x - camera.cx) ** 2 + (y - camera.cy) ** 2) / 25.0**2
    out = through_lens(flat((1, 2, 3), 30, 40), imager(cos4=True), camera)
    assert out == pytest.approx(((1 + tangent2) ** -2)[..., None] * np.array([1, 2, 3]), rel=1e-5)


def test_vignetting_is_its_polynomial_with_the_farthest_corner_at_1():
    camera = lens()
    y, x = np.mgrid[:30, :40] + 0.5
    r2 = ((x - camera.cx) ** 2 + (y - camera.cy) ** 2) / (22.5**2 + 16**2)
    out = through_lens(flat((1, 1, 1), 30, 40), imager(vignetting=(-0.3, -0.1, 0.05)), camera)
    assert out[..., 0] == pytest.approx(1 - 0.3 * r2 - 0.1 * r2**2 + 0.05 * r2**3, rel=1e-5)


def test_chromatic_aberration_enlarges_red_and_blue_about_the_axis():
    camera = lens()
    x = np.arange(40) + 0.5
    light = np.repeat(np.broadcast_to(x, (30, 40))[..., None], 3, axis=2).astype(np.float32)
    out = through_lens(light, imager(chromatic_aberration=(0.02, -0.01)), camera)
    for channel, shift in ((0, 0.02), (1, 0.0), (2, -0.01)):
        expected = (x - camera.cx) / (1 + shift) + camera.cx
        assert out[5, 2:-2, channel] == pytest.approx(expected[2:-2], abs=1e-4)


def test_bloom_keeps_the_light_and_spreads_its_share():
    light = np.zeros((41, 61, 3), np.float32)
    light[20, 30] = 100
    out = through_lens(light, imager(bloom=0.25, bloom_size=0.03), lens(61, 41))
    assert out.sum() == pytest.approx(300, rel=1e-5)
    assert out[20, 30, 0] > 75 and out[20, 33, 0] > out[20, 36, 0] > 0


def test_flares_are_off_by_default_and_mirrored_about_the_axis():
    light, camera = np.zeros((60, 80, 3), np.float32), Intrinsics(width=80, height=60, fx=70, fy=70, cx=40, cy=30)
    light[20, 25] = 1000
    assert (through_lens(light, imager(), camera) == light).all()
    ghosts = through_lens(light, imager(flare=0.1), camera)[..., 1] - light[..., 1]
    y, x = np.unravel_index(ghosts.argmax(), ghosts.shape)
    assert (y, x) == (39, 54)
    assert ghosts[30:, 40:].sum() > 0.95 * ghosts.sum()


def test_exposure_follows_iso_12232():
    """H = 0.65 L t / N^2 lux seconds; 78 / S saturates."""
    sensor = imager(exposure=0.01, iso=400.0, f_number=4.0)
    chosen = Settings.of(sensor, None)
    assert chosen.scale == pytest.approx(0.65 * SUNLIT * 0.01 / 16 / (78 / 400), rel=1e-9)
    assert (chosen.seconds, chosen.iso) == (0.01, 400)
    assert Settings.of(imager(exposure=0.01, gain_db=12.0), None).iso == pytest.approx(100 * 10**0.6)


@pytest.mark.parametrize("level", [1e-4, 0.02, 1.0, 30.0])
def test_automatic_exposure_maps_grey_to_the_key_until_its_limits(level):
    sensor = imager(longest=0.02, most_iso=800.0)
    chosen = Settings.of(sensor, Reading.of(flat((level, level, level))))
    assert chosen.seconds <= 0.02 and 100 <= chosen.iso <= 800
    assert chosen.iso == 100 or chosen.seconds == 0.02  # gain only follows when the exposure is as long as it may be
    if chosen.iso < 800:
        assert chosen.scale * level == pytest.approx(KEY, rel=1e-6)
    else:
        assert chosen.scale * level < KEY
    brighter = Settings.of(imager(compensation=1.0), Reading.of(flat((1, 1, 1))))
    assert brighter.scale == pytest.approx(2 * KEY, rel=1e-6)


def test_neither_the_sun_nor_darkness_decides_the_exposure():
    light = flat((0.5, 0.5, 0.5), 20, 20).copy()
    plain = Reading.of(light)
    light[0, 0], light[1, :4] = 1e6, 0
    assert abs(Reading.of(light).key - plain.key) < 0.1
    assert Reading.of(np.zeros((4, 4, 3), np.float32)) is None
    dark = Settings.of(imager(most_iso=800.0), None)
    assert (dark.seconds, dark.iso) == (1 / 30, 800)


SLOW = ("blend",)
"""Formats that start a program of minutes, and hold no pictures."""

VIEWS = {"azimuth": [30, 75], "elevation": 20, "distance": 1.0}


def recipe_of(imager="webcam", channels=("rgb", "bayer"), **changes):
    camera = {"fov_deg": 40, "size": [96, 72], **({} if imager is None else {"imager": imager})}
    return small_recipe(**{"viewpoints": VIEWS, "camera": camera, "channels": list(channels), "formats": [], **changes})


def test_labels_and_light_are_the_same_with_an_imager():
    names = ["rgb", "rgb_linear", "depth", "instances", "normals"]
    for plain, taken in zip(render(recipe_of(None, names)), render(recipe_of("phone", names)), strict=True):
        assert all(np.array_equal(plain.channels[name], taken.channels[name]) for name in names[1:])
        assert repr(plain.objects) == repr(taken.objects)
        assert not np.array_equal(plain.rgb, taken.rgb)


def test_pictures_of_a_frame_agree_and_repeat():
    names = ["rgb", "rgb16", "bayer", "rgb_linear"]
    first, again = list(render(recipe_of(channels=names))), list(render(recipe_of(channels=names)))
    assert not np.array_equal(first[0].bayer, first[1].bayer)
    for sample, other in zip(first, again, strict=True):
        assert np.abs(bytes_of_words(sample.rgb16).astype(int) - sample.rgb).max() <= 1
        assert all(sample.channels[name].tobytes() == other.channels[name].tobytes() for name in names)
        assert (sample.bayer.dtype, sample.bayer.shape) == (np.uint16, (72, 96))
        assert sample.bayer.max() <= 4095


def test_a_quiet_imager_shows_the_light():
    quiet = {"full_well": 1e9, "read_noise": 0, "bits": 16, "cos4": False, "demosaic": "bilinear", "compensation": -2}
    (sample, *_) = render(recipe_of(quiet, ["rgb16", "rgb_linear"]))
    chosen = Settings.of(sample.finish.imager, Reading.of(sample.rgb_linear))
    smooth = np.abs(np.diff(sample.rgb_linear, axis=1, prepend=0)).max(axis=2) < 0.002
    smooth &= np.roll(smooth, -1, 1) & np.roll(smooth, 1, 0) & np.roll(smooth, -1, 0)
    expected = encoded(np.clip(sample.rgb_linear * chosen.scale, 0, 1)) * 65535
    errors = np.abs(sample.rgb16 - expected)[smooth]
    assert len(errors) > 200 and np.median(errors) < 65535 / 256


def test_sensors_of_a_rig_have_noise_of_their_own_and_lidars_no_imager():
    sensors = {"a": {}, "b": {}, "top": {"lidar": {"rings": 4, "elevation": [-20, 0]}}}
    names = {}
    recipe = recipe_of(channels=["bayer"], rig={"sensors": sensors})
    shot = next(iter(plan(recipe).shots(lambda spec, step=None: np.zeros((8, 3)))))
    assert [sensor.imager is None for sensor in shot.rig.sensors] == [False, False, True]
    for sample in render(recipe):
        names.setdefault(sample.sensor, []).append(sample.channels.get("bayer"))
    assert not np.array_equal(names["a"][0], names["b"][0])
    assert np.abs(names["a"][0].astype(int) - names["b"][0]).mean() < 60


@pytest.mark.slow
def test_stored_pictures_are_those_in_memory_whatever_the_workers(tmp_path):
    recipe = recipe_of(channels=["rgb", "bayer", "instances"], files={"rgb": "png"})
    generate(recipe, tmp_path / "one", workers=0)
    generate(recipe_of(channels=["rgb", "bayer", "instances"], shot_frames=1), tmp_path / "two", workers=2)
    for sample, stored, other in zip(render(recipe), Dataset(tmp_path / "one"), Dataset(tmp_path / "two"), strict=True):
        for name in ("rgb", "bayer"):
            assert np.array_equal(sample.channels[name], stored.channels[name])
            assert np.array_equal(sample.channels[name], other.channels[name])
        assert stored.files["bayer"].endswith(".png")
    report = check(Dataset(tmp_path / "one"), repaint=None)
    assert report.ok, report.findings


def test_effects_of_the_lens_come_before_the_sensor():
    """Blurred light has the noise of its own photons; blurred noise would be far smaller."""
    sharp, soft = (
        next(iter(render(recipe_of("phone", ["bayer"], scene={"effects": effects})))) for effects in ({}, {"blur": 0.5})
    )
    rough = [np.abs(np.diff(sample.bayer[1:30:2, ::2].astype(float), axis=1)).mean() for sample in (sharp, soft)]
    assert rough[1] > 0.3 * rough[0] > 0


def test_recipes_without_an_imager_are_written_as_before():
    plain = recipe_of(None)
    assert "imager" not in plain.model_dump_json() and "imager" not in plan(recipe_of(None, ["rgb"])).rig.model_dump_json()
    again = Recipe.model_validate(recipe_of({"preset": "drone", "iso": 200}).model_dump(mode="json"))
    assert again.camera.imager == recipe_of({"preset": "drone", "iso": 200}).camera.imager


WRONG = (
    ("phon", "'phon' is unknown; did you mean 'phone'"),
    (3, "expected phone, webcam"),
    ({}, "expected preset, or full_well and read_noise; found no full_well"),
    ({"preset": "x"}, "preset: 'x' is unknown"),
    ({"preset": "phone", "iso": 0}, "iso: expected a number greater than 0; found 0"),
    ({"preset": "phone", "iso": math.nan}, "iso: expected a finite number; found nan"),
    ({"preset": "phone", "iso": 20}, "iso: expected base_iso, 55, or more; found 20"),
    ({"preset": "phone", "iso": "high"}, "iso: 'high' is unknown. Valid: auto"),
    ({"preset": "phone", "iso": 100, "gain_db": 6}, "gain_db: expected iso or gain_db; found both"),
    ({"preset": "phone", "read_noise": -1}, "read_noise: expected a number greater than or equal to 0"),
    ({"preset": "phone", "exposure": -0.1}, "exposure: expected a number greater than 0"),
    ({"preset": "phone", "black_level": 1023}, "black_level: expected less than 1023"),
    ({"preset": "phone", "bits": 32}, "bits: expected"),
    ({"preset": "phone", "pattern": "rgbg"}, "pattern: 'rgbg' is unknown"),
    ({"preset": "phone", "response": [1, 2, 1]}, "response: expected 1 for green"),
    ({"preset": "phone", "matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "matrix: expected rows that add up to 1"),
    ({"preset": "phone", "matrix": [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}, "matrix: expected a matrix with an inverse"),
    ({"preset": "phone", "vignetting": [-1]}, "vignetting: expected shares above 0"),
    ({"preset": "phone", "white_balance": "cloudy"}, "white_balance: 'cloudy' is unknown"),
    ({"preset": "phone", "white_balance": 100}, "white_balance: expected a number greater than or equal to 1500"),
    ({"preset": "phone", "fps": 25}, "fps: 'fps' is unknown"),
)


@pytest.mark.parametrize(("wrong", "message"), WRONG)
def test_wrong_imagers_are_one_line(wrong, message):
    with pytest.raises(RecipeError) as error:
        recipe_of(wrong)
    assert str(error.value).startswith("camera.imager") and message in str(error.value)
    assert len(str(error.value).splitlines()) == 1


BESIDE = (
    ({"scene": {"effects": {"shot_noise": 0.5}}}, "scene.effects.shot_noise: expected 0 beside camera.imager"),
    ({"scene": {"effects": {"read_noise": [0, 0.5]}}}, "scene.effects.read_noise: expected 0 beside camera.imager"),
    ({"scene": {"effects": {"vignetting": 0.5}}}, "scene.effects.vignetting: expected 0 beside camera.imager"),
    ({"scene": {"effects": {"chromatic_aberration": 0.5}}}, "scene.effects.chromatic_aberration: expected 0 beside"),
    ({"variations": {"a": {}, "b": {"effects": {"vignetting": 1}}}}, "variations.b.effects.vignetting: expected 0"),
    ({"scene": {"view": "filmic"}}, "scene.view.transform: expected none beside camera.imager"),
    ({"scene": {"view": {"exposure": 1}}}, "scene.view.exposure: expected none beside camera.imager"),
    ({"scene": {"background": "transparent"}}, "channels: expected rgb beside camera.imager"),
)


@pytest.mark.parametrize(("changes", "message"), BESIDE)
def test_what_an_imager_rules_out_is_one_line(changes, message):
    with pytest.raises(RecipeError) as error:
        plan(recipe_of(channels=["rgb"], **changes))
    assert message in str(error.value) and len(str(error.value).splitlines()) == 1


def test_a_mosaic_needs_an_imager_and_a_full_turn_has_none():
    with pytest.raises(RecipeError, match=r"channels\[1\]: expected camera.imager beside bayer"):
        plan(recipe_of(None))
    camera = {"projection": "equirectangular", "size": [64, 32], "imager": "drone"}
    with pytest.raises(RecipeError, match=r"camera.imager: expected none, as its lens and its mosaic would show the seam"):
        plan(small_recipe(viewpoints=VIEWS, camera=camera, channels=["rgb"], formats=["native"]))


@pytest.mark.parametrize(
    ("exposure", "time", "message"),
    [
        (0.05, {"fps": 25}, "exposure: expected at most a frame's time, 0.04 s at 25 frames a second; found 0.05"),
        (0.03, {"fps": 25, "shutter": 0.5}, "exposure: expected the time that time.shutter is open, 0.02 s; found 0.03"),
    ],
)
def test_exposures_fit_the_frames(exposure, time, message):
    with pytest.raises(RecipeError, match=message):
        plan(recipe_of({"preset": "phone", "exposure": exposure}, time={"frames": 4, **time}))


def test_an_open_shutter_is_the_exposure():
    planned = plan(recipe_of("phone", time={"frames": 4, "fps": 20, "shutter": 0.25}))
    assert planned.rig.sensors[0].imager.exposure == pytest.approx(0.0125)
    assert plan(recipe_of("phone", time={"frames": 4, "fps": 50})).rig.sensors[0].imager.longest_exposure == 0.02


def test_webdataset_and_huggingface_hold_the_mosaic(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    recipe = recipe_of(channels=["rgb", "bayer"], formats=["webdataset", "huggingface"], splits={"train": 1.0})
    generate(recipe, tmp_path / "out", workers=0)
    mosaics = [sample.bayer for sample in Dataset(tmp_path / "out")]
    names, rows = [], []
    for file in sorted((tmp_path / "out" / "webdataset").rglob("*.tar")):
        with tarfile.open(file) as archive:
            names += [
                (name, np.load(io.BytesIO(archive.extractfile(name).read())))
                for name in archive.getnames()
                if ".bayer." in name
            ]
    for file in sorted((tmp_path / "out" / "huggingface").rglob("*.parquet")):
        rows += parquet.read_table(file, columns=["bayer"]).to_pylist()
    assert len(names) == len(rows) == len(mosaics) == 4
    for mosaic, (_, array), row in zip(mosaics, sorted(names), rows, strict=True):
        assert array.dtype == np.uint16 and np.array_equal(array, mosaic)
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(row["bayer"]["bytes"]))), mosaic)


def answers(channels, **changes):
    """Each shipped format that can be written, with its refusal of a data set of these channels, or None."""
    planned = plan(recipe_of(channels=channels, **changes))
    for name in plugins.shipped("formats"):
        if plugins.load(FormatSpec, name).writer is not None:
            try:
                check_formats(planned, [FormatEntry(name=name)], planned.recipe.channels)
            except UserError as error:
                yield name, str(error)
            else:
                yield name, None


def exported(folder, channels, formats):
    """The files of each export of a data set."""
    generate(recipe_of(channels=channels, formats=formats, splits={"train": 1.0}), folder, workers=0)
    return {name: sorted(file for file in (folder / name).rglob("*") if file.is_file()) for name in formats}


@pytest.mark.slow
def test_formats_refuse_a_mosaic_alone_with_words_or_hold_it_or_take_no_pictures(tmp_path):
    told = dict(answers(["bayer", "depth", "instances"]))
    for name, refusal in told.items():
        if refusal is not None:
            assert re.search(rf"{name}.*expected|expected.*format {name}", refusal) and "found" in refusal, refusal
            assert len(refusal.splitlines()) == 1
    assert "bayer alone: add rgb" in told["native"] and "bayer alone: add rgb" in told["csv"]
    formats = [name for name, refusal in told.items() if refusal is None and name not in SLOW]
    alone = exported(tmp_path / "alone", ["bayer", "depth", "instances"], formats)
    colors = exported(tmp_path / "colors", ["rgb", "depth", "instances"], formats)
    for name in formats:
        if not any(b"bayer" in file.read_bytes() for file in alone[name]):
            files = [[str(f.relative_to(tmp_path / n)) for f in x[name]] for n, x in (("alone", alone), ("colors", colors))]
            assert files[0] == files[1], name


def test_formats_refuse_a_sensor_that_keeps_the_mosaic_alone():
    sensors = {"a": {"channels": ["rgb"]}, "b": {"channels": ["bayer"]}}
    told = dict(answers(["rgb", "bayer"], rig={"sensors": sensors}))
    assert all("expected" in told[name] for name in ("native", "csv", "coco")) and told["webdataset"] is None


def test_an_imager_stands_behind_a_rolling_shutter():
    camera = {"fov_deg": 40, "size": [96, 72], "rolling": {"readout": 0.04}}
    quiet = {"full_well": 1e9, "read_noise": 0.0, "bits": 16, "cos4": False, "black_level": 0, "exposure": 1e-4, "iso": 100}
    moving = {
        "models": [
            {"source": "zoo:post_box", "scale": {"length": 0.18}, "motion": {"kind": "constant", "velocity": [3, 0, 0]}}
        ],
        "time": {"frames": 2, "fps": 20},
        "viewpoints": {"azimuth": [0], "distance": 1.0},
    }
    names = ["rgb", "rgb_linear", "instances", "depth"]
    plain = render(recipe_of(channels=names, **moving, **{"camera": camera}))
    taken = render(recipe_of(channels=[*names, "bayer"], **moving, **{"camera": {**camera, "imager": quiet}}))
    still = render(
        recipe_of(channels=[*names, "bayer"], **moving, **{"camera": {"fov_deg": 40, "size": [96, 72], "imager": quiet}})
    )
    for one, other, fixed in zip(plain, taken, still, strict=True):
        assert all(np.array_equal(one.channels[name], other.channels[name]) for name in names[1:])
        assert repr(one.objects) == repr(other.objects)
        scale = [
            np.median(s.bayer[::2, 1::2][s.instances[::2, 1::2] == 0] / s.rgb_linear[::2, 1::2, 1][s.instances[::2, 1::2] == 0])
            for s in (other, fixed)
        ]
        assert scale[0] == pytest.approx(scale[1], rel=0.02)
        assert not np.array_equal(other.instances, fixed.instances) and not np.array_equal(other.bayer, fixed.bayer)


def test_lenses_at_one_place_have_one_imager_and_noise_of_their_own():
    camera = {"fov_deg": 40, "size": [96, 72], "imager": "phone"}
    twins = {
        "same": {"fov_deg": 40, "size": [96, 72]},
        "wide": {"projection": "cylindrical", "size": [96, 72], "span": {"horizontal": 90}},
    }
    recipe = recipe_of(channels=["rgb", "bayer"], camera={**camera, "also": twins})
    assert len({sensor.imager for sensor in plan(recipe).rig.sensors}) == 1
    shown = {}
    for sample in render(recipe):
        shown.setdefault(sample.sensor, []).append(sample.bayer)
    assert list(shown) == ["camera", "same", "wide"]
    alone = [sample.bayer for sample in render(recipe_of(channels=["rgb", "bayer"], camera=camera))]
    assert all(map(np.array_equal, shown["camera"], alone))
    difference = shown["same"][0].astype(int) - shown["camera"][0]
    assert 0 < np.abs(difference).mean() < 30 and abs(difference.mean()) < 1
    assert shown["wide"][0].shape == (72, 96)


def test_a_mosaic_is_drawn_as_greys_up_to_its_largest_number():
    (sample, *_) = render(recipe_of())
    drawn = picture("bayer", sample.bayer)
    assert (drawn.shape, drawn.dtype) == ((72, 96, 3), np.uint8)
    expected = sample.bayer * (255 / sample.bayer.max())
    assert np.abs(drawn - expected[..., None]).max() <= 0.51
    assert draw_sample(sample).shape[2] == 3
