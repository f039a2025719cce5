"""docs/formats-in.md: its limits are the code's, its tables what happens; and no file of the corpus does harm.

`python tests/assets/test_formats_in.py` prints the tables.
"""

import os
import re
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from deadline import DEADLINE
from viewsphere.assets.cache import load
from viewsphere.assets.load import KNOWN, load_model
from viewsphere.assets.readers import readers, suffixes
from viewsphere.assets.sandbox import server as reader_process
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.blender.interpreter import find_blender
from viewsphere.errors import MissingExtraError, ModelError
from viewsphere.limits import limits
from viewsphere.model.model_spec import ModelSpec

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "formats-in.md"
MODELS = ROOT.parent / "shared" / "models"
KINDS = {"glb": "GLB", "gltf": "glTF", "obj": "OBJ", "off": "OFF", "ply": "PLY", "stl": "STL"}

corpus = pytest.mark.skipif(not (MODELS / "broken").is_dir(), reason="the folder of real models is not there")


def table(header):
    """Cells of the page's table with this header, row by row."""
    lines = PAGE.read_text("utf-8").split("\n")
    rows = []
    for line in lines[lines.index(header) + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def read_apart(path, folder):
    """What becomes of a file in a process of its own, in words."""
    spec = ModelSpec(key="a", source=str(path), category="thing", category_id=1)
    try:
        mesh, _ = load(spec, folder=folder)
    except ModelError as error:
        return str(error)
    count = len(mesh.warnings)
    words = f"{len(mesh.triangles):,} triangle{'s' * (len(mesh.triangles) != 1)}"
    return words + (f", {count} warning{'s' * (count != 1)}" if count else "")


def awkward_rows():
    """Each awkward model's name and its outcome."""
    rows = []
    for path in sorted((MODELS / "awkward").iterdir()):
        if path.suffix != ".mtl":
            said = read_apart(path, Path(os.environ["VIEWSPHERE_CACHE"]))
            rows.append((path.name, "refused" if said.startswith(str(path)) else said, said))
    return rows


def has_blender():
    try:
        return bool(find_blender())
    except MissingExtraError:
        return False


def kind(path):
    """The row of the broken files' table that a file belongs to."""
    suffix = path.suffix[1:].lower()
    return KINDS.get(suffix) or ("pictures" if suffix in readers()["picture"].suffixes else "other endings")


def broken_files():
    return sorted(path for path in (MODELS / "broken").rglob("*") if path.is_file())


def broken_rows(outcomes):
    """Kind, loaded, refused."""
    loaded, refused = Counter(), Counter()
    for path, said in outcomes:
        (refused if said.startswith(str(path)) else loaded)[kind(path)] += 1
    names = sorted(loaded | refused, key=lambda name: (name == "other endings", name.lower()))
    return [[name, f"{loaded[name]}", f"{refused[name]}"] for name in names]


def test_every_kind_that_is_read_is_named():
    text = " ".join(row[0] for row in table("| Kind | Up, front | Unit |")).lower()
    names = {"3mf": "3mf", "jpg": "jpeg", "tif": "tiff"}
    assert all(names.get(suffix, suffix) in text for suffix in (*suffixes(), *readers()["picture"].suffixes))


def test_axes_are_those_of_the_code(write):
    files = {
        "OBJ": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        "OFF": ("a.off", "OFF\n3 1 0\n0 0 0\n2 0 0\n0 3 0\n3 0 1 2\n"),
    }
    for row in table("| Kind | Up, front | Unit |"):
        if row[0].split()[0] in files:
            _, facts = load_model(write(*files[row[0].split()[0]]))
            assert row[1:] == [f"{facts.up}, {facts.forward}", f"{facts.unit:g} m"]


@pytest.mark.parametrize("suffix", KNOWN)
def test_known_kinds_that_are_not_read_say_what_to_do(suffix, tmp_path):
    with pytest.raises(ModelError, match="convert it to GLB") as error:
        load_model(tmp_path / f"a.{suffix}")
    assert KNOWN[suffix] in str(error.value)
    assert "\n" not in str(error.value)


@corpus
@pytest.mark.slow
@pytest.mark.usefixtures("apart")
def test_awkward_files_become_what_the_page_says(monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    rows = awkward_rows()
    said = table("| File | Outcome | Remark |")
    if not has_blender():
        said = [row for row in said if Path(row[0].strip("`")).suffix[1:] not in suffixes(by_blender=True)]
        rows = [row for row in rows if Path(row[0]).suffix[1:] not in suffixes(by_blender=True)]
    assert [tuple(row[:2]) for row in said] == [(f"`{name}`", outcome) for name, outcome, _ in rows]
    for (name, outcome, error), (_, _, remark) in zip(rows, said, strict=True):
        if outcome == "refused":
            quoted = re.search(r'"(.+?)"', remark)
            assert quoted is not None, name
            assert quoted[1] in error


@pytest.fixture
def apart(monkeypatch):
    """Files are read in processes of their own; a function that ends those that wait for a file."""
    monkeypatch.delenv(READ_HERE)
    end = partial(reader_process._close_all, reader_process._idle_readers(os.getpid()), os.getpid())
    yield end
    end()


@corpus
@pytest.mark.slow
def test_no_broken_file_does_harm(apart, monkeypatch, tmp_path):
    """Each in a process of its own: loaded, or one line that names the file; quick, small, and nothing written elsewhere."""
    import resource

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_SECONDS", str(float(DEADLINE)))
    before = max(resource.getrusage(of).ru_maxrss for of in (resource.RUSAGE_CHILDREN, resource.RUSAGE_SELF))
    files = broken_files()
    assert len(files) > 250
    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        outcomes = list(pool.map(lambda path: read_apart(path, tmp_path / "cache"), files))
    apart()
    for path, said in zip(files, outcomes, strict=True):
        assert "MAX_READ_SECONDS" not in said
        assert "\n" not in said
        assert said.startswith(f"{path}: ") or said.startswith(f"{path}.") or re.match(r"[\d,]+ triangle", said), said
        assert "crashed" not in said
        assert "its reader failed" not in said
    assert [p.name for p in tmp_path.iterdir()] == ["cache"]
    assert {p.suffix for p in (tmp_path / "cache").iterdir()} == {".arrays"}
    most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    larger = most > before  # children of earlier tests count, too; and a child begins with what its parent needed
    assert not larger or most * (1 if sys.platform == "darwin" else 1024) < limits.MAX_READ_BYTES
    rows = broken_rows(zip(files, outcomes, strict=True))
    assert table("| Kind | Loaded | Refused |") == rows


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        os.environ["VIEWSPHERE_CACHE"] = place
        for name, outcome, error in awkward_rows():
            print(f"| `{name}` | {outcome} | {error if outcome == 'refused' else ''} |")
        with ThreadPoolExecutor(2) as pool:
            found = list(pool.map(lambda path: (path, read_apart(path, Path(place))), broken_files()))
        for row in broken_rows(found):
            print(f"| {' | '.join(row)} |")
