"""Arrays of entries joined in one: the same as copies, mapped where they can be, and private."""

import gc
import sys
from pathlib import Path

import numpy as np
import pytest

from viewsphere.caches import joined as module
from viewsphere.caches.arrays import MAPPED_BYTES, read_arrays, write_arrays
from viewsphere.caches.joined import Stored, joined

ON_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="only Linux maps at an address")
LARGE = MAPPED_BYTES // 2 + 1234


def stored(folder: Path, name: str, count: int) -> Stored:
    values = np.random.default_rng(count).integers(0, 65536, count).astype(np.uint16)
    write_arrays(folder / name, name, {"words": values})
    return Stored(read_arrays(folder / name).arrays["words"], folder / name)


def filled(parts, after=8):
    """The array with each number's part counting upwards, and what copies of the parts would be."""
    array, starts = joined(parts, np.uint16, after)
    expected = [np.arange(part, dtype=np.uint16) if isinstance(part, int) else part.values for part in parts]
    for part, start, values in zip(parts, starts, expected, strict=True):
        if isinstance(part, int):
            array[start : start + part] = values
    array[len(array) - after :] = 7
    for start, values in zip(starts, expected, strict=True):
        np.testing.assert_array_equal(array[start : start + len(values)], values)
    assert (array[len(array) - after :] == 7).all()
    return array, starts


def mappings(name):
    return sum(str(name) in line for line in Path("/proc/self/maps").read_text().splitlines())


def test_all_parts_are_there_in_their_order(tmp_path):
    parts = [5, stored(tmp_path, "a", LARGE), 3, stored(tmp_path, "b", 100), stored(tmp_path, "c", 2 * LARGE), LARGE]
    _, starts = filled(parts)
    assert starts == sorted(starts)


def test_small_parts_lie_side_by_side(tmp_path):
    array, starts = filled([5, stored(tmp_path, "b", 100), 3])
    assert starts == [0, 5, 105] and len(array) == 108 + 8


@ON_LINUX
def test_large_entries_are_mapped_as_long_as_the_array_lives(tmp_path):
    part = stored(tmp_path, "mapped", LARGE)
    before = mappings("mapped")
    array, (start,) = joined([part], np.uint16, 0)
    assert mappings("mapped") == before + 1
    view = array[start : start + LARGE]
    part.file.unlink()
    np.testing.assert_array_equal(view, part.values)
    del array, view, part
    gc.collect()
    assert mappings("mapped") == 0


def test_changes_stay_in_the_array(tmp_path):
    part = stored(tmp_path, "a", LARGE)
    array, (start,) = joined([part], np.uint16, 0)
    whole = part.file.read_bytes()
    array[start] += 1
    assert array[start] != part.values[0]
    assert part.file.read_bytes() == whole


@pytest.mark.parametrize("change", ["gone", "other", "longer", "shorter"])
def test_a_file_that_changed_after_it_was_read_does_not_matter(tmp_path, change):
    part = stored(tmp_path, "a", LARGE)
    other = tmp_path / "other"
    content = bytearray(part.file.read_bytes())
    content[-1] ^= 255
    content = {"longer": content + bytes(2), "shorter": content[:-2]}.get(change, content)
    part.file.unlink() if change == "gone" else (other.write_bytes(content), other.replace(part.file))
    filled([5, part, 3])


@pytest.mark.parametrize("change", ["longer", "shorter", "gone", "failing"])
def test_a_file_that_changes_while_it_is_mapped_does_not_matter(tmp_path, monkeypatch, change):
    part, size_of = stored(tmp_path, "a", LARGE), module._mappable_bytes

    def then_changed(given):
        size = size_of(given)
        if given is part and size:
            other = tmp_path / "other"
            other.write_bytes({"longer": bytes(2 * size), "shorter": bytes(size // 2)}.get(change, bytes(size)))
            other.replace(part.file)
            if change == "gone":
                part.file.unlink()
        return size

    monkeypatch.setattr(module, "_mappable_bytes", then_changed)
    if change == "failing":
        monkeypatch.setattr(module, "map_over", lambda *_: False)
    filled([5, part, 3, stored(tmp_path, "b", LARGE)])


def test_files_of_other_machines_are_copied(tmp_path, monkeypatch):
    part = stored(tmp_path, "a", LARGE)
    monkeypatch.setattr(module, "is_local", lambda file: False)
    _, starts = filled([5, part])
    assert starts == [0, 5]
