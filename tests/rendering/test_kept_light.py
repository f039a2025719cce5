"""Baked light in the cache: found by all that it is made of."""

import numpy as np
import pytest
from PIL import Image

from scratch import scratch_cache
from viewsphere.caches import cache_of
from viewsphere.engines.raster.baking import _floor
from viewsphere.engines.raster.materials.surface import Lengths
from viewsphere.engines.raster.records import NO_LIGHTMAP, Lightmap
from viewsphere.model.scene import Ground
from viewsphere.rendering import kept_light

HERE = Lengths((0.0, 0.0, 0.0), 1.0)


def floor_of(path, pixels):
    Image.fromarray(pixels).save(path)
    return _floor(Ground(image=str(path), tile=4), HERE, HERE, 0)


def test_grounds_with_pictures_of_one_mean_differ(tmp_path):
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[:, :4] = 255
    left, right, again = (floor_of(tmp_path / f"{i}.png", p) for i, p in enumerate((picture, picture[:, ::-1], picture)))
    np.testing.assert_array_equal(left[0], right[0])
    np.testing.assert_allclose(left[1], right[1])
    assert left[2] == again[2] != right[2]
    assert repr(left[2]) != repr(right[2])


@pytest.fixture
def lit(tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path)
    made = []

    def make():
        made.append(1)
        return NO_LIGHTMAP._replace(nodes=np.arange(24, dtype=np.float32).reshape(2, 12))

    return made, make


def test_light_is_baked_once_for_equal_content(lit):
    made, make = lit
    content = ("x", 1.5, b"bytes", np.arange(3))
    first, second = (kept_light.kept_light(content, make, (Lightmap,)) for _ in range(2))
    assert len(made) == 1
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
        assert a.dtype == b.dtype


@pytest.mark.parametrize(
    "other",
    [
        ("y", 1.5, b"bytes", np.arange(3)),
        ("x", 1.5000001, b"bytes", np.arange(3)),
        ("x", 1.5, b"byteS", np.arange(3)),
        ("x", 1.5, b"bytes", np.arange(3).astype(np.int32)),
        ("x", 1.5, b"bytes", np.arange(3)[::-1]),
        ("x", 1.5, b"bytes", np.arange(3)[None]),
    ],
)
def test_other_content_is_baked_on_its_own(lit, other):
    made, make = lit
    kept_light.kept_light(("x", 1.5, b"bytes", np.arange(3)), make, (Lightmap,))
    kept_light.kept_light(other, make, (Lightmap,))
    assert len(made) == 2


def test_a_record_of_another_type_is_baked_anew(lit):
    made, make = lit
    kept_light.kept_light(("x",), make, (Lightmap,))
    kept_light.kept_light(("x",), make, ())
    assert len(made) == 2
    assert len(list(cache_of("light").iterdir())) == 1
