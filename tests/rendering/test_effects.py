"""What cameras do to their pictures, against closed forms."""

from __future__ import annotations

import io
import math
from itertools import chain

import numpy as np
import pytest
from pydantic import ValidationError

from viewsphere import plugins
from viewsphere.codecs.srgb import linear
from viewsphere.errors import UserError
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.scene import Background, Effects, Finish, Smoother, ViewTransform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import steps_of
from viewsphere.rendering.effects.blur import SIGMA
from viewsphere.rendering.effects.chromatic_aberration import SPLIT
from viewsphere.rendering.effects.color import LUMINANCE, chroma_matrix, tone_table
from viewsphere.rendering.effects.depth_of_field import FAR, circle_radius, disc_area
from viewsphere.rendering.effects.motion_blur import STREAK, streak
from viewsphere.rendering.effects.noise import ELECTRONS, READ
from viewsphere.rendering.effects.vignetting import DARKEST
from viewsphere.rendering.finish import finished
from viewsphere.rendering.seen import Seen
from viewsphere.rendering.view import develop, to_bytes

H, W = 96, 160
LENS = Intrinsics(width=W, height=H, fx=200, fy=200, cx=W / 2, cy=H / 2)
Y, X = np.mgrid[:H, :W]
SPECS = {name: plugins.load(EffectSpec, name) for name in plugins.shipped("effects")}


def seen(inverse_depth=0.2, targets=None, distance=5.0) -> Seen:
    inverse = np.broadcast_to(np.float32(inverse_depth), (H, W)).astype(np.float32)
    return Seen(inverse, np.zeros((H, W), np.bool_) if targets is None else targets, LENS, distance)


def apply_effects(picture, effects, known: Seen) -> np.ndarray:
    """The picture with the effects on light."""
    steps = steps_of(effects)
    for step in (*steps.before, *steps.after):
        picture = step(picture, lambda: known)
    return picture


def noise_picture(channels=3) -> np.ndarray:
    picture = np.random.default_rng(0).random((H, W, channels), np.float32)
    if channels == 4:
        picture[..., :3] *= picture[..., 3:]
    return picture


def impulse() -> np.ndarray:
    picture = np.zeros((H, W, 3), np.float32)
    picture[H // 2, W // 2] = 1
    return picture


def moments(plane: np.ndarray) -> tuple[float, float, float, float, float]:
    """Sum, mean x and y, variance of x and y about them."""
    total = float(plane.sum(dtype=np.float64))
    x, y = float((plane * X).sum() / total), float((plane * Y).sum() / total)
    return total, x, y, float((plane * (X - x) ** 2).sum() / total), float((plane * (Y - y) ** 2).sum() / total)


AROUND = LENS.model_copy(update={"fx": W / math.tau, "fy": W / math.tau, "distortion": lens_parameters("equirectangular")})


@pytest.mark.parametrize("effects", [Effects(blur=1.0), Effects(motion_blur=1.0, motion_angle_deg=25.0)])
def test_blurs_continue_across_the_seam_of_a_full_turn(effects):
    """A turned camera sees a turned blur, and light at the seam lands at the other side."""
    known = Seen(*(getattr(seen(), name) for name in ("inverse_depth", "targets")), AROUND, 5.0)
    picture = noise_picture()
    whole = apply_effects(picture, effects, known)
    for turn in (1, 37, W // 2):
        turned = apply_effects(np.roll(picture, turn, axis=1), effects, known)
        assert np.array_equal(turned, np.roll(whole, turn, axis=1))
    dot = np.zeros((H, W, 3), np.float32)
    dot[H // 2, 0] = 1
    spread = apply_effects(dot, effects, known)[..., 0]
    assert spread.sum() == pytest.approx(1, abs=1e-5) and spread[:, W // 2 :].sum() > 0.3
    flat = apply_effects(dot, effects, seen())[..., 0]
    assert flat[:, W // 2 :].sum() == 0


def test_strength_0_is_the_same_array():
    assert steps_of(Effects()) == steps_of(Effects(seed=3, focus=2.0, motion_angle_deg=45, blur=0.0)) == ([], [], [])
    before, after, coded = steps_of(Effects(jpeg=0.5))
    assert (before, after, len(coded)) == ([], [], 1)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("name", SPECS)
def test_every_effect_changes_something_stays_in_range_and_repeats(name, channels):
    background = Background(transparent=channels == 4)
    finish = Finish(background=background, effects=Effects(**{name: 0.5}))
    light = np.random.default_rng(4).random((H, W, 4), np.float32)
    light[..., :3] *= light[..., 3:]
    known = seen(np.where(X < W / 2, 0.1, 0.4), targets=X > W / 2)
    out = finished(light, None, finish, lambda: known)
    assert out.dtype == np.uint8
    assert out.shape == (H, W, channels)
    assert not np.array_equal(out, develop(light, None, ViewTransform(), alpha=channels == 4))
    assert np.array_equal(out, finished(light, None, finish, lambda: known))
    if SPECS[name].stage != "file":
        picture = apply_effects(noise_picture(channels), finish.effects, known)
        assert picture.dtype == np.float32
        assert picture.min() >= -1e-6
        assert picture.max() <= 1 + 1e-5
        if channels == 4:
            assert (picture[..., :3] <= picture[..., 3:] + 1e-5).all()


def test_a_plain_finish_asks_for_no_truth():
    light = np.random.default_rng(5).random((H, W, 4), np.float32)

    def unasked() -> Seen:
        raise AssertionError

    assert np.array_equal(finished(light, None, Finish(), unasked), develop(light, None, ViewTransform()))
    with pytest.raises(AssertionError):
        finished(light, None, Finish(smoother=Smoother(kind="box")), unasked)


def test_effects_apply_in_the_order_of_the_light_path():
    """An edge is drawn, blurred, darkened, made noisy and recoloured, whatever the order in which a shot has them."""
    picture, known = noise_picture(), seen(np.where(X < W / 2, 0.1, 0.4), targets=X > W / 2)
    path = ["edge_highlight", "depth_of_field", "motion_blur", "blur", "chromatic_aberration", "vignetting"]
    path += ["shot_noise", "brightness"]
    together = apply_effects(picture, Effects(**dict.fromkeys(reversed(path), 0.3), seed=5), known)
    for name in path:
        picture = apply_effects(picture, Effects(**{name: 0.3}, seed=5), known)
    assert np.array_equal(together, picture)


def test_only_effects_that_read_surfaces_or_the_lens_compute_them():
    def unasked() -> Seen:
        raise AssertionError

    for name, spec in SPECS.items():
        (step,) = chain(*steps_of(Effects(**{name: 0.5})))
        picture = to_bytes(noise_picture()) if spec.stage == "file" else noise_picture()
        if spec.stage in ("objects", "lens"):
            with pytest.raises(AssertionError):
                step(picture, unasked)
        else:
            assert step(picture, unasked).shape == picture.shape


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"blur": 1.5}, r"scene\.effects\.blur: expected a number less than or equal to 1; found 1\.5"),
        ({"blur": "much"}, r"scene\.effects\.blur: expected .*; found 'much'"),
        ({"depth_of_field": 0.5, "focus": -1}, r"scene\.effects\.focus: expected a number greater than 0; found -1"),
        ({"blurr": 0.5}, "effect: 'blurr' is unknown; did you mean 'blur'"),
    ],
)
def test_effects_of_a_stored_shot_that_are_not_valid_are_refused(values, message):
    with pytest.raises(UserError, match=message):
        steps_of(Effects(**values))


@pytest.mark.parametrize("seed", [-1, 0.5, "1", True])
def test_the_seed_of_a_stored_shot_is_a_whole_number(seed):
    with pytest.raises(ValidationError, match="expected a whole number as seed, 0 or more; found"):
        Effects(seed=seed)


@pytest.mark.parametrize(
    "effects", [Effects(blur=0.6), Effects(motion_blur=0.6, motion_angle_deg=33), Effects(depth_of_field=1)]
)
def test_blurs_keep_the_light_and_plain_pictures(effects):
    known = seen(1 / 15)
    total, x, y, _, _ = moments(apply_effects(impulse(), effects, known)[..., 0])
    assert np.isclose(total, 1, atol=1e-4)
    assert np.allclose([x, y], [W // 2, H // 2], atol=1e-3)
    plain = np.full((H, W, 3), 0.37, np.float32)
    assert np.allclose(apply_effects(plain, effects, known), 0.37, atol=1e-5)


def test_the_gaussian_is_as_wide_as_the_table_says():
    out = apply_effects(impulse(), Effects(blur=0.7), seen())[..., 1]
    sigma = 0.7 * SIGMA * W
    _, _, _, vx, vy = moments(out)
    assert np.allclose([vx, vy], sigma**2 + 1 / 12, rtol=0.03)
    assert np.isclose(out[H // 2, W // 2 + 2] / out[H // 2, W // 2], math.exp(-2 / (sigma**2 + 1 / 12)), rtol=0.02)


@pytest.mark.parametrize("angle", [0, 30, 90, -45])
def test_the_streak_has_its_length_and_goes_up_to_the_right(angle):
    length = STREAK * W
    out = apply_effects(impulse(), Effects(motion_blur=1, motion_angle_deg=angle), seen())[..., 0]
    _, _, _, vx, vy = moments(out)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    covariance = float((out * (X - W // 2) * (Y - H // 2)).sum())
    assert np.allclose([vx, vy], [length**2 / 12 * c * c, length**2 / 12 * s * s], atol=0.26)
    assert np.isclose(covariance, -(length**2) / 12 * c * s, atol=0.26)
    assert np.isclose(streak(length, angle).sum(), 1, atol=1e-5)


def test_circles_of_confusion_are_those_of_a_thin_lens():
    """Aperture A and image distance v in pixels: diameter A v |1/z - 1/focus|."""
    focus, strength = 4.0, 0.5
    z = np.array([2.0, 3.0, 4.0, 8.0, 100.0])
    largest = strength * FAR * 640
    aperture = 2 * largest * focus / 600  # metres, of a lens with v = 600 pixels
    radius = circle_radius((1 / z).astype(np.float32), focus, largest)
    assert np.allclose(2 * np.abs(radius), aperture * 600 * np.abs(1 / z - 1 / focus), atol=1e-4)
    assert np.sign(radius).tolist() == [1, 1, 0, -1, -1]
    assert np.isclose(circle_radius(np.zeros(1, np.float32), focus, largest)[0], -largest)


@pytest.mark.parametrize("z", [2.5, 20.0, math.inf])
def test_an_impulse_becomes_its_disc(z):
    out = apply_effects(impulse(), Effects(depth_of_field=1), seen(1 / z))[..., 2]
    radius = abs(float(circle_radius(np.float32([1 / z]), 5.0, FAR * W)[0]))
    distance = np.hypot(X - W // 2, Y - H // 2)
    inside, outside = out[distance < radius - 0.5], out[distance > radius + 0.5]
    assert outside.max() < 1e-7
    assert np.allclose(inside, 1 / disc_area(np.float32([radius]))[0], rtol=1e-3)
    _, _, _, vx, vy = moments(out)
    assert np.allclose([vx, vy], radius**2 / 4, rtol=0.12)


def test_what_is_in_focus_stays_and_nothing_behind_spreads_over_it():
    sharp = (abs(X - 80) < 30) & (abs(Y - 48) < 25)
    picture = np.where(sharp, 0.2, 0.9)[..., None].repeat(3, axis=2).astype(np.float32)
    out = apply_effects(picture, Effects(depth_of_field=1), seen(np.where(sharp, 0.2, 0), targets=sharp))
    inner = (abs(X - 80) < 28) & (abs(Y - 48) < 23)
    assert np.allclose(out[inner], 0.2, atol=1e-5)
    outer = (abs(X - 80) > 32) | (abs(Y - 48) > 27)
    assert np.allclose(out[outer], 0.9, atol=1e-5)


def test_what_is_in_front_of_the_focus_has_a_soft_border_over_what_is_sharp():
    near = X < 80
    picture = np.where(near, 1.0, 0.0)[..., None].repeat(3, axis=2).astype(np.float32)
    out = apply_effects(picture, Effects(depth_of_field=1), seen(np.where(near, 0.5, 0.2)))[48, :, 0]
    radius = 1.5 * FAR * W
    assert (np.diff(out) <= 1e-4).all()
    assert out[80 - round(radius) - 3] > 0.999
    assert out[80 + round(radius) + 3] < 0.001
    assert 0.4 < (out[79] + out[80]) / 2 < 0.6
    assert np.abs(np.diff(out)).max() < 0.2


def test_large_discs_may_be_visited_sparsely(monkeypatch):
    from viewsphere.rendering.effects import depth_of_field as focus

    picture = np.random.default_rng(9).random((H, W, 3), np.float32)
    known = seen(np.where((X - 80) ** 2 + (Y - 48) ** 2 < 900, 0.2, 0.02))
    full = apply_effects(picture, Effects(depth_of_field=1), known)
    monkeypatch.setattr(focus, "TAPS", 2)
    sparse = apply_effects(picture, Effects(depth_of_field=1), known)
    assert np.abs(sparse - full).mean() < 0.02
    assert np.abs(sparse - picture).mean() > 0.1


def test_red_grows_and_blue_shrinks_about_the_principal_point():
    dot = np.zeros((H, W, 3), np.float32)
    dot[10:13, 139:142] = 1
    out = apply_effects(dot, Effects(chromatic_aberration=1), seen())
    for channel, scale in ((0, 1 + SPLIT), (1, 1.0), (2, 1 - SPLIT)):
        _, x, y, _, _ = moments(out[..., channel])
        assert np.allclose([x + 0.5 - W / 2, y + 0.5 - H / 2], [(140.5 - W / 2) * scale, (11.5 - H / 2) * scale], atol=0.02)
    assert np.array_equal(out[..., 1], dot[..., 1])


@pytest.mark.parametrize("strength", [0.25, 1.0])
def test_vignetting_falls_off_as_cos_4(strength):
    out = apply_effects(np.ones((H, W, 3), np.float32), Effects(vignetting=strength), seen())[..., 0]
    corner = math.hypot(W / 2, H / 2)
    tangent = math.sqrt((1 - (1 - DARKEST) * strength) ** -0.5 - 1)
    for y, x in ((0, 0), (48, 80), (20, 130), (95, 40)):
        r = math.hypot(x + 0.5 - W / 2, y + 0.5 - H / 2)
        assert np.isclose(out[y, x], math.cos(math.atan(tangent * r / corner)) ** 4, rtol=1e-4)
    assert np.isclose(out[0, 0], 1 - (1 - DARKEST) * strength, atol=0.02)


def test_noise_has_the_mean_and_the_variance_of_its_kind_at_every_level():
    levels = np.array([0.1, 0.3, 0.6])
    picture = np.repeat(levels, W * H // 3)[: H * W].reshape(H, W, 1).repeat(3, axis=2).astype(np.float32)
    for shot, read in ((0.5, 0.0), (0.0, 0.8), (0.4, 0.5)):
        out = apply_effects(picture, Effects(shot_noise=shot, read_noise=read, seed=7), seen())
        for level in levels:
            values = out[np.isclose(picture, level)].astype(float)
            variance = level * shot**2 / ELECTRONS + (READ * read) ** 2
            assert abs(values.mean() - level) < 5 * math.sqrt(variance / len(values))
            assert np.isclose(values.var(), variance, rtol=0.06)
    other = apply_effects(picture, Effects(shot_noise=0.4, read_noise=0.5, seed=8), seen())
    assert not np.array_equal(other, out)


def test_noise_of_pixels_and_channels_is_independent():
    out = apply_effects(np.full((H, W, 3), 0.4, np.float32), Effects(shot_noise=0.3, seed=1), seen()) - 0.4
    series = [out[:, 1:, 0], out[:, :-1, 0], out[:, 1:, 1], out[:, 1:, 2]]
    correlation = np.corrcoef([s.ravel() for s in series])
    assert np.abs(correlation - np.eye(4)).max() < 0.03


def test_colours_change_as_the_table_says():
    assert np.allclose(tone_table(1, 0)[[6554, 20000, 50000]], [6554 / 65535 * 2, 40000 / 65535, 1], atol=1e-4)
    codes = linear(np.arange(256) / 255).astype(np.float32)
    bytes_out = to_bytes(tone_table(0, 1)[np.round(codes * 65535).astype(int)].reshape(1, -1, 1).repeat(3, axis=2))[0, :, 0]
    expected = np.clip(np.round(127.5 + (np.arange(256) - 127.5) * 2), 0, 255)
    assert np.abs(bytes_out - expected).max() <= 1
    assert (np.diff(tone_table(-0.5, -0.7)) >= 0).all()


@pytest.mark.parametrize("saturation", [-1.0, -0.3, 0.0, 1.0])
@pytest.mark.parametrize("hue", [-1.0, 0.0, 0.2, 1.0])
def test_saturation_and_hue_keep_grey_and_luminance(saturation, hue):
    matrix = chroma_matrix(saturation, hue)
    assert np.allclose(matrix @ np.ones(3), 1)
    assert np.allclose(LUMINANCE @ matrix, LUMINANCE)


def test_saturation_and_hue_add_up():
    assert np.allclose(chroma_matrix(0, 0), np.eye(3))
    assert np.allclose(chroma_matrix(-1, 0.3), np.outer(np.ones(3), LUMINANCE))
    assert np.allclose(chroma_matrix(0, 0.4) @ chroma_matrix(0, 0.6), chroma_matrix(0, 1))
    assert np.allclose(chroma_matrix(0, 1) @ chroma_matrix(0, 1), np.eye(3))
    red, green, blue = chroma_matrix(0, 0.67) @ [0.5, 0.2, 0.2]
    assert green > max(red, blue)  # red turns over yellow to green


def test_lines_lie_on_borders_and_creases_of_targets_only():
    """A wedge in front of nothing: its ridge and its outline shine, its faces and the rest do not."""
    target = (abs(X - 80) < 50) & (abs(Y - 48) < 30)
    inverse = np.where(target, 0.2 - np.abs(X - 80) * 0.0015, 0)
    picture = np.full((H, W, 3), 0.3, np.float32)
    out = apply_effects(picture, Effects(edge_highlight=1), seen(inverse, targets=target))[..., 0]
    assert out[48, 80] > 0.8
    assert out[18 + 1, 60] > 0.8
    assert out[48, 31] > 0.8
    assert np.allclose(out[48, 45:65], 0.3, atol=1e-3)
    assert np.allclose(out[:10], 0.3)


def jpeg(pixels, strength):
    for step in steps_of(Effects(jpeg=strength)).coded:
        pixels = step(pixels, seen)
    return pixels


def test_jpeg_is_jpeg():
    from PIL import Image

    smooth = to_bytes((0.2 + 0.5 * np.stack([X / W, Y / H, (X + Y) / (W + H)], axis=2)).astype(np.float32))
    buffer = io.BytesIO()
    Image.fromarray(smooth).save(buffer, "JPEG", quality=50, subsampling="4:2:0")
    assert np.array_equal(jpeg(smooth, 0.5), np.asarray(Image.open(buffer)))
    errors = [np.abs(jpeg(smooth, s).astype(int) - smooth).mean() for s in (0.01, 0.5, 1.0)]
    assert errors[0] < errors[1] < errors[2]
    assert errors[0] < 1.5
    assert jpeg(smooth, 0) is smooth
    seen_through = np.concatenate([smooth, smooth[..., :1]], axis=2)
    assert np.array_equal(jpeg(seen_through, 0.9)[..., 3], seen_through[..., 3])
