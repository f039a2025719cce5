"""Recipes at URLs: what they make is what their copies on a disk make."""

from contextlib import contextmanager
from pathlib import Path

import fsspec
import numpy as np
import pytest

import viewsphere as vs
from quick import quick
from small import small_recipe, tree_hash
from viewsphere.caches import cache_of
from viewsphere.errors import RecipeError, RemoteError
from viewsphere.recipe.reading.fetched import PREFIX, fetched
from viewsphere.recipe.recipe import Recipe
from viewsphere.scratch import scratch_folder
from viewsphere.urls import download, files_below, located, remote_path

TETRAHEDRON = "mtllib t.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
BASE = small_recipe(channels=["rgb", "instances"], formats=[]).to_yaml()
RECIPE = """
extends: base.yaml
models: [{source: "models/*.obj", category: thing, scale: {length: 0.3}}]
"""
FILES = {
    "base.yaml": BASE,
    "recipe.yaml": RECIPE,
    "models/t.obj": TETRAHEDRON,
    "models/t.mtl": "newmtl red\nKd 0.8 0.1 0.1\n",
}


@pytest.fixture
def url(monkeypatch, tmp_path):
    """The recipe's folder in this process's memory, which is asked again at once."""
    monkeypatch.setattr(remote_path, "FIRST_WAIT_S", 0.0)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    memory = fsspec.filesystem("memory")
    memory.store.clear()
    memory.pseudo_dirs[:] = [""]
    for name, text in FILES.items():
        (located("memory://cars") / name).write_bytes(text.encode())
    yield "memory://cars/recipe.yaml"
    memory.store.clear()


@pytest.fixture
def file(tmp_path):
    """The same on the disk."""
    for name, text in FILES.items():
        (tmp_path / "cars" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "cars" / name).write_text(text)
    return tmp_path / "cars/recipe.yaml"


@pytest.mark.parametrize("kind", quick([str, Path, located], Path))
def test_it_makes_what_its_copy_makes(url, file, tmp_path, kind):
    assert Recipe.load(kind(url)).digest == Recipe.load(file).digest
    if kind is str:
        vs.generate(kind(url), tmp_path / "one")
        vs.generate(kind(url), tmp_path / "two")
        vs.generate(file, tmp_path / "here")
        assert tree_hash(tmp_path / "one") == tree_hash(tmp_path / "two")
        for one, other in zip(vs.open(tmp_path / "one"), vs.open(tmp_path / "here"), strict=True):
            assert np.array_equal(one.rgb, other.rgb) and one.rgb.std() > 0
            assert [o.rle for o in one.objects] == [o.rle for o in other.objects]


def test_a_file_on_the_disk_is_read_where_it_is(file):
    assert fetched(file) == file and Recipe.load(file).folder == file.parent


@pytest.mark.slow
def test_loaders_of_a_remote_recipe_give_each_frame_once_an_epoch(url):
    data = pytest.importorskip("torch.utils.data")
    frames = vs.render(url, shuffle=True, epochs=2)
    loader = data.DataLoader(frames, batch_size=None, num_workers=2, collate_fn=lambda sample: sample.index)
    given = list(loader)
    assert len(given) == 12 and sorted(given) == sorted([*range(6), *range(6)])


def test_a_copy_is_what_the_url_holds_now(url):
    first = fetched(url)
    kept = first.stat().st_ino
    assert fetched(url) == first and first.stat().st_ino == kept and first.parent.parent == cache_of("recipes")
    (located("memory://cars") / "models/t.mtl").write_bytes(b"newmtl red\nKd 0.1 0.8 0.1\n")
    assert fetched(url) == first and "0.1 0.8" in (first.parent / "models/t.mtl").read_text()
    first.write_text("name: spoilt here\n")
    assert "extends" in fetched(url).read_text()
    assert not list(cache_of("recipes").glob(f"{PREFIX}*"))


@pytest.mark.slow
def test_a_data_set_beside_the_recipe_is_not_copied(url):
    vs.generate(url, "memory://cars/out")
    before = (located("memory://cars/out") / "store/plan.json").read_bytes()
    assert not (fetched(url).parent / "out").exists()
    assert vs.generate(url, "memory://cars/out").rendered == 0
    assert (located("memory://cars/out") / "store/plan.json").read_bytes() == before


def test_a_cache_that_cannot_be_written_is_told(url, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "file"))
    with pytest.raises(RecipeError, match=r"file/recipes: expected to keep memory://cars there, found Not a directory"):
        Recipe.load(url)


def test_one_that_is_not_there_is_told(url):
    with pytest.raises(RecipeError, match=r"memory://cars/other\.yaml: expected a readable recipe file, found none"):
        Recipe.load("memory://cars/other.yaml")


def test_a_folder_of_a_whole_store_is_refused(url, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_FETCHED_BYTES", "300")
    with pytest.raises(RecipeError, match=r"at most 300 bytes .*MAX_FETCHED_BYTES\), found more"):
        Recipe.load(url)


@pytest.mark.parametrize("known", [True, False])
def test_no_more_is_written_than_may_be(url, monkeypatch, known):
    """Where the file system tells sizes, nothing is written; where it does not, no more than the limit."""
    kind = fsspec.get_filesystem_class("memory")
    found, written = kind.find, []

    def find(self, path, **options):
        return {name: {**info, "size": info["size"] if known else None} for name, info in found(self, path, **options).items()}

    @contextmanager
    def weighed(place, prefix):
        with scratch_folder(place, prefix) as own:
            try:
                yield own
            finally:
                written.append(sum((own / "new" / name).stat().st_size for name in files_below(own / "new")))

    monkeypatch.setattr(kind, "find", find)
    monkeypatch.setattr("viewsphere.recipe.reading.fetched.scratch_folder", weighed)
    whole = sum(map(len, FILES.values()))
    monkeypatch.setenv("VIEWSPHERE_MAX_FETCHED_BYTES", str(whole - 1))
    with pytest.raises(RecipeError, match=rf"at most {whole - 1:,} bytes .*MAX_FETCHED_BYTES\), found more"):
        fetched(url)
    monkeypatch.setenv("VIEWSPHERE_MAX_FETCHED_BYTES", str(whole))
    assert fetched(url).is_file()
    assert written[0] == (0 if known else whole - 1)


def test_a_download_stops_where_it_may_not_go_on(url, tmp_path):
    file = located("memory://cars/base.yaml")
    for most, whole in ((0, False), (len(BASE) - 1, False), (len(BASE), True)):
        assert download(file, tmp_path / "copy", most) == whole
        assert (tmp_path / "copy").read_text() == BASE[:most]


@pytest.mark.parametrize("name", ["../../outside", "a/../../../outside"])
def test_names_that_lead_out_are_refused(url, monkeypatch, name):
    kind = fsspec.get_filesystem_class("memory")
    found = kind.find

    def find(self, path, **options):
        return {**found(self, path, **options), f"/cars/{name}": {"name": f"/cars/{name}", "size": 3}}

    monkeypatch.setattr(kind, "find", find)
    with pytest.raises(RemoteError, match=r"memory://cars: expected names without '\.\.', found '.*outside'"):
        Recipe.load(url)
