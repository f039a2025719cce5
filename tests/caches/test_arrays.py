"""Files of arrays are read back bit for bit, and every other file is refused."""

import json
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
import xxhash

from viewsphere.caches import arrays as module
from viewsphere.caches.arrays import MAGIC, DamagedError, read_arrays, write_arrays
from viewsphere.files import FileError

ARRAYS = {
    "corners": np.arange(12, dtype=np.float32).reshape(4, 3),
    "flags": np.array([True, False]),
    "none": np.empty((0, 3), np.int32),
    "turned": np.arange(6, dtype=np.uint16).reshape(2, 3).T,
    "words": np.arange(3, dtype=np.uint64),
}
ABOUT = {"name": "ü", "list": [1, None, 0.1]}


@pytest.fixture(params=["read", "mapped"])
def file(request, tmp_path, monkeypatch):
    """A file of `ARRAYS`, which is read or mapped."""
    if request.param == "mapped":
        monkeypatch.setattr(module, "MAPPED_BYTES", 1)
        monkeypatch.setattr(module, "is_local", lambda file: True)
    made = tmp_path / "a.arrays"
    assert write_arrays(made, ABOUT, ARRAYS) == made.stat().st_size
    return made


def test_a_file_is_read_bit_for_bit_and_may_be_changed_in_memory(file):
    content = read_arrays(file)
    assert content.about == ABOUT
    assert list(content.arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        held = content.arrays[name]
        assert (held.dtype, held.shape, held.tobytes()) == (array.dtype, array.shape, array.tobytes())
        assert held.flags.writeable
    content.arrays["corners"][:] = 7
    assert (read_arrays(file).arrays["corners"] == ARRAYS["corners"]).all()


def test_every_flipped_bit_and_every_cut_is_found(file):
    whole = file.read_bytes()
    for at in range(0, len(whole), 7):
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1 :])
        with pytest.raises(DamagedError):
            read_arrays(file)
    for at in range(0, len(whole), 37):
        file.write_bytes(whole[:at])
        with pytest.raises(DamagedError):
            read_arrays(file)
    for other in (whole + b"\0", b"VSA0" + whole[4:], b"PK\3\4" + whole[4:], bytes(len(whole))):
        file.write_bytes(other)
        with pytest.raises(DamagedError):
            read_arrays(file)


def sealed(file, head, length=None):
    """A file whose digest is right, whatever its head asks for."""
    rest = (len(head) if length is None else length).to_bytes(8, "little") + head + bytes(256)
    file.write_bytes(MAGIC + xxhash.xxh3_128(rest).digest() + rest)


@pytest.mark.parametrize(
    "head",
    [
        b"{}",
        b"[1]",
        b"7",
        b"not JSON",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"about": 0, "arrays": 3}',
        *(
            json.dumps({"about": 0, "arrays": {"a": place}}).encode()
            for place in (
                ["|O", [1], 0],
                ["V9", [1], 0],
                [[["x", "O"]], [1], 0],
                [7, [1], 0],
                ["(1,,2)f4", [1], 0],
                ["f4,f4", [1], 0],
                ["<f4", [-1], 0],
                ["<f4", [-1, -1], 0],
                ["<f4", [2], -64],
                ["<f4", [10**14], 0],
                ["<f4", [10**30], 0],
                ["<f4", [0, 10**30], 0],
                ["<f4", [1], 10**24],
                ["<f4", [0.5], 0],
                ["<f4", [1] * 100, 0],
                ["<f4", [1]],
                None,
            )
        ),
    ],
)
def test_hostile_heads_are_refused(tmp_path, head):
    sealed(tmp_path / "a", head)
    with pytest.raises(DamagedError):
        read_arrays(tmp_path / "a")


def test_a_head_longer_than_the_file_is_refused(tmp_path):
    sealed(tmp_path / "a", b"{}", length=1 << 62)
    with pytest.raises(DamagedError):
        read_arrays(tmp_path / "a")


class Bomb:
    def __reduce__(self):
        return os.system, ("touch exploded",)


def test_a_pickle_is_never_loaded(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").write_bytes(pickle.dumps([Bomb()] * 40))
    with pytest.raises(DamagedError):
        read_arrays(tmp_path / "a")
    np.save(tmp_path / "b", np.array([Bomb()]), allow_pickle=True)
    with pytest.raises(DamagedError):
        read_arrays(tmp_path / "b.npy")
    assert not (tmp_path / "exploded").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipes_devices_and_folders_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to("/dev/zero")
    for name in ("link", "pipe", "folder"):
        with pytest.raises(FileError):
            read_arrays(tmp_path / name)


@pytest.mark.skipif(sys.platform != "linux", reason="/proc, and files that are mapped without being open")
@pytest.mark.parametrize("is_mapped", [True, False])
def test_a_mapped_file_is_not_held_open_and_changes_stay_here(is_mapped, tmp_path, monkeypatch):
    if not is_mapped:
        monkeypatch.setattr(module, "map_over", lambda *_: False)
    file, values = tmp_path / "a", np.arange(module.MAPPED_BYTES, dtype=np.uint32)
    write_arrays(file, None, {"values": values})

    def count():
        return len(list(Path("/proc/self/fd").iterdir()))

    before = count()
    held = [read_arrays(file).arrays["values"] for _ in range(20)]
    assert count() == before
    assert (str(file) in Path("/proc/self/maps").read_text()) == is_mapped
    held[0][:] = 7
    file.unlink()
    for other in held[1:]:
        np.testing.assert_array_equal(other, values)
