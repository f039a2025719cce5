"""Files, and values of a data set's records, that raised foreign errors once: each is refused in one line."""

import json
import shutil
import struct

import pytest
from targets import CAMERAS, COLMAP, FILED, OPENCV, ORBITS, PLY, ROS, SEQUENCE, TARGETS, _encoded, _made, _played

from sealing import seal_again
from viewsphere.check import check
from viewsphere.errors import ViewsphereError
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.planning.rig_files import read_rig
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.run.status import status
from viewsphere.store import Dataset
from viewsphere.store.index import Block, Index
from viewsphere.store.shots.manifest import MANIFEST, Manifest, digest, sealed, unsealed
from viewsphere.store.texts import MOST_NESTED, parsed


def part(**changes):
    return lambda plan: plan["parts"][0].update(changes)


def thing(**changes):
    return lambda records: records[0]["objects"][0].update(changes)


def picture(**changes):
    return lambda records: records[0].update(changes)


PLANS = {
    "frames are a text": part(frames="x"),
    "most objects are a text": part(max_objects="x"),
    "objects below none": part(max_objects=-3),
    "names of poses are a list": part(pose_names=[]),
    "names of poses are no base64": part(pose_names="A"),
    "names of other poses": part(pose_names="AAAAAAAAAAA=", new_poses=2),
    "channels of a later part": part(supplies=[[3, ["depth"]]]),
    "a recipe is a text": lambda plan: plan.update(recipe="x"),
    "a category's number is a list": lambda plan: plan["categories"][0].update(id=[]),
    "a field that nobody knows": lambda plan: plan.update(more=1),
}
RECORDS = {
    "a box of texts": thing(box2d=["a", 0, 1, 1]),
    "a box of two numbers": thing(box2d=[0, 1]),
    "a box without end": thing(box2d=[0, 0, 1, float("inf")]),
    "a huge number": thing(box3d=[[10**400, 0, 0]] * 8),
    "run lengths of another picture": thing(rle={"height": 18, "width": 24, "counts": "e43?3L1000"}),
    "a mask of 10^12 pixels": thing(rle={"height": 10**6, "width": 10**6, "counts": "0"}),
    "an area is a list": thing(area=[]),
    "another category": thing(category_id=77),
    "an object's number is a text": thing(id="1"),
    "an infinite source": picture(source={"score": float("inf")}),
    "another frame's number": picture(index=3),
    "no number": picture(index="0"),
    "a size of two texts": picture(size=["a", "b"]),
    "a sensor is a number": picture(sensor=3),
    "a camera's motion of two numbers": lambda records: records[0]["camera"].update(t=[0, 1]),
}
MODELS = {
    "real sizes of two": lambda info: info.update(real_size=[1, 2]),
    "a box of one vertex": lambda info: info.update(box3d_object=[[0, 0, 0]]),
    "a number in a name's place": lambda info: info.update(category=3),
    "a category's number is a list": lambda info: info.update(category_id=[1]),
}
CASES = [
    *(("store/plan.json", name, change) for name, change in PLANS.items()),
    *(("store/shots/*/*/frames.json", name, change) for name, change in RECORDS.items()),
    *(("store/models/*/model.json", name, change) for name, change in MODELS.items()),
]


@pytest.mark.parametrize(("pattern", "name", "change"), CASES, ids=[name for _, name, _ in CASES])
def test_it_is_refused_in_one_line(pattern, name, change, tmp_path):
    root = shutil.copytree(_made(False), tmp_path / "out", ignore=shutil.ignore_patterns("coco", "native", "csv", "webdataset"))
    file = min(root.glob(pattern))
    value = unsealed(file.read_text("utf-8")) if file.name == "plan.json" else json.loads(file.read_text("utf-8"))
    change(value)
    file.write_text(sealed(value) if file.name == "plan.json" else json.dumps(value), "utf-8")
    if file.name != "plan.json":
        seal_again(root)
    with pytest.raises(ViewsphereError, match=r"expected|is unknown") as error:
        export(root, ["coco"], output=tmp_path / "exports")
    assert "\n" not in str(error.value)
    if file.name != "plan.json":
        assert not check(Dataset(root), sample=0, rays=False).ok


def ros(**changes):
    return json.dumps({**ROS, "camera_matrix": {**ROS["camera_matrix"], **changes}})


def nested(times):
    return "[" * times + "]" * times


BOX = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 5}}
FILES = {
    "an angle of nearly nothing": (
        "recipe",
        "recipe.yaml",
        json.dumps(BOX | {"camera": {"size": [64, 48], "fov_deg": 1e-320}}),
    ),
    "a mark of byte order in a name": ("recipe", "recipe.yaml", 'viewpoi\ufeff": {"azimuth": "start": 0}}'),
    "a base whose name is no path": ("recipe", "recipe.yaml", '{"extends": "\\u0000"}'),
    "a table whose name is no path": ("recipe", "recipe.yaml", FILED.replace("sizes.csv", '"\\0"')),
    "models without end": (
        "recipe",
        "recipe.yaml",
        json.dumps(BOX | {"models": [{"source": "zoo:car", "count": 2**63}], "scenes": {"count": 1, "objects": 2}}),
    ),
    "a unit that is a list": ("recipe", "recipe.yaml", FILED.replace("unit: mm", "unit: [mm]")),
    "models by a name of nothing": ("recipe", "recipe.yaml", '{"models": {"": 0}, "viewpoints": {"distance": 5}}'),
    "a cell of a point that is longer than CSV has": ("recipe", "recipe.yaml", SEQUENCE),
    "a camera of nearly no height": ("poses", "cameras.txt", CAMERAS.decode().replace("480 420 425", "1e-320 420 425")),
    "a lens bent without end": ("poses", "cameras.txt", CAMERAS.decode().replace("0.1\n", "1e308\n")),
    "a number in a name's place": ("rigs", "rig.yaml", "1: 2\n"),
    "rows and columns below none": ("rigs", "rig.yaml", ros(rows=-3, cols=-3)),
}


@pytest.mark.parametrize(("target", "name", "text"), FILES.values(), ids=FILES)
def test_a_file_is_refused_in_one_line(target, name, text, tmp_path):
    for beside, data in {"images.txt": COLMAP, "box.ply": PLY, "rig.yaml": OPENCV, "poses.csv": ORBITS}.items():
        (tmp_path / beside).write_bytes(data)
    (tmp_path / "points.csv").write_text("0,1,2" * 100_000)
    (tmp_path / name).write_text(text, "utf-8")
    with pytest.raises(ViewsphereError, match=r"expected|is unknown") as error:
        if target == "rigs":
            read_rig([tmp_path / name])
        else:
            TARGETS[target].call(tmp_path / ("images.txt" if name == "cameras.txt" else name))
    assert "\n" not in str(error.value)


WHOLE = 10**400
"""A whole number beyond all floats."""
NATIVE = {
    "a corner of a box": lambda found: next(iter(entry(found)["bbox_3D_pxs"].values())).update({"0": [WHOLE, 0]}),
    "how much is visible": lambda found: entry(found).update(visibility=WHOLE),
    "a text that Python takes for a number": lambda found: entry(found).update(visibility="nan"),
    "a camera's matrix": lambda found: entry(found)["transformation_matrix"].update(K=[[WHOLE, 0, 0]] * 3),
    "a true size": lambda found: vehicle(found).update(real_size={"width": WHOLE, "height": 1, "length": 1}),
    "a time step": lambda found: vehicle(found).update(animation="a.glb", frame=0, seconds=WHOLE),
}


def vehicle(found):
    return next(iter(found["vehicles"].values()))


def entry(found):
    return next(iter(next(iter(found["poses"].values()))["vehicles_rendered"].values()))


@pytest.mark.parametrize("name", NATIVE)
def test_what_is_no_finite_number_is_refused_in_one_line(name, tmp_path):
    root = shutil.copytree(_made(False) / "native", tmp_path / "native")
    found = json.loads((root / "dataset1.json").read_text("utf-8"))
    NATIVE[name](found)
    (root / "dataset1.json").write_text(json.dumps(found), "utf-8")
    with pytest.raises(ViewsphereError, match=r"expected|is unknown"):
        import_dataset("native", root, tmp_path / "out")


@pytest.mark.parametrize("files", ['{"a":[1e999,"x"]}', f'{{"a":{nested(900)}}}'])
def test_a_manifest_is_refused_in_one_line(files, tmp_path):
    text = f'{{"files":{files}'
    (tmp_path / MANIFEST).write_text(f'{text},"digest":"{digest((text + "}").encode())}"}}')
    with pytest.raises(ViewsphereError, match="expected the manifest"):
        Manifest.read(tmp_path)


@pytest.mark.parametrize(
    "changes", [{"pid": "1e999"}, {"done": "1" + "0" * 400}, {"begun": "-1e999"}, {"beat": "1" + "0" * 400}]
)
def test_what_is_no_heartbeat_tells_nothing(changes, tmp_path):
    root = shutil.copytree(_made(True), tmp_path / "out", ignore=shutil.ignore_patterns("coco", "native", "csv", "webdataset"))
    file = root / "store/failed/1.json"
    assert len(status(root).failed) == 1
    value = json.loads(file.read_text()) | dict.fromkeys(changes)
    text = json.dumps(value)
    for name, number in changes.items():
        text = text.replace(f'"{name}": null', f'"{name}": {number}')
    file.write_text(text)
    assert status(root).failed == ()


def test_a_key_of_more_digits_than_python_reads_is_no_shot():
    assert Index((Block(("car",), ((0, 9),)),), 0, 1, 0).find("car-" + "9" * 5000) is None


def test_deep_brackets_are_refused_and_those_in_texts_are_none():
    for text in (nested(MOST_NESTED + 1), '{"a":' * 300 + "1" + "}" * 300, f'["\\"", {nested(300)}]'):
        with pytest.raises(ValueError, match="nested too deeply"):
            parsed(text)
    for value in (json.loads(nested(MOST_NESTED)), ["[" * 500, '"[{\\' * 300, [[]] * 300]):
        assert parsed(json.dumps(value)) == value


def test_a_tile_beyond_the_limit_of_pillow_is_refused_in_one_line(tmp_path):
    data = _encoded("TIFF")
    at = next(data.index(struct.pack("<HHI", 257, kind, 1)) for kind in (3, 4) if struct.pack("<HHI", 257, kind, 1) in data)
    high = struct.pack("<HHII", 257, 4, 1, 16_777_226)
    (tmp_path / "rgb-x").write_bytes(data[:at] + high + data[at + len(high) :])
    with pytest.raises(ViewsphereError, match="exceeds limit") as error:
        TARGETS["channels"].call(tmp_path / "rgb-x")
    assert "\n" not in str(error.value)


def frames_of(root, pattern, change):
    file = min(root.glob(f"store/shots/*/*/{pattern}"))
    value = json.loads(file.read_text("utf-8"))
    change(value)
    file.write_text(json.dumps(value), "utf-8")
    return Dataset(root)


@pytest.mark.parametrize("name", ["sequence", "split"])
def test_names_in_records_are_texts(name, tmp_path):
    root = shutil.copytree(_made(False) / "store", tmp_path / "out/store").parent
    dataset = frames_of(root, "frames.json", lambda records: records[0].update({name: []}))
    for asked in (lambda: dataset.sequences, lambda: list(dataset.positions("train"))):
        with pytest.raises(ViewsphereError, match="that is no text"):
            asked()


def test_a_shot_has_as_many_samples_as_are_planned(tmp_path):
    root = shutil.copytree(_made(True) / "store", tmp_path / "out/store").parent
    dataset = frames_of(root, "shot.json", lambda shot: shot["instants"].pop())
    with pytest.raises(ViewsphereError, match="3 samples instead of 4"):
        list(dataset.positions("train"))


@pytest.mark.parametrize(
    ("name", "value"),
    [("viewpoints", {"kind": "orbit", "elevation": [1.8e16, 0]}), ("seed", []), ("time", 3), ("files", {"shots": "x"})],
)
def test_a_recipe_in_a_plan_is_refused_in_one_line(name, value, tmp_path):
    root = shutil.copytree(_played() / "store", tmp_path / "out/store").parent
    plan = unsealed((root / "store/plan.json").read_text("utf-8"))
    plan["parts"][0]["recipe"][name] = value
    (root / "store/plan.json").write_text(sealed(plan), "utf-8")
    with pytest.raises(ViewsphereError, match=r"plan\.json.*expected") as error:
        merge([root, _made(True)], tmp_path / "merged", mixed=True, keep_going=True)
    assert "\n" not in str(error.value)


def test_a_model_of_another_category_is_not_merged(tmp_path):
    root = shutil.copytree(_made(True) / "store", tmp_path / "out/store").parent
    file = min(root.glob("store/models/*/model.json"))
    file.write_text(json.dumps(json.loads(file.read_text("utf-8")) | {"category_id": 77}), "utf-8")
    with pytest.raises(ViewsphereError, match="expected a category of the plan, found 77"):
        merge([root, _played()], tmp_path / "merged", mixed=True)


def test_a_plan_that_names_shots_twice_is_told(tmp_path):
    root = shutil.copytree(_made(True) / "store", tmp_path / "out/store").parent
    file = root / "store/plan.json"
    plan = unsealed(file.read_text())
    first = plan["parts"][0]["blocks"][0]
    plan["parts"][0]["blocks"].append({**first, "subjects": first["subjects"][:1]})
    file.write_text(sealed(plan))
    with pytest.raises(ViewsphereError, match="expected a plan that names each shot once"):
        status(root)


def test_numbers_beyond_all_floats_are_told_by_an_export():
    with pytest.raises(ViewsphereError, match="expected finite numbers, found"):
        json_bytes({"box": [float("inf")]})
