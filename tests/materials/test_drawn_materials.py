"""Materials that are drawn from numbers."""

import hashlib

import numpy as np
import pytest

from viewsphere import materials, plugins
from viewsphere.errors import UserError
from viewsphere.materials.shared.kernels_noise import add_noise
from viewsphere.materials.shared.noise import cells, noise, wave
from viewsphere.plugins.material import MaterialSpec

NAMES = plugins.names("materials")
SIZE = 192


@pytest.fixture(scope="module")
def made():
    """Of each material its default and two draws."""
    whole = {name: plugins.load(MaterialSpec, name).surface for name in NAMES}
    return {name: [whole[name](None, SIZE), *(materials.surface(name, seed, SIZE) for seed in (1, 2))] for name in NAMES}


TARGETS = {
    "asphalt": (0.07, 0.07, 0.07),
    "brick": (0.36, 0.16, 0.12),
    "concrete": (0.4, 0.4, 0.4),
    "grass": (0.06, 0.11, 0.02),
    "marble": (0.64, 0.64, 0.64),
    "tile": (0.67, 0.67, 0.67),
    "wood": (0.30, 0.16, 0.08),
}
"""Measured mean linear albedo."""


@pytest.mark.parametrize("name", TARGETS)
def test_materials_are_as_bright_as_measured(made, name):
    mean = made[name][0].color.mean(axis=(0, 1))
    assert np.abs(mean / TARGETS[name] - 1).max() < 0.3, mean


@pytest.mark.parametrize("name", NAMES)
def test_a_surface_is_one_that_can_be(made, name):
    for surface in made[name]:
        assert surface.color.shape == (SIZE, SIZE, 3)
        assert surface.roughness.shape == surface.height.shape == (SIZE, SIZE)
        assert {surface.color.dtype, surface.roughness.dtype, surface.height.dtype} == {np.dtype(np.float32)}
        assert 0 <= surface.metallic <= 1
        assert 0.05 < surface.metres < 10
        if not surface.metallic:  # metals send back nearly all light
            assert surface.color.min() >= 0.005 and surface.color.max() <= 0.85
            assert 0.015 <= surface.color.mean() <= 0.8
        assert surface.roughness.min() > 0 and surface.roughness.max() <= 1
        assert 0 <= np.ptp(surface.height) < 0.1
        np.testing.assert_allclose((surface.normals**2).sum(axis=-1), 1, atol=1e-5)
        assert surface.normals[..., 2].min() > 0


def seam(values, axis):
    """How much more texels differ across the edges than anywhere within, as a share."""
    steps = np.abs(np.diff(values, axis=axis, append=np.take(values, [0], axis=axis))).mean(axis=1 - axis)
    return (steps[-1] + 1e-6) / (steps[:-1].max() + 1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_there_is_no_seam(made, name):
    """Boards, bricks and tiles end where the square does, and differ from those across as from any others."""
    for surface in made[name]:
        for values in (surface.color.mean(axis=-1), surface.height / (np.ptp(surface.height) or 1), surface.roughness):
            assert max(seam(values, 0), seam(values, 1)) < 1.3


def test_a_seam_would_be_seen():
    """Of less than the whole square."""
    assert seam(noise(192, 3, 0, 4)[:150], 0) > 2


@pytest.mark.parametrize("name", NAMES)
def test_seeds_decide(made, name):
    first, second = made[name][1:]
    again = materials.surface(name, 1, SIZE)
    assert again.color.tobytes() == first.color.tobytes()
    assert again.height.tobytes() == first.height.tobytes()
    assert again.roughness.tobytes() == first.roughness.tobytes()
    assert not np.array_equal(first.color, second.color)
    assert materials.metres(name, 1) == first.metres
    assert materials.word(name) == " ".join(materials.word(name).split()) != ""


def test_a_larger_map_shows_the_same_with_more_detail():
    for name in ("brick", "marble", "planks"):
        small, large = (materials.surface(name, 3, size).color for size in (64, 256))
        mean = large.reshape(64, 4, 64, 4, 3).mean(axis=(1, 3))
        assert np.corrcoef(mean.reshape(-1), small.reshape(-1))[0, 1] > 0.8, name


def test_an_unknown_material_is_told_with_the_nearest_one():
    with pytest.raises(UserError, match=r"^material: 'wod' is unknown; did you mean 'wood'\? Valid: asphalt, .*$"):
        materials.surface("wod", 0, 64)


def test_noise_is_the_same_everywhere():
    """Bytes, not numbers: nothing is used that processors round differently."""
    field = noise(96, (3, 5), 7, 4, 0.6)
    found = cells(96, 9, 3)
    digest = hashlib.sha256(b"".join(part.tobytes() for part in (field, *found, wave(5 * field)))).hexdigest()
    assert digest[:16] == "228ab5cc56e4b1ce"


def test_noise_is_perlins():
    """0 on the lattice, mean 0, and within its bounds; four times as fine a map runs through the same values."""
    out = np.zeros((256, 256), np.float32)
    add_noise(out, 4, 4, 1.0, 11)
    corners = out[63::64, 63::64] / 4 + out[:-63:64, 63::64] / 4 + out[63::64, :-63:64] / 4 + out[:-63:64, :-63:64] / 4
    assert np.abs(corners).max() < 0.02
    assert abs(out.mean()) < 0.1
    assert 0.5 < np.abs(out).max() < 1.01
    assert np.abs(np.diff(out, axis=0)).max() < 0.1


def test_cells_are_nearest_points():
    """The border is 0 somewhere near every cell's rim, distances are ordered, and every cell has one number."""
    found = cells(200, 10, 5)
    assert (found.second >= found.nearest).all()
    assert found.nearest.max() < 1.5
    assert 80 <= len(np.unique(found.chance)) <= 100
    sides = found.chance != np.roll(found.chance, 1, axis=1)
    assert found.border[sides].max() < 0.2
