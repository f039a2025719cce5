"""PASCAL3D+ as others have it is rendered again as it is imported: objects, splits, sizes, and what is refused."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from test_pascal3d_reading import FACES, KIT, SIZE, VERTICES, data_set, record, structs, thing, viewpoint

from viewsphere import Dataset
from viewsphere.errors import RecipeError, StoreError
from viewsphere.formats import pascal3d
from viewsphere.formats.shared.viewpoint_mat import off_bytes
from viewsphere.planning.plan import plan
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.reproduce import make_again
from viewsphere.store.source_cameras import Drafted, SourceModel


def shots_of(source, place):
    """The recipe that is made, and its lines."""
    made = make_again("pascal3d", source, place / "again")
    return made, [json.loads(line) for line in (place / "again/shots.jsonl").read_text().splitlines()]


@pytest.fixture
def mine(tmp_path):
    """A data set of which all objects of a picture have one lens."""
    source = data_set(tmp_path / "mine")
    record(source / "Annotations/car_imagenet/n03.mat", [thing(view=viewpoint())])
    return source


def test_a_category_is_read_from_its_own_folder(mine, tmp_path):
    """2008_01 lies in those of car and bus, and each record knows the viewpoint of its own category alone."""
    _, lines = shots_of(mine, tmp_path)
    shown = [line for line in lines if line["name"].startswith("2008_01")]
    assert sorted(o["model"].split("_")[0] for line in shown for o in line["objects"]) == ["bus", "car"]


def test_splits_and_order_are_those_of_the_import(mine, tmp_path):
    main, lists = mine / KIT / "ImageSets/Main", mine / "Image_sets"
    shutil.rmtree(lists)
    shutil.rmtree(main)
    main.mkdir()
    for name, text in {"bus_val": "n01\n", "car_trainval": "n03\n2008_01\n", "car_test": "n02\n"}.items():
        (main / f"{name}.txt").write_text(text)
    import_dataset("pascal3d", mine, tmp_path / "in")
    known = [
        (sample.source["file_name"].rpartition("/")[2].partition(".")[0], sample.split) for sample in Dataset(tmp_path / "in")
    ]
    _, lines = shots_of(mine, tmp_path)
    found = dict.fromkeys((line["name"].partition("-")[0], line["split"]) for line in lines)
    assert list(found) == [one for one in known if one[0] != "n02"]  # which has no exact viewpoint
    assert dict(found) == {("n01", "train"): None, ("n03", "trainval"): None, ("2008_01", "trainval"): None}


@pytest.mark.parametrize("what", ["folder", "dangling", "large"])
def test_lists_that_cannot_be_read_are_told(mine, tmp_path, monkeypatch, what):
    file = mine / KIT / "ImageSets/Main/car_train.txt"
    match what:
        case "folder":
            file.mkdir()
        case "dangling":
            file.symlink_to("nowhere.txt")
        case "large":
            monkeypatch.setenv("VIEWSPHERE_MAX_ANNOTATION_BYTES", "100000")
            file.write_text("n01\n" * 30_000)
    with pytest.raises(StoreError, match=r"car_train.txt: expected names of pictures; found: ") as error:
        make_again("pascal3d", mine, tmp_path / "again")
    assert "\n" not in str(error.value) and ("MAX_ANNOTATION_BYTES" in str(error.value)) == (what == "large")
    assert not (tmp_path / "again").exists()


LENS = np.array([[60.0, 0, 25.5], [0, 60, 20.5], [0, 0, 1]])


def test_a_lens_of_another_size_than_its_picture_is_refused(mine, tmp_path):
    """K is for pictures of imgsize; without K, whose pixels nobody knows, the picture counts."""
    record(mine / "Annotations/car_imagenet/n01.mat", [thing(view=viewpoint())], imgsize=np.array([[25.0, 20, 3]]), K=LENS)
    message = r"n01.mat: expected a picture of 25 x 20 pixels, as imgsize beside K says; found 50 x 40"
    with pytest.raises(StoreError, match=message):
        make_again("pascal3d", mine, tmp_path / "again")
    with pytest.raises(StoreError, match=message):
        import_dataset("pascal3d", mine, tmp_path / "in")
    assert import_dataset("pascal3d", mine, tmp_path / "in", keep_going=True).count == 3


def test_without_a_lens_the_picture_says_its_size(mine, tmp_path):
    record(mine / "Annotations/car_imagenet/n01.mat", [thing(view=viewpoint())], imgsize=np.array([[25.0, 20, 3]]))
    made, lines = shots_of(mine, tmp_path)
    assert {(line["camera"]["width"], line["camera"]["height"]) for line in lines} == {SIZE}
    assert "1 pictures have another size than their record's imgsize, and are taken for right" in made.notes


def test_without_pictures_the_record_says_their_size(mine, tmp_path):
    record(mine / "Annotations/car_imagenet/n01.mat", [thing(view=viewpoint())], imgsize=np.array([[25.0, 20, 3]]))
    shutil.rmtree(mine / "Images")
    _, lines = shots_of(mine, tmp_path)
    assert {line["name"]: line["camera"]["width"] for line in lines if line["name"].startswith("n")} == {"n01": 25, "n03": 50}


@pytest.mark.parametrize("names", [("a.b", "a b"), ("Car", "car"), ("car", "car_2", "car.2")])
@pytest.mark.parametrize("files", ["mat", "off"])
def test_categories_that_become_one_word_stay_apart(tmp_path, names, files):
    source, place = tmp_path / "mine", tmp_path / "mine/CAD"
    for i, name in enumerate(names):
        record(source / f"Annotations/{name}_pascal/p{i}.mat", [thing(name, view=viewpoint())])
        (place / name).mkdir(parents=True)
        if files == "mat":
            savemat(place / f"{name}.mat", {name: structs([{"vertices": VERTICES * (i + 1), "faces": FACES}])})
        else:
            (place / name / "01.off").write_bytes(off_bytes(VERTICES * (i + 1), FACES - 1))
    _, lines = shots_of(source, tmp_path)
    keys = [line["objects"][0]["model"] for line in lines]
    specs = {spec.key: spec for spec in plan(str(tmp_path / "again/recipe.yaml")).model_specs}
    assert len(set(keys)) == len(names)
    for i, (name, key) in enumerate(zip(names, keys, strict=True)):
        first = Path(specs[key].source).read_text().splitlines()[2]
        assert specs[key].category == name and first == " ".join(map(repr, (VERTICES * (i + 1))[0].tolist()))


def test_what_a_recipe_refuses_names_the_folder_that_is_asked_for(mine, tmp_path, monkeypatch):
    """Two models of one key, as of a format that does not tell its words apart."""
    twice = {str(i): SourceModel(Drafted(f"car/0{i}.off", b"OFF"), kind, name="car") for i, kind in enumerate(("a", "b"))}
    shown = pascal3d.source_cameras(mine)
    shows = replace(shown, models={**shown.models, **twice})
    monkeypatch.setattr(pascal3d, "FORMAT", pascal3d.FORMAT.model_copy(update={"as_recipe": lambda _: shows}))
    with pytest.raises(RecipeError, match="expected every model once") as error:
        make_again("pascal3d", mine, tmp_path / "again")
    assert str(tmp_path / "again/models/car/0") in str(error.value) and ".again-" not in str(error.value)
