"""The cache never changes what is loaded, only how long it takes."""

import io
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets import cache
from viewsphere.assets.cache import cache_folder, load_normalised
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.mesh_file import ARRAYS
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec

CUBE = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n"
FACES = "vt 0 0\nusemtl m\ng base\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\ng top\nf 2/1 3/1 4/1\nf 3/1 1/1 4/1\n"


def png(color):
    file = io.BytesIO()
    Image.new("RGBA", (2, 3), color).save(file, "PNG")
    return file.getvalue()


@pytest.fixture
def spec(write):
    write("m/skin.png", png("red"))
    write("m/a.mtl", "newmtl m\nKd 0.1 0.2 0.3\nmap_Kd skin.png\nmap_Bump lost.png\n")
    path = write("m/a.obj", "mtllib a.mtl\n" + CUBE + FACES)
    return ModelSpec(key="a", source=str(path), category="thing", category_id=1)


@pytest.fixture
def counted(monkeypatch):
    """How often a model file was read."""
    calls = []
    read = cache.read_apart
    monkeypatch.setattr(cache, "read_apart", lambda *args: calls.append(args) or read(*args))
    return calls


def assert_same(a: Mesh, b: Mesh):
    for name in ARRAYS:
        left, right = getattr(a, name), getattr(b, name)
        assert (left is None) == (right is None)
        if left is not None:
            assert left.dtype == right.dtype
            assert left.tobytes() == right.tobytes()
    assert (a.materials, a.parts, a.warnings) == (b.materials, b.parts, b.warnings)
    assert [(i.name, i.pixels.tobytes()) for i in a.images] == [(i.name, i.pixels.tobytes()) for i in b.images]


def test_a_second_load_is_equal_and_reads_nothing(spec, counted, tmp_path):
    first = load_normalised(spec, folder=tmp_path / "cache")
    second = load_normalised(spec.model_copy(update={"key": "b", "category": "other"}), folder=tmp_path / "cache")
    assert len(counted) == 1
    assert_same(first, second)
    assert first.parts == ("base", "top")
    assert any("lost.png" in warning for warning in first.warnings)


def test_facts_list_the_same_files_with_and_without_an_entry(spec, tmp_path):
    first, second = (cache.load(spec, tmp_path / "cache")[1] for _ in range(2))
    assert first.files == second.files and spec.source in map(str, first.files)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m/a.obj", "mtllib a.mtl\n" + CUBE.replace("3\n", "4\n") + FACES),
        ("m/a.mtl", "newmtl m\nKd 1 0 0\n"),
        ("m/skin.png", png("blue")),
        ("m/lost.png", png((128, 128, 255))),
    ],
)
def test_a_change_of_any_file_is_seen_and_undone(spec, counted, write, tmp_path, name, content):
    folder = tmp_path / "cache"
    before = load_normalised(spec, folder=folder)
    path = tmp_path / name
    old = path.read_bytes() if path.exists() else None
    write(name, content)
    changed = load_normalised(spec, folder=folder)
    assert len(counted) == 2
    assert_same(changed, load_normalised(spec, folder=tmp_path / "fresh"))
    with pytest.raises(AssertionError):
        assert_same(before, changed)
    if old is None:
        path.unlink()
    else:
        path.write_bytes(old)
    assert_same(before, load_normalised(spec, folder=folder))


def test_settings_and_readers_are_part_of_the_key(spec, counted, monkeypatch, tmp_path):
    folder = tmp_path / "cache"
    load_normalised(spec, folder=folder)
    tall = load_normalised(spec.model_copy(update={"scale": 2.0}), folder=folder)
    assert np.ptp(tall.bounds, axis=0)[1] == pytest.approx(2)
    monkeypatch.setattr(cache, "readers_digest", lambda: "other readers")
    load_normalised(spec, folder=folder)
    assert len(counted) == 3


@pytest.mark.parametrize("library", ["usd-core", "opengl_basisu", "DracoPy", "meshopt", "lxml"])
def test_models_are_read_again_once_a_library_is_installed(library, spec, counted, monkeypatch, tmp_path):
    def version(name):
        if name == library and not installed:
            raise PackageNotFoundError
        return "1.0"

    installed = False
    monkeypatch.setattr(cache, "version", version)
    monkeypatch.setattr(cache, "readers_digest", cache.readers_digest.__wrapped__)  # as in a process of its own
    load_normalised(spec, folder=tmp_path / "cache")
    load_normalised(spec, folder=tmp_path / "cache")
    assert len(counted) == 1
    installed = True
    load_normalised(spec, folder=tmp_path / "cache")
    assert len(counted) == 2


def test_damaged_entries_are_built_again(spec, tmp_path):
    folder = tmp_path / "cache"
    first = load_normalised(spec, folder=folder)
    entries = sorted(folder.iterdir())
    assert {entry.suffix for entry in entries} == {".arrays"}
    for entry in entries:
        whole = entry.read_bytes()
        for damaged in (b"", whole[: len(whole) // 2], b"x" * len(whole)):
            entry.write_bytes(damaged)
            assert_same(first, load_normalised(spec, folder=folder))
            assert entry.read_bytes() == whole


def test_an_unwritable_cache_is_no_error(spec, write):
    blocked = write("blocked", b"a file, not a folder")
    assert len(load_normalised(spec, folder=blocked / "cache").triangles) == 4


def test_equal_files_in_two_folders_share_an_entry(spec, counted, write, tmp_path):
    import shutil

    copy = shutil.copytree(tmp_path / "m", tmp_path / "copy")
    first = load_normalised(spec, folder=tmp_path / "cache")
    second = load_normalised(spec.model_copy(update={"source": str(copy / "a.obj")}), folder=tmp_path / "cache")
    assert len(counted) == 1
    assert_same(first, second)


def test_models_of_a_source_are_normalised_and_not_cached(spec, tmp_path):
    mug = spec.model_copy(update={"source": "zoo:mug", "seed": 1, "centring": "floor"})
    found = load_normalised(mug, tmp_path / "other")
    assert found.bounds[0, 2] == 0
    assert not (tmp_path / "other").exists()


def test_missing_models_are_reported_by_the_reader(spec, tmp_path):
    with pytest.raises(ModelError, match="no such file"):
        load_normalised(spec.model_copy(update={"source": str(tmp_path / "no.obj")}), folder=tmp_path / "cache")


def test_the_environment_moves_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    assert cache_folder() == tmp_path / "models"


def test_what_a_file_tells_is_asked_again_where_an_entry_is_damaged(monkeypatch, write, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    file, beside, asked = write("m/a.glb", b"model"), write("m/beside.bin", b"1"), []

    def ask():
        asked.append(1)
        return {"seconds": 2.5}, [file, beside]

    for _ in range(2):
        assert cache.cached_facts(file, "timeline", ask) == {"seconds": 2.5}
    assert len(asked) == 1
    (entry,) = cache_folder().iterdir()
    whole = entry.read_bytes()
    entry.write_bytes(whole.replace(b"2.5", b"3.5"))
    assert cache.cached_facts(file, "timeline", ask) == {"seconds": 2.5}
    assert entry.read_bytes() == whole
    write("m/beside.bin", b"2")
    cache.cached_facts(file, "timeline", ask)
    assert len(asked) == 3
