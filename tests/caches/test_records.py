"""Records come back equal, and nothing else is made plain."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

from viewsphere.caches.arrays import read_arrays, write_arrays
from viewsphere.rendering.kept_light import pack_records, unpack_records


class Inner(NamedTuple):
    values: np.ndarray
    scale: np.float32


@dataclass(frozen=True, eq=False)
class Outer:
    inner: Inner
    parts: tuple[Inner, ...]
    name: str
    nothing: None = None
    is_on: bool = True


def test_records_come_back_equal(tmp_path):
    inner = Inner(np.arange(3, dtype=np.int32), np.float32(0.1))
    content = pack_records(Outer(inner, (inner, Inner(np.empty((0, 2)), np.float32(np.inf))), "x"))
    write_arrays(tmp_path / "a", content.about, content.arrays)
    back = unpack_records(read_arrays(tmp_path / "a"), (Inner, Outer))
    assert isinstance(back, Outer)
    assert (back.name, back.nothing, back.is_on) == ("x", None, True)
    assert back.inner.values.tolist() == [0, 1, 2]
    assert back.inner.values.dtype == np.int32
    assert (type(back.inner.scale), back.inner.scale) == (np.float32, np.float32(0.1))
    assert back.parts[1].values.shape == (0, 2)
    assert np.isinf(back.parts[1].scale)


def test_records_of_other_types_are_refused():
    content = pack_records(Inner(np.arange(3), np.float32(1)))
    with pytest.raises(KeyError):
        unpack_records(content, (Outer,))
    with pytest.raises(TypeError):
        pack_records({"a": 1})
    with pytest.raises(TypeError):
        pack_records([1])
