"""Skies in the cache: equal with it and without it, made once for equal files, made anew for others and for damaged entries."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from test_environment import save, with_sun

from scratch import scratch_cache
from viewsphere.caches import cache_of
from viewsphere.engines.raster.sky import environment
from viewsphere.engines.raster.sky.environment import bake_surrounding, sky_lights
from viewsphere.model.scene import Daylight, Environment, Sun
from viewsphere.rendering import kept_light
from viewsphere.rendering.sky import environment_file
from viewsphere.rendering.sky.environment_file import environment_notes

SUN = Sun(azimuth=30, elevation=25)


def sunny(radiance):
    return with_sun(256, (0.0, 0.6, 0.8), 1.5, radiance)[0]


@pytest.fixture(params=["photographed", "daylight"])
def sky(request, tmp_path):
    picture = sunny(4000.0)
    return Environment(file=save(tmp_path / "sky.exr", picture)) if request.param == "photographed" else Daylight(turbidity=3)


@pytest.fixture
def bakes(tmp_path, monkeypatch):
    """Counts the skies that are baked, with a cache of the test's own."""
    scratch_cache(monkeypatch, tmp_path / "cache")
    monkeypatch.setattr(environment, "kept_light", kept_light.kept_light)
    make, made = environment._maps, []
    monkeypatch.setattr(environment, "_maps", lambda *args: made.append(1) or make(*args))
    return made


def baked(sky, has_ground=True):
    """All arrays of a sky and its lights, as a new process bakes them."""
    environment._photographed.cache_clear()
    environment._daylight_maps.cache_clear()
    lights = sky_lights(sky, SUN, has_ground)
    numbers = [np.array([*light.direction, *light.irradiance, light.angle_deg]) for light in lights]
    return [*bake_surrounding(sky, SUN, np.full(3, 0.4) if has_ground else None, lights), *numbers]


def assert_equal(some, others):
    assert len(some) == len(others)
    for a, b in zip(some, others, strict=True):
        assert np.asarray(a).dtype == np.asarray(b).dtype
        np.testing.assert_array_equal(a, b)


@pytest.mark.slow
def test_a_sky_is_baked_once_and_equal_with_and_without_the_cache(sky, bakes, monkeypatch):
    made = baked(sky)
    assert len(bakes) == 1
    assert_equal(baked(sky), made)
    assert len(bakes) == 1
    assert len(sky_lights(sky, SUN, True)) == 2 - isinstance(sky, Daylight)
    monkeypatch.setattr(environment, "kept_light", lambda content, make, types: make())
    assert_equal(baked(sky), made)
    assert len(bakes) == 2


@pytest.mark.slow
def test_skies_with_and_without_ground_and_other_skies_differ(bakes, tmp_path):
    file = tmp_path / "sky.exr"
    for pixels in (sunny(4000.0), sunny(3000.0)):
        save(file, pixels)
        os.utime(file, (1e9, 1e9))
        for has_ground in (True, False):
            baked(Environment(file=str(file)), has_ground)
    assert len(bakes) == 4
    for daylight in (Daylight(turbidity=3), Daylight(turbidity=4), Daylight(turbidity=3, clouds=0.5)):
        baked(daylight)
    assert len(bakes) == 7


def test_equal_files_share_an_entry(bakes, tmp_path):
    for name in ("a.exr", "b.exr"):
        baked(Environment(file=save(tmp_path / name, np.full((32, 64, 3), 0.5))))
    assert len(bakes) == 1


@pytest.mark.parametrize("place", [0, 40, -40])
@pytest.mark.slow
def test_a_damaged_sky_is_baked_anew(sky, bakes, place):
    made = [np.array(values) for values in baked(sky)]  # copies, as the arrays themselves are mapped from the entry
    for entry in cache_of("light").iterdir():
        content = bytearray(entry.read_bytes())
        content[place] ^= 1
        entry.write_bytes(content)
    assert_equal(baked(sky), made)
    assert len(bakes) == 2


@pytest.mark.parametrize("limit", ["1", "5000"])
@pytest.mark.slow
def test_a_sky_that_the_limit_refuses_is_baked_each_time(sky, bakes, monkeypatch, limit):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", limit)
    assert_equal(baked(sky), baked(sky))
    assert len(bakes) == 2
    assert sum(entry.stat().st_size for entry in cache_of("light").glob("*.arrays")) <= int(limit)


def test_a_cache_that_cannot_be_written_costs_time_alone(sky, bakes, tmp_path, monkeypatch):
    made = baked(sky)
    (tmp_path / "file").touch()
    scratch_cache(monkeypatch, tmp_path / "file" / "no folder")
    assert_equal(baked(sky), made)
    assert len(bakes) == 2


def test_repairs_are_listed_from_the_cache_under_the_name_of_the_file(tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path / "cache")
    pixels = np.full((64, 128, 3), 2.0, np.float32)
    pixels[1, 1] = -3
    first, second, whole = (
        Path(save(tmp_path / name, p)) for name, p in (("a.exr", pixels), ("b.exr", pixels), ("c.exr", pixels * 0 + 1))
    )
    reads, read = [], environment_file.read_environment
    monkeypatch.setattr(environment_file, "read_environment", lambda path: reads.append(path) or read(path))
    assert environment_notes(first) == (f"{first}: set 1 texels with negative light to 0",)
    assert environment_notes(second) == (f"{second}: set 1 texels with negative light to 0",)
    assert environment_notes(whole) == environment_notes(whole) == ()
    assert reads == [first, whole]
