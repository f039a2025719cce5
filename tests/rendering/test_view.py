"""ViewTransform transforms, white balance, composites and the sRGB curve."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.codecs.srgb import linear
from viewsphere.model.scene import ViewTransform
from viewsphere.rendering.view import EXPOSURE, KNEE, TRANSFORMS, agx_sigmoid, develop, srgb_bytes, to_bytes, to_display_linear
from viewsphere.rendering.white import XYZ_FROM_SRGB, white_balance, white_xyz

GREYS = np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 499)])


def display_linear(pixels):
    """Values in [0, 1] whose pictures are these sRGB bytes."""
    return linear(pixels / 255).astype(np.float32)


def opaque(colors) -> np.ndarray:
    """One row of pixels of these scene-linear colours."""
    colors = np.asarray(colors, np.float32).reshape(1, -1, 3)
    return np.concatenate([colors, np.ones_like(colors[..., :1])], axis=2)


def shown(colors, transform="standard", **view) -> np.ndarray:
    """Display-linear colours (N, 3) of exposed light, that is with the base exposure taken out."""
    light = opaque(np.asarray(colors) / EXPOSURE)
    return to_display_linear(light, None, ViewTransform(transform=transform, **view))[0]


def test_every_byte_survives_the_curve_there_and_back():
    pixels = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
    assert np.array_equal(to_bytes(display_linear(pixels)), pixels)
    assert np.array_equal(srgb_bytes()[np.round(linear(np.arange(256) / 255) * 65535).astype(int)], np.arange(256))


def test_backgrounds_are_shown_exactly_whatever_the_view():
    pixels = np.random.default_rng(0).integers(0, 256, (48, 37, 3), np.uint8)
    nothing = np.zeros((48, 37, 4), np.float32)
    for transform in TRANSFORMS:
        view = ViewTransform(exposure=3, temperature_k=3000, tint=0.5, transform=transform)
        assert np.array_equal(develop(nothing, display_linear(pixels).reshape(-1, 3), view), pixels)


def test_one_colour_stands_for_a_whole_background():
    one = np.array([[0.1, 0.2, 0.9]], np.float32)
    light = np.random.default_rng(1).random((20, 30, 4), np.float32)
    assert np.array_equal(develop(light, one, ViewTransform()), develop(light, np.repeat(one, 600, axis=0), ViewTransform()))


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_both_ways_to_bytes_agree(transform):
    rng = np.random.default_rng(2)
    light = rng.random((40, 50, 4), np.float32) * np.float32(2)
    background = rng.random((2000, 3), np.float32)
    view = ViewTransform(transform=transform, temperature_k=4500)
    for alpha in (False, True):
        slow = to_bytes(to_display_linear(light, background, view, alpha)).astype(int)
        assert np.abs(slow - develop(light, background, view, alpha)).max() <= 1


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_grey_stays_grey_and_more_light_is_never_darker(transform):
    values = shown(GREYS[:, None].repeat(3, axis=1), transform)
    assert np.ptp(values, axis=1).max() < 1e-6
    assert (np.diff(values[:, 0]) >= -1e-7).all()
    assert values[0, 0] == 0
    assert values.min() >= 0
    assert 0.97 < values[-1, 0] <= 1
    for channel in range(3):
        color = np.array([0.3, 0.3, 0.3]) + np.zeros((len(GREYS), 3))
        color[:, channel] = GREYS
        assert (np.diff(shown(color, transform)[:, channel]) >= -1e-6).all()


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_the_order_of_the_channels_never_changes(transform):
    rng = np.random.default_rng(3)
    light = np.sort(rng.random((4000, 3)) ** 3 * 2.0 ** rng.uniform(-8, 8, (4000, 1)), axis=1)
    assert (np.diff(shown(light, transform), axis=1) >= -1e-6).all()


def test_standard_is_the_light_itself_up_to_the_knee_and_a_smooth_shoulder_above():
    below = np.linspace(0, KNEE, 50)
    assert np.allclose(shown(below[:, None].repeat(3, axis=1))[:, 0], below, atol=1e-6)
    above = np.array([0.61, 1.0, 3.0, 50.0])
    y = (above - KNEE) / (1 - KNEE)
    assert np.allclose(shown(above[:, None].repeat(3, axis=1))[:, 0], KNEE + (1 - KNEE) * y / (1 + y), atol=1e-6)


def test_raw_clips():
    assert np.allclose(shown([[0.2, 1.5, 0.9]], "raw"), [[0.2, 1.0, 0.9]], atol=1e-6)


def test_filmic_keeps_middle_grey_and_every_hue():
    assert np.allclose(shown([[0.18, 0.18, 0.18]], "filmic"), 0.18, atol=1e-4)
    light = np.random.default_rng(4).random((500, 3)) * 4
    out = shown(light, "filmic")

    def middle(colors):
        low, mid, high = np.sort(colors, axis=1).T
        return (mid - low) / (high - low)

    spread = np.ptp(out, axis=1) > 0.05
    assert spread.sum() > 200
    assert np.allclose(middle(out)[spread], middle(light)[spread], atol=1e-3)


def wrensch(colors: np.ndarray) -> np.ndarray:
    """AgX as published: https://iolite-engine.com/blog_posts/minimal_agx_implementation, its polynomial of degree 6."""
    inset = np.array(
        [
            [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
            [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
            [0.0423756549057051, 0.0784336, 0.879142973793104],
        ]
    )
    x = (np.clip(np.log2(np.maximum(colors @ inset.T, 1e-9)), -12.47393, 4.026069) + 12.47393) / 16.5
    x = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    return np.clip(x @ np.linalg.inv(inset).T, 0, 1) ** 2.2


def test_agx_is_the_published_one():
    light = np.random.default_rng(5).random((2000, 3)) ** 2 * 2.0 ** np.random.default_rng(6).uniform(-6, 5, (2000, 1))
    error = np.abs(shown(light, "agx") - wrensch(light))
    assert error.max() < 0.02  # the polynomial itself is off by as much at the ends
    assert error.mean() < 0.003
    assert np.allclose(agx_sigmoid([0.18 * 2.0**-10, 0.18, 0.18 * 2.0**6.5]), [0, 0.5, 1], atol=1e-9)


def test_a_stop_of_exposure_doubles_the_light():
    light = np.random.default_rng(7).random((64, 3))
    assert np.allclose(shown(light, "raw", exposure=-1), shown(light / 2, "raw"), atol=1e-6)


def test_white_balance_is_nothing_at_6500_kelvin_and_makes_its_own_light_neutral_else():
    assert np.array_equal(white_balance(6500, 0), np.eye(3))
    for temperature in (1500, 2856, 4000, 6499.9, 9000, 20000):
        for tint in (-1, 0, 0.7):
            lamp = np.linalg.solve(XYZ_FROM_SRGB, white_xyz(temperature, tint))
            balanced = white_balance(temperature, tint) @ lamp
            assert np.allclose(balanced, balanced.mean(), atol=1e-9)
            assert np.isclose(XYZ_FROM_SRGB[1] @ balanced, 1, atol=1e-9)
    assert np.allclose(white_balance(6500.001, 0), np.eye(3), atol=1e-5)


def test_illuminant_a_is_where_the_cie_says():
    xyz = white_xyz(2856, 0)
    assert np.allclose(xyz[:2] / xyz.sum(), [0.4476, 0.4074], atol=0.006)


def test_warm_lamps_balanced_leave_daylight_blue_and_tint_is_magenta_above_0():
    red, _, blue = shown([[0.3, 0.3, 0.3]], "raw", temperature_k=3000)[0]
    assert blue > 1.5 * red
    red, green, blue = shown([[0.3, 0.3, 0.3]], "raw", tint=1.0)[0]
    assert green < min(red, blue)


def test_edges_have_no_fringe_on_any_background():
    """White over black and black over white at half coverage: half way in linear light, on all channels."""
    coverage = np.linspace(0, 1, 11, dtype=np.float32)
    for object_light in (0.0, KNEE / EXPOSURE):
        light = np.concatenate([coverage[:, None].repeat(3, 1) * object_light, coverage[:, None]], axis=1)[None]
        for behind in (0.0, 1.0):
            out = to_display_linear(light.astype(np.float32), np.full((1, 3), behind, np.float32), ViewTransform())[0]
            expected = behind + (object_light * EXPOSURE - behind) * coverage
            assert np.allclose(out, expected[:, None], atol=1e-6)


def test_transparent_pictures_hold_the_objects_own_colour_at_their_edges():
    coverage = np.array([0, 0.02, 0.5, 1], np.float32)
    color = np.array([0.5, 0.2, 0.1], np.float32)
    light = np.concatenate([coverage[:, None] * color, coverage[:, None]], axis=1)[None]
    out = develop(light, None, ViewTransform(), alpha=True)[0]
    assert out[:, 3].tolist() == [0, 5, 128, 255]
    assert out[0].tolist() == [0, 0, 0, 0]
    assert (out[1:, :3] == out[3, :3]).all()


def test_light_that_is_no_number_makes_no_noise():
    light = opaque(np.full((70, 3), 0.5))
    light[0, 3], light[0, 4, 3], light[0, 5, :3] = np.nan, np.nan, np.inf
    for transform in TRANSFORMS:
        view = ViewTransform(transform=transform)
        assert np.array_equal(develop(light, None, view)[0, 10:], develop(opaque(np.full((70, 3), 0.5)), None, view)[0, 10:])
