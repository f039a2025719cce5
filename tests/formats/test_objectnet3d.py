"""ObjectNet3D, read by scipy and by ports of its toolbox's projections: the same pixels, rotations, boxes and models."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from scipy.io import loadmat
from viewpoint_readers import project_3d, project_3d_msid, read, rotation_matrix, true_pixels

from proven import close, equal
from viewsphere import Dataset, generate, plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export
from worlds import MODELS
from worlds import poses as poses_recipe


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(dataset):
        if dataset.name not in made:
            place = tmp_path_factory.mktemp(dataset.name)
            export(dataset.root, "objectnet3d", output=place)
            made[dataset.name] = place / "objectnet3d"
        return made[dataset.name]

    return get


def shown(dataset, folder):
    for sample in dataset:
        record, objects = read(folder / f"Annotations/{sample.index:08d}.mat")
        yield sample, record, objects, [o for o in sample.objects if o.box2d]


def cads_of(folder, category):
    return np.atleast_1d(loadmat(folder / f"CAD/mat/{category}.mat", squeeze_me=True, struct_as_record=False)[category])


def test_models_are_projected_exactly(poses, written):
    folder = written(poses)
    for sample, _, objects, seen in shown(poses, folder):
        for said, o in zip(objects, seen, strict=True):
            vertices = cads_of(folder, o.category)[said.cad_index - 1].vertices
            expected, view = true_pixels(poses, o, sample, vertices), said.viewpoint
            found = project_3d_msid(vertices, view)
            close("objectnet3d", "scipy, project_3d_msid: models alone", found, expected, "px", atol=1e-9)
            close("objectnet3d", "scipy, project_3d: models alone", project_3d(vertices, view), expected, "px", atol=1e-9)
            turn = rotation_matrix(*np.radians([view.azimuth, view.elevation, view.theta]))
            close("objectnet3d", "scipy, rotation_matrix", turn, o.camera_from_object[:3, :3], atol=1e-12)
            close("objectnet3d", "scipy: RT", said.RT[:, :3], o.camera_from_object[:3, :3], atol=1e-12)


@pytest.mark.slow
def test_boxes_classes_and_the_true_camera(stills, written):
    folder = written(stills)
    for sample, record, objects, seen in shown(stills, folder):
        assert record.filename == f"{sample.index:08d}.JPEG" and record.segmented == 0
        assert Image.open(folder / "Images" / record.filename).size == (sample.width, sample.height)
        for said, o in zip(objects, seen, strict=True):
            x0, y0, x1, y1 = o.box2d
            equal("objectnet3d", "scipy: boxes", said.bbox, [x0 + 1, y0 + 1, x1, y1])
            assert getattr(said, "class") == o.category
            vertices = cads_of(folder, o.category)[said.cad_index - 1].vertices
            pixels = (vertices @ said.RT[:, :3].T + said.RT[:, 3]) @ record.K.T
            expected = true_pixels(stills, o, sample, vertices)
            close("objectnet3d", "scipy: K, RT", pixels[:, :2] / pixels[:, 2:], expected, "px", atol=1e-9)


def off(file):
    """As the toolbox's load_off_file.m reads it, a line at a time."""
    head, counts, *rows = file.read_text().splitlines()
    vertices, faces, _ = map(int, counts.split())
    assert head == "OFF" and len(rows) == vertices + faces
    numbers = [list(map(float, row.split())) for row in rows]
    assert all(row[0] == 3 for row in numbers[vertices:])
    return np.array(numbers[:vertices]), np.array([row[1:] for row in numbers[vertices:]]) + 1


@pytest.mark.slow
def test_models_of_all_files_are_the_same(stills, written):
    folder, points = written(stills), 0
    assert (folder / "Image_sets/classes.txt").read_text().split() == [category.name for category in stills.categories]
    cells = loadmat(folder / "CAD/cads.mat")
    names = [str(name[0]) for name in cells["class_names"][0]]
    for category, cell in zip(names, cells["cads"][0], strict=True):
        infos = [info for info in stills.models if info.category == category]
        cads = loadmat(folder / f"CAD/mat/{category}.mat")[category][0]
        assert len(cads) == cell.shape[1] == len(infos)
        for number, (cad, other, info) in enumerate(zip(cads, cell[0], infos, strict=True), 1):
            mesh, center = stills.mesh(info.key), info.box3d_object.mean(axis=0)
            equal("objectnet3d", "scipy: CAD vertices", cad["vertices"], mesh.vertices.astype(float) - center)
            vertices, faces = off(folder / f"CAD/off/{category}/{number:02}.off")
            for found in (vertices, other["vertices"]):
                equal("objectnet3d", "load_off_file, cads.mat: vertices", found, cad["vertices"])
            for found in (faces, other["faces"]):
                equal("objectnet3d", "load_off_file, cads.mat: faces", found, mesh.triangles + 1)
            for field in [str(one[0]) for one in cad["pnames"][0]] if cad["pnames"].size else []:
                if cad[field].size:
                    place, _ = off(folder / f"CAD/off/{category}/{number:02}_{field}.off")
                    equal("objectnet3d", "load_off_file: points", place, cad[field])
                    points += 1
    assert points == sum(len(info.keypoints.points) for info in stills.models if info.keypoints)


@pytest.mark.slow
def test_lists_and_a_picture_without_objects(stills, written, tmp_path):
    for split in stills.splits:
        expected = [f"{sample.index:08d}" for sample in stills if sample.split == split]
        assert (written(stills) / f"Image_sets/{split}.txt").read_text().split() == expected
    viewpoints = {"azimuth": [0], "elevation": [20], "distance": 2.5, "target": [0, 0, 9]}
    generate(poses_recipe(name="empty", models=[{**MODELS[2], "count": 1}], viewpoints=viewpoints), tmp_path, workers=0)
    export(tmp_path, "objectnet3d", output=tmp_path)
    ((_, record, objects, seen),) = shown(Dataset(tmp_path), tmp_path / "objectnet3d")
    assert len(objects) == len(seen) == 0 and record.filename == "00000000.JPEG"


def test_refusals(tmp_path, stills):
    recipe = poses_recipe(models=[{**MODELS[2], "count": 1, "category": "d'été"}], formats=["objectnet3d"])
    with pytest.raises(UserError, match=r"format objectnet3d: expected names of categories .*; found \"d'été\""):
        generate(recipe, tmp_path / "out", workers=0)
    module = plugins.load(FormatSpec, "objectnet3d")
    assert module.needs(module.options()) == ("keypoints",) and module.needs(module.options(anchors=False)) == ()
    recipe = poses_recipe(name="split", models=[{**MODELS[2], "count": 1}], splits={"by": "model", "classes": 1.0})
    generate(recipe, tmp_path / "other", workers=0)
    with pytest.raises(UserError, match=r"objectnet3d: expected splits .*; found classes"):
        export(tmp_path / "other", "objectnet3d", output=tmp_path)
