"""The tests' own pictures are what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pictures import bricks, checkerboard, noise, normals_of, photograph, sunny, write_hdr


def test_a_checkerboard_begins_light_and_has_as_many_dark_cells():
    board = checkerboard(64, 8)
    assert (board[0, 0] == 220).all()
    assert (board[0, 8] == 40).all()
    assert board.mean() == 130


def test_bricks_have_no_seam():
    """Across the border neighbours differ no more than elsewhere."""
    for picture in (bricks(256).color, bricks(256).normal, bricks(256).roughness):
        values = picture.astype(float)
        for axis in (0, 1):
            steps = np.abs(values - np.roll(values, 1, axis))
            border = np.take(steps, 0, axis).mean()
            assert border <= np.max([np.take(steps, i, axis).mean() for i in range(1, 256)])


def test_normals_lean_away_from_what_is_higher():
    """A ridge down the middle: left of it the normal leans left; one across: above it the normal leans up."""
    x = np.arange(32)
    ridge = np.broadcast_to(np.exp(-(((x - 16) / 4) ** 2)), (32, 32))
    across, along = normals_of(ridge, 3.0), normals_of(ridge.T.copy(), 3.0)
    assert (across[:, 12, 0] < 100).all()
    assert (across[:, 20, 0] > 155).all()
    assert (along[12, :, 1] > 155).all()
    assert (along[20, :, 1] < 100).all()
    lengths = np.linalg.norm(across / 127.5 - 1, axis=-1)
    assert np.abs(lengths - 1).max() < 0.02


def test_noise_repeats():
    grain = noise(128, 8, np.random.default_rng(0))
    assert np.abs(grain).max() < 1.6
    assert np.abs(grain[:, 0] - grain[:, -1]).mean() < 2 * np.abs(np.diff(grain, axis=1)).mean()


@pytest.mark.parametrize("sun", [(40.0, 50.0), (200.0, 15.0), (300.0, 80.0)])
def test_the_sun_stands_where_it_should_with_the_irradiance_it_should(sun):
    height = 128
    lit, dark = sunny(height, sun, 3.0), sunny(height, sun, 0.0)
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)
    edges = math.pi * (0.5 - np.arange(height + 1) / height)
    texel = math.pi / height * -np.diff(np.sin(edges))
    extra = (lit - dark) * texel[:, None, None]
    np.testing.assert_allclose(extra.sum(axis=(0, 1)), 3.0 * np.array([1.0, 0.96, 0.9]), rtol=1e-4)
    row, column = np.unravel_index(extra[..., 0].argmax(), extra.shape[:2])
    angle = math.pi - (column + 0.5) / height * math.pi  # from +X to +Y
    seen = np.array([math.cos(angle), math.sin(angle), 0]) * math.cos(elevation[row]) + [0, 0, math.sin(elevation[row])]
    azimuth, above = np.radians(sun)
    true = [math.cos(above) * math.sin(azimuth), -math.cos(above) * math.cos(azimuth), math.sin(above)]
    assert math.degrees(math.acos(min(1.0, float(seen @ true)))) < 1.2 * 180 / height


def test_an_hdr_file_holds_the_picture_to_a_hundredth(tmp_path):
    picture = sunny(16)
    data = write_hdr(tmp_path / "sun.hdr", picture).read_bytes()
    head, _, body = data.partition(b"-Y 16 +X 32\n")
    assert head.startswith(b"#?RADIANCE\n")
    code = np.frombuffer(body, np.uint8).reshape(16, 32, 4).astype(float)
    back = (code[..., :3] + 0.5) * 2.0 ** (code[..., 3:] - 136)
    assert (np.abs(back - picture) <= 0.01 * picture.max(axis=-1, keepdims=True)).all()


def test_a_photograph_has_a_sky_and_a_meadow():
    picture = photograph(120, 90).astype(float)
    assert picture[:20, :, 2].mean() > picture[:20, :, 0].mean() + 40
    assert picture[-15:, :, 1].mean() > picture[-15:, :, 2].mean() + 40
    assert (photograph(120, 90, seed=1) != photograph(120, 90, seed=2)).any()
