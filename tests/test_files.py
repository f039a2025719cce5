"""The one opener: regular files, read up to their limit."""

import os
import pickle
import socket

import pytest

from viewsphere.errors import UserError
from viewsphere.files import FileError, check_file, open_file, open_text, read_bytes, read_text

WAYS = [read_bytes, read_text, check_file, lambda file: open_file(file).read(), lambda file: open_text(file).read()]


@pytest.fixture(params=["pipe", "device", "socket", "folder"])
def odd(request, tmp_path, monkeypatch):
    """What is no regular file, and the word for it."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "odd"
    match request.param:
        case "pipe":
            os.mkfifo(path)
        case "device":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case _:
            with socket.socket(socket.AF_UNIX) as unix:
                unix.bind("odd")
    return path, request.param


@pytest.mark.skipif(os.name == "nt", reason="POSIX files")
@pytest.mark.parametrize("way", WAYS)
def test_what_is_no_regular_file_is_refused_at_once(odd, way):
    path, kind = odd
    with pytest.raises(FileError) as caught:
        way(path)
    assert str(caught.value).startswith(f"{path} is a {kind}, not a ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("size", [0, 1, 999, 1000, 1001, 5000])
def test_the_limit_is_the_last_size_that_is_read(tmp_path, monkeypatch, way, size):
    monkeypatch.setenv("VIEWSPHERE_MAX_FILE_BYTES", "1000")
    file = tmp_path / "a"
    file.write_bytes(b"x" * size)
    if size <= 1000:
        way(file)
        return
    with pytest.raises(UserError, match=r"a is larger than 1,000 bytes \(limit MAX_FILE_BYTES\): it has .*Set VIEW"):
        way(file)


READS = [lambda s: s.read(), lambda s: s.read(4096), lambda s: [*s], lambda s: s.readinto(bytearray(9000))]


@pytest.mark.parametrize("read", READS)
def test_a_file_that_grows_is_read_up_to_its_limit(tmp_path, monkeypatch, read):
    monkeypatch.setenv("VIEWSPHERE_MAX_FILE_BYTES", "1000")
    file = tmp_path / "a"
    file.write_bytes(b"x" * 10)
    with open_file(file) as stream:
        file.write_bytes(b"x\n" * 100_000)
        with pytest.raises(FileError, match="it has 1,001 or more"):
            read(stream)


def test_a_text_has_one_kind_of_line_ends(tmp_path):
    file = tmp_path / "a"
    file.write_bytes("\ufeffä\r\nb\rc\n".encode())
    assert read_text(file, encoding="utf-8-sig") == "ä\nb\nc\n"
    assert read_text(file) == file.read_text("utf-8") == open_text(file).read()
    assert open_text(file, newline="").read() == "\ufeffä\r\nb\rc\n"


def test_streams_seek(tmp_path):
    file = tmp_path / "a"
    file.write_bytes(bytes(range(256)) * 100)
    with open_file(file) as stream:
        stream.seek(-3, os.SEEK_END)
        assert stream.read() == bytes([253, 254, 255])
        stream.seek(300)
        assert stream.read(2) == bytes([44, 45])


def test_the_error_goes_through_processes():
    error = pickle.loads(pickle.dumps(FileError("a", "b")))
    assert (str(error), error.strerror) == ("a is b", "b")
