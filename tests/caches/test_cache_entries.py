"""Entries of the cache appear whole or not at all, and the cache stays within its limit, whatever happens to its files."""

import os
import random
import subprocess
import sys
import time

import numpy as np
import pytest

from viewsphere.caches import arrays, budget, cache_of
from viewsphere.caches.arrays import Content
from viewsphere.caches.entries import PREFIX, SUFFIX, cached, making, read_entry, write_entry
from viewsphere.scratch import of_this_process


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def file_of(name):
    return cache_of("light") / f"{name}{SUFFIX}"


def write(name, size=1000):
    write_entry(file_of(name), name, {"bytes": np.zeros(size, np.uint8)})


def made(name, size=1000):
    """The entry's name, from the cache or made; `calls` counts how often it was made."""
    calls = []

    def make():
        calls.append(name)
        return name

    held = cached("light", name, make, lambda value: Content(value, {"b": np.zeros(size)}), lambda content: content.about)
    assert held == name
    return bool(calls)


def total():
    return sum(entry.size for entry in budget.entries())


def test_a_result_is_made_once(cache):
    assert made("a")
    assert not made("a")
    assert [path.name for path in cache_of("light").iterdir()] == [f"a{SUFFIX}"]


@pytest.mark.parametrize("size, is_read", [(1000, False), (arrays.MAPPED_BYTES, True)])
def test_a_large_new_result_has_the_memory_of_the_entry(size, is_read):
    values = np.arange(size, dtype=np.uint8)
    given = "light", "a", lambda: values, lambda new: Content(None, {"b": new}), lambda content: content.arrays["b"]
    first = cached(*given)
    np.testing.assert_array_equal(first, values)
    assert (first is not values) == is_read
    file_of("a").unlink()
    file_of("a").mkdir()  # nothing can be read back
    np.testing.assert_array_equal(cached(*given), values)


@pytest.mark.parametrize("damage", [b"", b"x" * 2000, b"VSA0", None])
def test_a_damaged_entry_is_removed_and_made_anew(damage):
    made("a")
    whole = file_of("a").read_bytes()
    file_of("a").write_bytes(whole[:-1] if damage is None else damage)
    assert read_entry(file_of("a")) is None
    assert not file_of("a").exists()
    file_of("a").write_bytes(whole[:-1] if damage is None else damage)
    assert made("a")
    assert file_of("a").read_bytes() == whole


def test_an_entry_of_another_version_is_made_anew():
    write_entry(file_of("a"), {"other": 1}, {})

    def unpack(content):
        return content.about["this"]

    assert cached("light", "a", lambda: 5, lambda value: Content({"this": value}, {}), unpack) == 5
    assert cached("light", "a", lambda: pytest.fail("made twice"), lambda _: Content(0, {}), unpack) == 5


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("kind", ["dangling", "device", "pipe"])
def test_an_entry_takes_the_place_of_what_is_no_file(kind, tmp_path):
    cache_of("light").mkdir(parents=True)
    match kind:
        case "dangling":
            file_of("a").symlink_to(tmp_path / "nowhere")
        case "device":
            file_of("a").symlink_to("/dev/zero")
        case _:
            os.mkfifo(file_of("a"))
    assert made("a")
    assert not made("a")
    assert not (tmp_path / "nowhere").exists()


def test_a_folder_in_place_of_an_entry_costs_time_only():
    (file_of("a") / "mine").mkdir(parents=True)
    assert made("a")
    assert made("a")
    assert (file_of("a") / "mine").exists()
    assert [path.name for path in cache_of("light").iterdir()] == [f"a{SUFFIX}"]


def test_a_cache_that_cannot_be_written_costs_time_only(cache, monkeypatch):
    cache.write_bytes(b"a file in place of the folder")
    assert made("a")
    cache.unlink()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(arrays, "write_arrays", full)
    assert made("a")
    assert not list(cache_of("light").iterdir())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_cache_is_used():
    made("a")
    cache_of("light").chmod(0o500)
    try:
        assert not made("a")
        assert made("b")
    finally:
        cache_of("light").chmod(0o700)


def test_the_entries_used_longest_ago_are_deleted(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "100kB")
    now = time.time()
    for number in range(60):
        write(number)
        os.utime(file_of(number), (now - 5000 + number,) * 2)
    read_entry(file_of(0))  # which makes it the newest
    for number in range(60, 100):
        write(number)
        assert total() <= 100_000
    assert [file_of(number).exists() for number in (0, 1, 59, 99)] == [True, False, True, True]


def test_the_cache_is_not_walked_at_each_write(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "1MB")
    walks = []
    walk = budget.entries
    monkeypatch.setattr(budget, "entries", lambda *args: walks.append(args) or walk(*args))
    for number in range(100):
        write(number, 400)
    assert len(walks) == 100 * (file_of(0).stat().st_size * 4096 // 1_000_000 + 1) // 128 > 0


def test_entries_from_the_future_are_the_oldest_until_they_are_used():
    for number in range(4):
        write(number)
    for number in (1, 2):
        os.utime(file_of(number), (time.time() + 1e6,) * 2)
    read_entry(file_of(1))
    assert [entry.file for entry in budget.prune(3 * file_of(0).stat().st_size)] == [file_of(2)]


def test_kernels_that_are_in_use_are_deleted_last():
    kernels = [cache_of("kernels") / name for name in ("in_use", "of_last_year")]
    for file, days in zip(kernels, (1, 365), strict=True):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(bytes(1000))
        os.utime(file, (time.time() - days * 86_400,) * 2)
    write(0)
    assert {entry.file for entry in budget.prune(1500)} == {kernels[1], file_of(0)}


def test_an_entry_that_would_fill_the_cache_is_left_out(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "10kB")
    write("small")
    write("large", 9_500)
    assert made("larger", 5_000)
    assert [entry.file for entry in budget.entries()] == [file_of("small")]
    assert not list(cache_of("light").glob(f"{PREFIX}*"))


def test_a_file_that_is_read_by_its_path_outlives_a_tiny_limit_while_it_is_used(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "1kB")
    file = cache_of("zoo") / "person.glb"
    with making(file) as half:
        half.write_bytes(bytes(5_000))
    write("a", 10)
    budget.prune(0)
    assert file.exists()
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "20kB")
    for number in range(30):
        write(number)
        assert total() <= 20_000, "others make room for it"
    os.utime(file, (time.time() - 2 * budget.SPARED_S,) * 2)
    budget.prune(0)
    assert not file.exists()


@pytest.mark.slow
def test_many_short_processes_stay_within_the_limit(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "100kB")
    program = WRITER.replace("while True:", "for _ in range(2):").replace("40_000", "10_000")
    for first in range(0, 16, 2):
        subprocess.run([sys.executable, "-c", program, f"{first}"], check=True, stdout=subprocess.DEVNULL)
        assert total() <= 100_000
    assert total() > 50_000


def test_folders_that_killed_processes_left_are_removed():
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    name = of_this_process().replace(f"~{os.getpid()}~", f"~{dead.pid}~")
    half = cache_of("light") / f"{PREFIX}{name}abc"
    half.mkdir(parents=True)
    (half / "lock").touch()
    (half / "a.arrays").write_bytes(bytes(9000))
    write("b")
    assert not half.exists()


def test_entries_that_others_are_writing_count_too(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "1MB")
    for number in range(9):
        write(str(number), 100_000)
    assert total() > 900_000
    half = cache_of("light") / f"{PREFIX}{of_this_process()}abc"
    half.mkdir()
    (half / "a.arrays").write_bytes(bytes(60_000))
    write("last", 40_000)
    assert total() + 60_000 <= 1_000_000


WRITER = """
import sys
import numpy as np
from viewsphere.caches import cache_of
from viewsphere.caches.entries import SUFFIX, write_entry
print("ready", flush=True)
number = int(sys.argv[1])
while True:
    number += 1
    name = number % 97
    write_entry(cache_of("light") / f"{name}{SUFFIX}", name, {"bytes": np.full(40_000, name, np.uint8)})
"""


def writers(first, count=2):
    """Processes that write the same entries over and over."""
    started = [subprocess.Popen([sys.executable, "-c", WRITER, f"{first + i}"], stdout=subprocess.PIPE) for i in range(count)]
    for writer in started:
        assert writer.stdout is not None
        writer.stdout.readline()
    return started


def test_readers_find_whole_entries_only_while_two_processes_write_them():
    started = writers(0)
    try:
        for _ in range(20):
            number = random.Random(1).randrange(5)
            file = file_of(number)
            if file.exists():
                content = read_entry(file)
                assert content is not None
                assert (content.arrays["bytes"] == number).all()
            time.sleep(0.005)
    finally:
        for writer in started:
            writer.kill()
            writer.wait()


def test_plain_entries_of_a_folder_that_others_write_are_used_if_whole(cache):
    """They are data: who writes the folder can change pictures, but run nothing. Kernels, which are programs, are refused."""
    made("a")
    cache.chmod(0o777)
    cache_of("light").chmod(0o777)
    file_of("a").chmod(0o666)
    assert not made("a")
    damaged = bytearray(file_of("a").read_bytes())
    damaged[-1] ^= 1
    file_of("a").write_bytes(damaged)
    assert made("a") and not made("a")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root, to give a file to another user")
def test_an_entry_of_another_user_is_used_if_whole():
    made("a")
    os.chown(file_of("a"), 65534, 65534)
    assert not made("a")
