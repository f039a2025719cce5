"""The one opener: regular files, read up to their limit."""

import ast
import os
import pickle
import re
import socket
from functools import partial

import pytest

from small import ROOT
from viewsphere.errors import UserError
from viewsphere.files import FileError, check_file, open_file, open_text, read_bytes, read_text

WAYS = [
    read_bytes,
    read_text,
    partial(check_file, limit="MAX_FILE_BYTES"),
    lambda file: open_file(file).read(),
    lambda file: open_text(file).read(),
]


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
    monkeypatch.setenv("VIEWSPHERE_MAX_STREAMED_BYTES", "1000")
    file = tmp_path / "a"
    file.write_bytes(b"x" * size)
    if size <= 1000:
        way(file)
        return
    with pytest.raises(
        UserError, match=r"a is .* bytes long, and at most 1,000 bytes are allowed \(limit MAX_\w+\)\. Set VIEW"
    ):
        way(file)


READS = [lambda s: s.read(), lambda s: s.read(4096), lambda s: [*s], lambda s: s.readinto(bytearray(9000))]


@pytest.mark.parametrize("read", READS)
def test_a_file_that_grows_is_read_up_to_its_limit(tmp_path, monkeypatch, read):
    monkeypatch.setenv("VIEWSPHERE_MAX_FILE_BYTES", "1000")
    monkeypatch.setenv("VIEWSPHERE_MAX_STREAMED_BYTES", "1000")
    file = tmp_path / "a"
    file.write_bytes(b"x" * 10)
    with open_file(file) as stream:
        file.write_bytes(b"x\n" * 100_000)
        with pytest.raises(FileError, match="is 1,001 bytes long"):
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


SOURCE = ROOT / "src"
OPENERS = {
    library: names.split()
    for libraries, names in {
        "np": "load loadtxt genfromtxt fromfile memmap",
        "Image Pillow tarfile gzip bz2 lzma io codecs sqlite3 os": "open connect",
        "json pickle tomllib plistlib marshal": "load",
        "ElementTree etree": "parse iterparse",
        "zipfile h5py OpenEXR pq": "ZipFile File read_table ParquetFile",
        "trimesh collada cv2": "load_mesh load_scene Collada imread",
        "shutil": "copy copy2 copyfile copytree",
    }.items()
    for library in libraries.split()
}
"""Calls of libraries that open a path, or read what was opened."""

BOUNDED = {"open_file", "open_text", "BytesIO", "StringIO", "TemporaryFile", "member", "read_bytes"}
"""Calls whose result a library may read."""

ALLOWED = {
    "caches/folders.py": "descriptors of its own files",
    "scratch.py": "locks, which it makes itself",
    "rendering/sky/environment_head.py": "os.devnull, and OpenEXR behind check_file",
    "blender/worker": "a program of its own, confined, which reads what viewsphere writes for it",
    "codecs/npz.py": "a member of an archive in memory",
    "codecs/size.py": "behind open_file",
    "files.py": "the opener",
    "formats/tapvid.py": "writes",
    "formats/native/writing.py": "a database in memory",
    "kernels/digests.py": "the package's own sources",
    "kernels/entries.py": "regular files of its own folder, none behind links",
    "recipe/starts": "the package's own recipes",
    "run/shots/precompile.py": "a lock",
    "store/shots/moving.py": "os.open to bring a file to the disk",
    "store/shots/shot_files.py": "os.open to write",
    "rendering/sky/environment_file.py": "OpenEXR behind check_file",
    "urls/__init__.py": "copyfile behind check_file",
    "urls/remote_path.py": "files at URLs",
    "cli/datasets.py": "webbrowser.open",
    "cli/terminal.py": "os.devnull",
}
"""Places that may open files otherwise, and why."""


READERS = {"open", "read_text", "read_bytes", "ZipFile", "iterparse"}.union(*OPENERS.values())
"""A source without any of these names opens no file."""


def bare(source):
    """Lines of a source that open a file by a path other than through `viewsphere.files`."""
    if READERS.isdisjoint(re.findall(r"\w+", source)):
        return
    nodes = [*ast.walk(ast.parse(source))]
    streams = {
        item.optional_vars.id
        for node in nodes
        if isinstance(node, ast.With)
        for item in node.items
        if isinstance(item.optional_vars, ast.Name) and named(item.context_expr) in BOUNDED
    } | {
        node.targets[0].id
        for node in nodes
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        if any(named(call) in BOUNDED for call in ast.walk(node.value))
    }
    for node in nodes:
        reads = isinstance(node, ast.Attribute) and node.attr in ("read_text", "read_bytes")
        if reads and not (isinstance(node.value, ast.Name) and node.value.id == "files"):
            yield node.lineno
        if isinstance(node, ast.Call) and opens(node):
            first = node.args[0] if node.args else None
            if not (named(first) in BOUNDED or (isinstance(first, ast.Name) and first.id in streams)):
                yield node.lineno


def named(node):
    """The name of a called function; None for anything else."""
    if not isinstance(node, ast.Call):
        return None
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", None)


def opens(call):
    """Return whether a call opens a path to read it."""
    if isinstance(call.func, ast.Name):
        return call.func.id in ("open", "ZipFile", "iterparse")
    if not isinstance(call.func, ast.Attribute):
        return False
    owner, name = getattr(call.func.value, "id", None), call.func.attr
    if (
        owner == "os"
        and name == "open"
        and any(getattr(part, "attr", "") in ("O_WRONLY", "devnull") for part in ast.walk(call))
    ):
        return False
    if owner in OPENERS:
        return name in OPENERS[owner]
    texts = [a.value for a in [*call.args, *(k.value for k in call.keywords if k.arg == "mode")] if isinstance(a, ast.Constant)]
    return name == "open" and not any(isinstance(text, str) and set(text) & set("wax") and len(text) < 4 for text in texts)


def test_no_file_is_opened_otherwise():
    """Strangers' files, and those that a recipe names, may be pipes, devices or endless."""
    found = {
        f"{path}:{line}"
        for file in sorted(SOURCE.rglob("*.py"))
        for path in [file.relative_to(SOURCE).as_posix().removeprefix("viewsphere/")]
        if not any(path == allowed or path.startswith(f"{allowed}/") for allowed in ALLOWED)
        for line in bare(file.read_text("utf-8"))
    }
    assert not found
    assert all((SOURCE / "viewsphere" / name).exists() for name in ALLOWED)


BARE = [
    "open(path)",
    "path.read_text('utf-8')",
    "decode(file.read_bytes)",
    "with path.open('rb') as f: f.read()",
    "path.open(encoding='utf-8')",
    "np.load(path)",
    "np.loadtxt(path)",
    "Image.open(path)",
    "json.load(stream)",
    "ElementTree.parse(path)",
    "zipfile.ZipFile(path)",
    "tarfile.open(path)",
    "os.open(path, os.O_RDONLY)",
    "h5py.File(path)",
    "OpenEXR.File(str(path))",
]
FINE = [
    "path.open('wb')",
    "path.open('a', encoding='utf-8')",
    "os.open(path, os.O_WRONLY | os.O_CREAT)",
    "os.open(os.devnull, os.O_RDONLY)",
    "read_text(path)",
    "files.read_text(path)",
    "with open_file(path) as f, Image.open(f) as i: i.load()",
    "np.load(io.BytesIO(data))",
    "buffer = io.BytesIO(data)\nImage.open(buffer)",
]


@pytest.mark.parametrize(("source", "is_bare"), [*((text, True) for text in BARE), *((text, False) for text in FINE)])
def test_the_walk_tells_bare_openings(source, is_bare):
    assert any(bare(source)) == is_bare
