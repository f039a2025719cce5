"""Band-limited noise: its spectrum, its size, its independence."""

import numpy as np
import pytest

from viewsphere.composing.noise import WAVES, noise


def over_time(seed, highest, seconds=200.0, rate=50):
    made = noise(np.random.default_rng(seed), 3, highest)
    return np.array([made.values_at(i / rate) for i in range(int(seconds * rate))])


@pytest.mark.parametrize("highest", [0.5, 2.0])
def test_nothing_above_the_highest_frequency(highest):
    values = over_time(5, highest)
    window = np.hanning(len(values))[:, None]
    power = np.abs(np.fft.rfft(values * window, axis=0)) ** 2
    frequencies = np.fft.rfftfreq(len(values), 1 / 50)
    beyond, top = frequencies > highest + 0.02, (frequencies > highest * (1 - 1 / WAVES)) & (frequencies < highest)
    assert (power[beyond].sum(axis=0) < 1e-6 * power.sum(axis=0)).all()
    assert (power[top].sum(axis=0) > 0.05 * power.sum(axis=0)).all()


def test_size():
    values = over_time(6, 1.0, seconds=400)
    assert np.abs(values).max() <= 1
    np.testing.assert_allclose((values**2).mean(axis=0), 1 / (2 * WAVES), rtol=0.1)


def test_components_and_seeds_differ_and_equal_seeds_agree():
    values = over_time(7, 1.0)
    assert np.abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.2
    assert (over_time(7, 1.0, 1) == values[:50]).all()
    assert (over_time(8, 1.0, 1) != values[:50]).all()


def test_a_frequency_of_zero_stands_still():
    made = noise(np.random.default_rng(1), 2, 0.0)
    assert (made.values_at(0.0) == made.values_at(123.4)).all()
