"""A data set that a stranger made: its paths and names mean its own files, and nothing that lies elsewhere."""

import json
import shutil
import struct
import tracemalloc
import zlib
from contextvars import copy_context
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from command_line import viewsphere
from cube_dataset import FEW, make
from sealing import seal_again
from viewsphere.check import check
from viewsphere.codecs.png_tiff import decode_png, encode_png
from viewsphere.codecs.size import check_size
from viewsphere.errors import StoreError, UserError
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.executors import local
from viewsphere.run.exports.exporting import export
from viewsphere.store import Dataset
from viewsphere.store.paths import file_inside, is_name
from viewsphere.store.shots.manifest import MANIFEST, Manifest, sealed, unsealed
from viewsphere.store.texts import parsed
from viewsphere.urls.inside import is_inside

SECRET = b"nobody's business"
OUT = "../../../../../../"
"""Up from any folder of a store, to where the tests keep their data sets, and further."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A data set with whole records, and its exports beside it."""
    root = tmp_path_factory.mktemp("made")
    dataset = make(root / "out", channels=FEW, short=False)
    export(dataset.root, ["coco", "native"], output=root)
    return root


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A data set whose records are short; do not change it."""
    return make(tmp_path_factory.mktemp("short") / "out", channels=FEW).root


@pytest.fixture
def stranger(made, tmp_path):
    """The data set in a folder beside a secret."""
    (tmp_path / "secret.txt").write_bytes(SECRET)
    return Path(shutil.copytree(made / "out", tmp_path / "out"))


def spoil_json(file, change):
    """Change a JSON file in place."""
    value = json.loads(file.read_text("utf-8"))
    change(value)
    file.write_text(json.dumps(value), "utf-8")


def first(root, pattern):
    return min(root.glob(pattern))


def in_frames(change):
    def spoil(root):
        spoil_json(first(root, "store/shots/*/*/frames.json"), lambda records: [change(record) for record in records])
        seal_again(root)

    return spoil


def in_a_model(**changes):
    def spoil(root):
        spoil_json(first(root, "store/models/*/model.json"), lambda info: info.update(changes))
        seal_again(root)

    return spoil


def in_plan(change):
    def spoil(root):
        file = root / "store" / "plan.json"
        value = unsealed(file.read_text("utf-8"))
        change(value)
        file.write_text(sealed(value), "utf-8")

    return spoil


def linked(pattern, name=""):
    """The first file of a pattern, or one of this name beside it, becomes a link to the secret."""

    def spoil(root):
        file = first(root, pattern)
        file = file.with_name(name) if name else file
        file.unlink(missing_ok=True)
        file.symlink_to(root.parent / "secret.txt")
        seal_again(root)

    return spoil


SPOILT = {
    "absolute path": in_frames(lambda record: record["files"].update(rgb="/etc/hostname")),
    "path of a Windows drive": in_frames(lambda record: record["files"].update(rgb="C:/secret.txt")),
    "path that goes up": in_frames(lambda record: record["files"].update(rgb="../secret.txt")),
    "name of a channel": in_frames(lambda record: record["files"].update({f"{OUT}escaped": record["files"]["rgb"]})),
    "split": in_frames(lambda record: record.update(split=f"{OUT}escaped")),
    "key of an object": in_frames(lambda record: record["objects"][0].update(key=f"{OUT}escaped")),
    "model's OBJ": in_a_model(obj="../secret.obj"),
    "model's key": in_a_model(key=f"{OUT}escaped"),
    "key in the plan": in_plan(lambda value: value.update(models=[f"{OUT}escaped", *value["models"]])),
    "subject in the plan": in_plan(lambda value: value["parts"][0]["blocks"][0].update(subjects=[f"{OUT}escaped", "b", "c"])),
    "split in the plan": in_plan(lambda value: value.update(splits=["train", "val", f"{OUT}escaped"])),
    "link as a channel": linked("store/shots/*/*/rgb/*.png"),
    "link in a model's folder": linked("store/models/*/model.json", "more.txt"),
}
ONLY_MERGED = {"link as a scene": linked("store/shots/*/*/frames.json", "scenery.json")}


def escaped(folder):
    """Files outside of the data set `out` that hold the secret or have a name that leads there, but for the secret itself."""
    others = [p for p in folder.rglob("*") if p != folder / "secret.txt" and not p.is_relative_to(folder / "out" / "store")]
    return [p for p in others if p.name.startswith("escaped") or (p.is_file() and p.read_bytes() == SECRET)]


@pytest.mark.parametrize("what", SPOILT)
def test_an_export_takes_nothing_from_elsewhere(what, stranger, tmp_path):
    SPOILT[what](stranger)
    for name in ("coco", "native"):
        answer = viewsphere("export", stranger, "--format", name)
        assert answer.returncode == 2, (name, answer)
        assert answer.stderr.count("\n") == 1
        assert "expected" in answer.stderr
    assert not escaped(tmp_path)
    assert not [p for folder in tmp_path.parents[:3] for p in folder.glob("escaped*")]


@pytest.mark.parametrize("what", [*SPOILT, *ONLY_MERGED])
def test_a_merge_takes_nothing_from_elsewhere(what, made, stranger, tmp_path):
    (SPOILT | ONLY_MERGED)[what](stranger)
    answer = viewsphere("merge", stranger, made / "out", "-o", tmp_path / "merged")
    assert answer.returncode == 2, answer
    assert answer.stderr.count("\n") == 1
    assert not escaped(tmp_path)


@pytest.mark.parametrize("what", [name for name in SPOILT if not name.endswith("in the plan")])
def test_check_finds_it_and_advises_to_delete_nothing_elsewhere(what, stranger):
    SPOILT[what](stranger)
    report = check(Dataset(stranger))
    assert not report.ok
    for finding in report.findings:
        _, _, advice = str(finding).partition("delete ")
        assert not advice or advice.startswith(str(stranger / "store")), finding


def test_a_manifest_speaks_of_its_own_folder(stranger):
    folder = first(stranger, f"store/shots/*/*/{MANIFEST}").parent
    Manifest({**Manifest.read(folder).files, f"{OUT}secret.txt": (1, "0" * 32)}).write(folder)
    with pytest.raises(StoreError, match="found a path that leads out of it"):
        Manifest.read(folder)


def test_links_inside_of_a_data_set_and_to_a_whole_one_are_followed(stranger, tmp_path):
    picture, other = sorted(stranger.glob("store/shots/*/*/rgb/*.png"))[:2]
    picture.unlink()
    picture.symlink_to(other)
    (tmp_path / "link").symlink_to(stranger)
    seal_again(stranger)
    export(tmp_path / "link", ["coco"], output=tmp_path / "exports")
    pictures = [p.read_bytes() for p in (tmp_path / "exports").rglob("*.png") if not p.is_symlink()]
    assert pictures.count(other.read_bytes()) >= 2


FOREIGN = {
    "native": ("Pose-*/RGB/*.png", "Pose-*/MASK/*.png", "Pose-*/DEPTH/*", "MODELS/*/*.obj", "MODELS/*/*.glb"),
    "coco": ("images/*/*.png",),
}


@pytest.mark.parametrize(("kind", "pattern"), [(kind, pattern) for kind in FOREIGN for pattern in FOREIGN[kind]])
def test_an_import_follows_no_link_out_of_its_data_set(kind, pattern, made, tmp_path):
    source = Path(shutil.copytree(made / kind, tmp_path / "source"))
    file = first(source, pattern)
    shutil.move(file, tmp_path / f"secret{file.suffix}")
    file.symlink_to(tmp_path / f"secret{file.suffix}")
    with pytest.raises(StoreError, match=r"expected a file inside of .*, found a link that leads out of it"):
        import_dataset(kind, source, tmp_path / "imported")
    kept = import_dataset(kind, source, tmp_path / "imported", keep_going=True)
    assert len(kept.left_out) == 1
    secret = (tmp_path / f"secret{file.suffix}").stat().st_ino
    assert not [p for p in (tmp_path / "imported").rglob("*") if p.stat().st_ino == secret]


@pytest.mark.parametrize("path", ["/etc/hostname", "../secret.txt", "Pose-0/../../secret.txt", "C:\\secret.txt"])
@pytest.mark.parametrize("kind", FOREIGN)
def test_an_import_reads_no_path_that_leads_out(kind, path, made, tmp_path):
    source = Path(shutil.copytree(made / kind, tmp_path / "source"))

    def change(value):
        if kind == "coco":
            value["images"][0]["file_name"] = path
        else:
            next(iter(value["poses"].values()))["vehicles_rendered"]["block-0"]["path_rgb"] = path

    spoil_json(first(source, "dataset1.json" if kind == "native" else "annotations/*.json"), change)
    with pytest.raises(
        StoreError,
        match=r"expected (relative paths|its file below|a frame that can be read; found no)",
    ):
        import_dataset(kind, source, tmp_path / "imported")


def test_paths(tmp_path):
    assert file_inside(tmp_path, "a/b.png") == tmp_path / "a" / "b.png"
    assert all(map(is_inside, ["a", "a/b", "./a", "a..b/c", "a b/ü.png"]))
    assert not any(map(is_inside, ["/a", "..", "a/../b", "a\\..\\b", "\\\\host\\share", "C:a", "a\0b"]))
    assert all(map(is_name, ["a", "a.b", "..a", "ü-1"]))
    assert not any(map(is_name, ["", ".", "..", "a/b", "a\\b", "a\0", 1, None]))
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(StoreError, match="expected"):
        file_inside(tmp_path, "round/x")
        raise StoreError("expected: some systems resolve a circle")


DEEP = "[" * 100_000
OF_A_SHOT = tuple(f"shots/*/*/{name}.json" for name in ("frames", "shot", "scenery"))
JSON = ("skipped.json", "plan.json", "models/*/model.json", *OF_A_SHOT)
TEXTS = ["", '{"a', "null", "[]", "3", '{"a": 1}', '"\\ud800"', DEEP]


@pytest.mark.slow
@pytest.mark.parametrize("text", TEXTS, ids=lambda text: text[:8] or "nothing")
@pytest.mark.parametrize("pattern", JSON)
def test_any_other_json_in_a_store_is_one_line(pattern, text, short, tmp_path):
    root = Path(shutil.copytree(short, tmp_path / "out"))
    folder = first(root / "store", pattern.replace("scenery", "shot")).parent if "/" in pattern else root / "store"
    (folder / Path(pattern).name).write_text(text)
    seal_again(root)
    answer = viewsphere("check", root)
    assert answer.returncode == (2 if pattern == "plan.json" else 1) or (pattern, text) == (JSON[-1], "")
    assert all(line.startswith(("failed: ", "viewsphere: ", "and ")) for line in answer.stderr.splitlines())
    answer = viewsphere("export", root, "--format", "coco")
    assert answer.returncode == (2 if pattern not in {JSON[0], JSON[-1]} else 0)
    assert answer.stderr.count("\n") == (answer.returncode == 2)
    assert "self failed" not in answer.stderr


@pytest.mark.parametrize("command", ["check OUT", "export made --format coco -o OUT", "import coco coco -o OUT", "new OUT"])
def test_a_name_that_is_too_long_is_one_line(command, made):
    shutil.copytree(made / "out", made / "made", dirs_exist_ok=True)
    answer = viewsphere(*command.replace("OUT", "x" * 300).split(), cwd=made)
    assert (answer.returncode, answer.stderr.count("\n")) == (2, 1)
    assert "expected a path that the file system takes, found: " in answer.stderr


def head_of_png(width, height):
    """A PNG file of so many pixels, nearly all of which are missing."""
    data = bytearray(encode_png(np.zeros((2, 2, 3), np.uint8)))
    data[16:24] = struct.pack(">II", width, height)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    return bytes(data)


LARGE = r"expected at most 268,435,456 pixels \(limit MAX_STORED_PIXELS\), found 60,000 x 60,000; set"


def test_a_picture_of_too_many_pixels_is_not_unpacked(stranger, made, tmp_path, monkeypatch):
    first(stranger, "store/shots/*/*/rgb/*.png").write_bytes(head_of_png(60_000, 60_000))
    seal_again(stranger)
    with pytest.raises(StoreError, match=LARGE):
        assert [sample.rgb for sample in Dataset(stranger)]
    assert any("MAX_STORED_PIXELS" in finding.message for finding in check(Dataset(stranger)).findings)
    for kind, pattern in (("native", "Pose-*/RGB/*.png"), ("native", "Pose-*/MASK/*.png"), ("coco", "images/*/*.png")):
        source = Path(shutil.copytree(made / kind, tmp_path / pattern[7:9]))
        first(source, pattern).write_bytes(head_of_png(60_000, 60_000))
        with pytest.raises(StoreError, match=LARGE):
            import_dataset(kind, source, tmp_path / "imported")
    monkeypatch.setenv("VIEWSPHERE_MAX_STORED_PIXELS", "11")
    with pytest.raises(StoreError, match="at most 11 pixels"):
        assert next(iter(Dataset(stranger))).depth
    monkeypatch.setenv("VIEWSPHERE_MAX_STORED_PIXELS", "some")
    with pytest.raises(UserError, match="VIEWSPHERE_MAX_STORED_PIXELS: expected a whole number above 0, found 'some'"):
        check_size(1, 1)


@pytest.mark.slow
def test_pixels_beyond_those_that_the_head_tells_are_not_unpacked():
    data = encode_png(np.zeros((2, 2, 3), np.uint8))
    more = zlib.compress(bytes(1 << 28), 9)
    chunk = struct.pack(">I", len(more)) + b"IDAT" + more + struct.pack(">I", zlib.crc32(b"IDAT" + more))
    tracemalloc.start()
    try:
        with pytest.raises(UserError, match="expected 14 bytes of pixels, found 15"):
            decode_png(data[:33] + chunk + data[-12:])
        assert tracemalloc.get_traced_memory()[1] < 1 << 24
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kind", FOREIGN)
def test_half_a_character_is_refused(kind, made, tmp_path):
    source = Path(shutil.copytree(made / kind, tmp_path / "source"))
    for file in source.glob("**/*.json"):
        file.write_text(file.read_text("utf-8").replace('"hair_drier"', '"\\ud800"'), "utf-8")
    with pytest.raises(StoreError, match=r"found: half of a UTF-16 pair, '\\ud800', where a character is expected"):
        import_dataset(kind, source, tmp_path / "imported")
    assert parsed('{"pair": "\\ud83d\\ude00", "escaped": "\\\\ud800"}') == {"pair": "\U0001f600", "escaped": "\\ud800"}


@pytest.mark.parametrize("error", [EOFError, BrokenPipeError, ConnectionResetError])
def test_a_worker_whose_parent_is_gone_ends_quietly(error, tmp_path):
    class Pipe:
        def recv(self):
            raise error

    with patch("signal.signal"), patch("viewsphere.run.shots.tasks.Worker"):
        copy_context().run(local._serve, Pipe(), tmp_path, None)


def test_a_plain_path_is_followed_without_looking_at_what_is_above(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b.png").touch()
    (tmp_path / "link").symlink_to(tmp_path / "a")
    (tmp_path / "out").symlink_to(tmp_path.parent)
    followed = []
    resolve = Path.resolve
    monkeypatch.setattr(Path, "resolve", lambda self, **options: followed.append(self) or resolve(self, **options))
    assert file_inside(tmp_path, "a/b.png") == tmp_path / "a" / "b.png"
    assert file_inside(tmp_path, "a/none/c.png") == tmp_path / "a" / "none" / "c.png"
    assert not followed
    assert file_inside(tmp_path, "link/b.png") == tmp_path / "link" / "b.png"
    assert followed
    with pytest.raises(StoreError, match="a link that leads out of it"):
        file_inside(tmp_path, "out/b.png")
    for outside in ("..", "a/../..", "a/..", "/a", "C:/a", "a\\..\\b", "\0"):
        with pytest.raises(StoreError):
            file_inside(tmp_path, outside)
