"""PASCAL3D+, read by scipy and by a port of its documented projection: the same pixels, boxes, points, masks and models."""

from __future__ import annotations

import builtins
import re

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.io import loadmat
from viewpoint_readers import project_3d, read, true_pixels

from proven import close, equal, told
from viewsphere import Dataset, generate, plugins
from viewsphere.errors import MissingExtraError, UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export
from worlds import MODELS
from worlds import poses as poses_recipe

KIT = "PASCAL/VOCdevkit/VOC2012"
NUMBERS = {"car": 7, "chair": 9, "post_box": 21}


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(dataset, **options):
        key = dataset.name, *options.items()
        if key not in made:
            place = tmp_path_factory.mktemp(dataset.name)
            export(dataset.root, [{"pascal3d": options}], output=place)
            made[key] = place / "pascal3d"
        return made[key]

    return get


def shown(dataset, folder):
    """All pictures by all categories that they show: the sample, the record, its objects and ours."""
    for sample in dataset:
        seen = [o for o in sample.objects if o.box2d]
        for category in {o.category for o in seen}:
            record, objects = read(folder / f"Annotations/{category}_pascal/{sample.index:08d}.mat")
            yield sample, category, record, objects, seen


def test_models_on_the_axis_are_projected_exactly(poses, written):
    folder = written(poses)
    for sample, category, _, objects, seen in shown(poses, folder):
        cads = np.atleast_1d(loadmat(folder / f"CAD/{category}.mat", squeeze_me=True, struct_as_record=False)[category])
        for said, o in zip(objects, seen, strict=True):
            vertices = cads[said.cad_index - 1].vertices
            found = project_3d(vertices, said.viewpoint)
            expected = true_pixels(poses, o, sample, vertices)
            close("pascal3d", "scipy, project_3d: models alone", found, expected, "px", atol=1e-9)
            close("pascal3d", "scipy: azimuth", said.viewpoint.azimuth, sample.pose.azimuth_deg, "deg", atol=1e-9)


@pytest.mark.slow
def test_rolled_cameras_are_theta(tmp_path):
    recipe = poses_recipe(
        name="rolled",
        models=[{**MODELS[0], "count": 1}],
        viewpoints={"azimuth": [40], "elevation": [-30, 70], "tilt": [25, -110], "distance": 3},
    )
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    export(dataset.root, "pascal3d", output=tmp_path / "written")
    cads = loadmat(tmp_path / "written/pascal3d/CAD/car.mat", squeeze_me=True, struct_as_record=False)["car"]
    for sample, _, _, (said,), (o,) in shown(dataset, tmp_path / "written/pascal3d"):
        vertices = cads.vertices
        found = project_3d(vertices, said.viewpoint)
        close("pascal3d", "scipy, project_3d: rolled", found, true_pixels(dataset, o, sample, vertices), "px", atol=1e-9)
        close("pascal3d", "scipy: theta", said.viewpoint.theta, sample.pose.tilt_deg, "deg", atol=1e-9)


@pytest.mark.slow
def test_models_beside_the_axis_are_near_and_exact_by_the_true_camera(stills, written):
    folder, farthest = written(stills), 0.0
    for sample, _, record, objects, seen in shown(stills, folder):
        equal("pascal3d", "scipy: sizes", record.imgsize, [sample.width, sample.height, 3])
        for said, o in zip(objects, seen, strict=True):
            cads = loadmat(folder / f"CAD/{o.category}.mat", squeeze_me=True, struct_as_record=False)[o.category]
            vertices = np.atleast_1d(cads)[said.cad_index - 1].vertices
            expected = true_pixels(stills, o, sample, vertices)
            pixels = (vertices @ said.RT[:, :3].T + said.RT[:, 3]) @ record.K.T
            close("pascal3d", "scipy: K, RT", pixels[:, :2] / pixels[:, 2:], expected, "px", atol=1e-9)
            apart = np.linalg.norm(project_3d(vertices, said.viewpoint) - expected, axis=1).max()
            farthest = max(farthest, apart / np.ptp(expected, axis=0).max())
    told("pascal3d", "scipy, project_3d: models beside the axis, share of their size", farthest)
    assert 0.01 < farthest < 0.2  # pictures are 50 degrees wide


@pytest.mark.slow
def test_boxes_flags_and_anchors(stills, written):
    points = 0
    for _, _, record, objects, seen in shown(stills, written(stills)):
        assert record.segmented == 1
        for said, o in zip(objects, seen, strict=True):
            x0, y0, x1, y1 = o.box2d
            equal("pascal3d", "scipy: boxes", said.bbox, [x0 + 1, y0 + 1, x1, y1])
            equal("pascal3d", "scipy: classes", getattr(said, "class"), o.category)
            assert said.truncated == (o.truncation > 0.15) and said.occluded == (o.occlusion_level > 0)
            assert said.id == o.id and said.difficult == 0
            anchors = said.anchors._fieldnames if o.keypoint_names else []
            assert len(anchors) == len(o.keypoint_names)
            for name, known, place, state in zip(anchors, o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
                assert name == re.sub(r"\W", "_", known)
                anchor = getattr(said.anchors, name)
                assert anchor.status == {0: 1, 1: 2}.get(int(state), 4)
                if state == 0:
                    points += 1
                    close("pascal3d", "scipy: anchors", anchor.location, place + 0.5, "px", atol=1e-12)
                else:
                    assert anchor.location.size == 0
            assert said.viewpoint.num_anchor == (o.keypoint_states == 0).sum()
    assert points > 20


@pytest.mark.slow
def test_models_and_their_points(stills, written):
    folder = written(stills)
    for category in ("car", "chair", "post_box"):
        infos = [info for info in stills.models if info.category == category]
        cads = loadmat(folder / f"CAD/{category}.mat")[category][0]
        assert len(cads) == len(infos)
        for number, (cad, info) in enumerate(zip(cads, infos, strict=True), 1):
            mesh, center = stills.mesh(info.key), info.box3d_object.mean(axis=0)
            equal("pascal3d", "scipy: CAD vertices", cad["vertices"], mesh.vertices.astype(float) - center)
            equal("pascal3d", "scipy: CAD faces", cad["faces"] - 1, mesh.triangles)
            off = trimesh.load(folder / f"CAD/{category}/{number:02}.off", process=False)
            equal("pascal3d", "trimesh: OFF vertices", off.vertices, cad["vertices"])
            equal("pascal3d", "trimesh: OFF faces", off.faces + 1, cad["faces"])
            points = info.keypoints.points if info.keypoints else {}
            for name, place in points.items():
                field = re.sub(r"\W", "_", name)
                assert field in [str(one[0]) for one in cad["pnames"][0]]
                close("pascal3d", "scipy: CAD points", cad[field][0], np.array(place) - center, "m", atol=1e-12)


def test_maps_pictures_and_lists(stills, written):
    folder = written(stills)
    names = dict(line.split()[::-1] for line in (folder / KIT / "classes.txt").read_text().splitlines())
    assert {name: int(number) for name, number in names.items()} == NUMBERS
    for sample, category, record, _, seen in shown(stills, folder):
        kinds = np.array(Image.open(folder / KIT / f"SegmentationClass/{sample.index:08d}.png"))
        ids = np.array(Image.open(folder / KIT / f"SegmentationObject/{sample.index:08d}.png"))
        for number, o in enumerate(seen, 1):
            equal("pascal3d", "Pillow: object maps", ids == number, o.mask)
            assert (kinds[o.mask] == NUMBERS[o.category]).all()
        assert not kinds[sample.instances == 0].any()
        file = folder / f"Images/{category}_pascal" / record.filename
        assert np.abs(cv2.imread(str(file))[..., ::-1].astype(float) - sample.rgb).mean() < 4
    for split in stills.splits:
        for category in NUMBERS:
            lines = (folder / KIT / f"ImageSets/Main/{category}_{split}.txt").read_text().splitlines()
            rows = dict(line.split() for line in lines)
            expected = {
                f"{sample.index:08d}": "1" if any(o.category == category and o.box2d for o in sample.objects) else "-1"
                for sample in stills
                if sample.split == split
            }
            assert rows == expected


def test_a_stranger_indexes_it_as_public_loaders_do(stills, written):
    """Without squeezing, as `obj["viewpoint"]["px"][0][0][0][0]`."""
    for sample, category, _, _, seen in shown(stills, written(stills)):
        data = loadmat(written(stills) / f"Annotations/{category}_pascal/{sample.index:08d}.mat")
        objects = data["record"]["objects"][0][0][0]
        assert data["record"]["filename"][0][0][0] == f"{sample.index:08d}.jpg"
        for said, o in zip(objects, seen, strict=True):
            assert said["bbox"][0][0] == o.box2d[0] + 1 and said["cad_index"][0][0] >= 1
            assert said["viewpoint"]["distance"][0][0][0][0] == o.view.distance
            assert said["class"][0] == o.category


def test_no_date_stands_in_the_bytes(poses, written):
    for file in written(poses).rglob("*.mat"):
        assert file.read_bytes()[:116].rstrip() == b"MATLAB 5.0 MAT-file Platform: posix, Created by: viewsphere"


def test_without_anchors(poses, written):
    for _, _, _, objects, _ in shown(poses, written(poses, anchors=False)):
        assert all(said.anchors.size == 0 and said.viewpoint.num_anchor == 0 for said in objects)
    module = plugins.load(FormatSpec, "pascal3d")
    assert module.needs(module.options()) == ("keypoints",) and module.needs(module.options(anchors=False)) == ()


def refused(tmp_path, **changes):
    recipe = poses_recipe(models=[{**MODELS[2], "count": 1, **changes.pop("model", {})}], **changes)
    with pytest.raises(UserError) as error:
        generate(recipe.model_copy(update={"formats": recipe.formats}), tmp_path / "out", workers=0)
    return str(error.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": {"category": "post box"}}, r"expected names of categories of letters .*; found 'post box'"),
        ({"model": {"category": "Briefkästen"}}, r"expected names of categories of letters .*; found 'Briefkästen'"),
        (
            {"camera": {"size": [80, 60], "K": [[90, 0, 40], [0, 80, 30], [0, 0, 1]]}},
            r"expected square pixels; found fx 90, fy 80, skew 0 of camera",
        ),
    ],
)
def test_refusals(tmp_path, changes, message):
    assert re.search(f"format pascal3d: {message}", refused(tmp_path, formats=["pascal3d"], **changes))


def test_an_empty_picture_is_left_out(tmp_path):
    recipe = poses_recipe(
        name="empty",
        models=[{**MODELS[2], "count": 1}],
        viewpoints={"azimuth": [0], "elevation": [20], "distance": 2.5, "target": [0, 0, 9]},
    )
    generate(recipe, tmp_path / "out", workers=0)
    export(tmp_path / "out", "pascal3d", output=tmp_path)
    assert [file.name for file in (tmp_path / "pascal3d").rglob("*.mat")] == ["post_box.mat"]


def test_points_whose_names_meet_in_matlab():
    from viewsphere.formats.shared.viewpoint_mat import _fields
    from viewsphere.model.annotations.keypoints import Keypoints

    class Info:
        def __init__(self, *names):
            self.keypoints = Keypoints(points={name: (0, 0, 0) for name in names})

    assert _fields([Info("left wheel", "2nd", "ärmel")], "x") == {
        "left wheel": "left_wheel",
        "2nd": "p_2nd",
        "ärmel": "p__rmel",
    }
    for names in (("a b", "a-b"), ("faces",)):
        with pytest.raises(UserError, match="expected names of points that differ in letters and digits; found"):
            _fields([Info(*names)], "x")


def test_without_scipy(monkeypatch):
    original = builtins.__import__

    def none(name, *rest, **more):
        if name == "scipy":
            raise ImportError(name)
        return original(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(MissingExtraError, match=r"pip install 'viewsphere\[mat\]'"):
        plugins.load(FormatSpec, "pascal3d").check()
