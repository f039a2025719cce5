"""Values of a data set's records that raised foreign errors once: each is refused in one line."""

import json
import shutil

import pytest
from targets import _made

from sealing import seal_again
from viewsphere.check import check
from viewsphere.errors import ViewsphereError
from viewsphere.run.exporting import export
from viewsphere.store import Dataset
from viewsphere.store.manifest import sealed, unsealed


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
    with pytest.raises(ViewsphereError, match="expected") as error:
        export(root, ["coco"], output=tmp_path / "exports")
    assert "\n" not in str(error.value)
    if file.name != "plan.json":
        assert not check(Dataset(root), sample=0, rays=False).ok
