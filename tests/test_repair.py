"""What is damaged is made again, to the last byte, and nothing else is touched."""

import json
import shutil
from pathlib import Path

import pytest

from cube_dataset import make
from quick import quick
from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store.shots.manifest import MANIFEST, Manifest


@pytest.fixture
def spoilt(small_run, tmp_path):
    """A copy of the small data set, its exports' pictures links of the store's as before."""
    first = {}  # copies by the file that they are copies of

    def copy(source, target):
        file = Path(source).stat().st_ino
        if file in first:
            Path(target).hardlink_to(first[file])
        else:
            first[file] = shutil.copy2(source, target)

    return shutil.copytree(small_run, tmp_path / "out", copy_function=copy)


def times(root):
    return {file: file.stat().st_mtime_ns for file in root.rglob("*") if file.is_file()}


def flip(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.unlink()  # an export's link stays whole
    file.write_bytes(data)


def kinds(root):
    """One file of every kind in the store, each of another shot where there is one."""
    found = {}
    for file in sorted(root.glob("store/*/**/*")):
        if file.is_file():
            kind = file.suffix if "models" in file.parts else (file.parent.name if file.suffix != ".json" else file.name)
            found.setdefault((kind, file.name == MANIFEST), []).append(file)
    return [files[i % len(files)] for i, files in enumerate(found.values())]


@pytest.mark.slow
def test_whole_data_sets_are_left_alone(spoilt):
    before = times(spoilt)
    found = repair(spoilt)
    assert found.report.ok and found.done == ()
    assert times(spoilt) == before


def folder_of(file):
    """The shot's or model's folder that a file of the store lies in."""
    return file.parent if file.suffix == ".json" or "models" in file.parts else file.parent.parent


def rounds(files):
    """The files in lots of at most four, no two of one folder, so that other folders have to stay as they are."""
    lots = []
    for file in files:
        free = (lot for lot in lots if len(lot) < 4 and folder_of(file) not in map(folder_of, lot))
        if (lot := next(free, None)) is not None:
            lot.append(file)
        else:
            lots.append([file])
    return lots


@pytest.mark.slow
def test_every_kind_of_file_is_made_again(small_run, spoilt):
    files = kinds(spoilt)
    assert len(files) >= 16
    for lot in rounds(files):
        for file in lot:
            flip(file)
        before = times(spoilt)
        assert not check(Dataset(spoilt), fast=True).ok
        found = repair(spoilt, rays=False, sample=0)
        assert found.report.ok, (lot, found.report.findings)
        assert tree_hash(spoilt) == tree_hash(small_run), lot
        folders = [folder_of(file) for file in lot]
        assert sorted(line.split()[1] for line in found.done) == sorted(f"{folder.name}:" for folder in folders)
        changed = {path for path, time in times(spoilt).items() if before.get(path) != time}
        assert changed and all(any(path.is_relative_to(folder) for folder in folders) for path in changed)


@pytest.mark.slow
def test_what_is_lost_is_made_again(small_run, spoilt):
    """A whole shot, a shot's manifest, its channel, and a model."""
    shots = sorted(spoilt.glob("store/shots/*/*"))
    lost = [shots[0], shots[1] / MANIFEST, shots[2] / "depth", sorted(spoilt.glob("store/models/*"))[0]]
    for path in lost:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    found = repair(spoilt, rays=False)
    assert found.report.ok and len(found.done) == len(lost)
    assert tree_hash(spoilt) == tree_hash(small_run)


@pytest.mark.slow
def test_labels_that_were_sealed_again_are_rendered_again(small_run, spoilt):
    file = sorted(spoilt.glob("store/shots/*/*/frames.json"))[2]
    records = json.loads(file.read_text())
    records[0]["objects"][0]["visibility"][0] /= 2
    file.write_text(json.dumps(records))
    Manifest.from_folder(file.parent).write(file.parent)
    found = repair(spoilt, rays=False)
    assert found.report.ok, found.report.findings
    assert found.done == (
        f"shot {file.parent.name}: rendered again",
        *(f"export {name}: written again" for name in ("coco", "native")),
    )
    assert tree_hash(spoilt) == tree_hash(small_run)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_picture_spoilt_in_store_and_exports_alike(small_run, spoilt, workers):
    """Links are one file: what is written into one is in all."""
    file = sorted(spoilt.glob("store/shots/*/*/rgb/*.png"))[0]
    with file.open("r+b") as stream:
        stream.seek(400)
        stream.write(b"x")
    assert tree_hash(spoilt / "coco") != tree_hash(small_run / "coco")
    found = repair(spoilt, rays=False, workers=workers)
    assert found.report.ok, found.report.findings
    assert tree_hash(spoilt) == tree_hash(small_run)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coco", "native"])
def test_a_damaged_export_is_written_again(small_run, spoilt, name):
    file = next((spoilt / name).rglob("*.json"))
    flip(file)
    other = times(spoilt / "store")
    found = repair(spoilt, rays=False)
    assert found.report.ok and found.done == (f"export {name}: written again",)
    assert tree_hash(spoilt) == tree_hash(small_run)
    assert times(spoilt / "store") == other


def with_files(root, **changes):
    """A recipe of two model files in a folder beside the data set."""
    source = make(root / "source")
    (root / "recipe" / "cars").mkdir(parents=True)
    for i in range(2):
        shutil.copyfile(source.path(f"store/models/block-{i}/block-{i}.glb"), root / "recipe" / "cars" / f"{i}.glb")
    shutil.rmtree(source.root)
    values = small_recipe(channels=["rgb", "depth", "instances"], formats=[]).model_dump(mode="json")
    values |= {"models": [{"source": "cars/*.glb", "category": "car"}], "viewpoints": {"azimuth": [0, 120], "distance": 4.0}}
    (root / "recipe" / "recipe.json").write_text(json.dumps({**values, **changes}))
    from viewsphere import Recipe

    recipe = Recipe.load(root / "recipe" / "recipe.json")
    generate(recipe, root / "out")
    return root / "out"


@pytest.mark.slow
def test_a_recipe_s_folder_is_found_by_its_models(tmp_path):
    out = with_files(tmp_path)
    whole = tree_hash(out)
    for file in (
        next(out.glob("store/shots/*/*/depth/*")),
        next(out.glob("store/models/*/*.glb")),
        next(out.glob("store/**/shot.json")),
    ):
        flip(file)
        assert repair(out, rays=False).report.ok
        assert tree_hash(out) == whole


@pytest.mark.parametrize("change", quick(["gone", "another"], "another"))
def test_models_that_are_not_what_they_were(tmp_path, change):
    out = with_files(tmp_path)
    cars = sorted((tmp_path / "recipe" / "cars").iterdir())
    if change == "gone":
        for car in cars:
            car.unlink()
    else:
        shutil.copyfile(cars[1], cars[0])
    flip(next(out.glob("store/shots/*/0-*/depth/*")))
    flip(next(out.glob("store/models/0/*.glb")))
    spoilt = tree_hash(out)
    found = repair(out, rays=False)
    assert not found.report.ok and found.done == ()
    messages = [finding.message for finding in found.report.findings if finding.check == "repair"]
    assert [message.split(":")[0] for message in messages] == [
        "model 0 cannot be made again",
        "shot 0-000000 cannot be rendered again",
    ]
    assert all("put" in message and "back" in message for message in messages)
    assert tree_hash(out) == spoilt


@pytest.mark.slow
def test_parts_are_made_again_by_their_own_recipes(tmp_path):
    first = small_recipe(formats=["coco"], channels=["rgb", "depth"])
    generate(first, tmp_path / "out")
    more = small_recipe(
        formats=["coco"],
        channels=["rgb", "depth", "instances"],
        viewpoints={"azimuth": [0, 60, 120, 240], "elevation": [15, 50], "distance": 1.0},
    )
    generate(more, tmp_path / "out", append=True)
    whole = tree_hash(tmp_path / "out")
    for file in sorted(tmp_path.glob("out/store/shots/*/*/*/*"))[::5]:
        flip(file)
    found = repair(tmp_path / "out", rays=False)
    assert found.report.ok, found.report.findings
    assert len(found.done) > 4
    assert tree_hash(tmp_path / "out") == whole


@pytest.mark.slow
def test_what_came_from_elsewhere_cannot_be_rendered(small_run, tmp_path):
    generate(small_recipe(seed=1), tmp_path / "two")
    merge([small_run, tmp_path / "two"], tmp_path / "out")
    for file in (next(tmp_path.glob("out/store/shots/*/*/depth/*")), next(tmp_path.glob("out/store/shots/*/*/manifest.json"))):
        flip(file)
        spoilt = tree_hash(tmp_path / "out")
        found = repair(tmp_path / "out", rays=False)
        assert any("merge or import it anew" in finding.message for finding in found.report.findings)
        assert tree_hash(tmp_path / "out") == spoilt


@pytest.mark.slow
def test_exports_are_left_alone_while_frames_are_lost(small_run, tmp_path):
    """A merged shot cannot be rendered here; its pictures in the exports are the last copy."""
    generate(small_recipe(seed=1), tmp_path / "two")
    merge([small_run, tmp_path / "two"], tmp_path / "out")
    export(tmp_path / "out", ["coco"])
    exported = tree_hash(tmp_path / "out" / "coco")
    shutil.rmtree(next(tmp_path.glob("out/store/shots/*/*")))
    found = repair(tmp_path / "out", rays=False)
    assert not found.report.ok and found.done == ()
    assert any("merge or import it anew" in finding.message for finding in found.report.findings)
    assert any("export coco is not written again" in finding.message for finding in found.report.findings)
    assert tree_hash(tmp_path / "out" / "coco") == exported


@pytest.mark.slow
def test_a_shot_without_records_is_made_again(small_run, spoilt):
    file = sorted(spoilt.glob("store/shots/*/*/frames.json"))[0]
    file.write_text("{}")
    assert repair(spoilt, rays=False).report.ok
    assert tree_hash(spoilt) == tree_hash(small_run)


@pytest.mark.slow
def test_frames_and_exports_are_proved_by_several_processes_as_by_one(spoilt, monkeypatch):
    file = sorted(spoilt.glob("coco/annotations/*.json"))[0]
    file.write_text(file.read_text().replace('"tilt":0.0', '"tilt":0.5', 1))
    monkeypatch.setattr("viewsphere.check.FEWEST", 3)
    report = check(Dataset(spoilt), workers=2)
    assert [finding.check for finding in report.findings] == ["coco", "coco"]
    assert report.findings[1].frame is not None
    assert report == check(Dataset(spoilt))
