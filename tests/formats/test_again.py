"""Data sets of BOP and PASCAL3D+ are rendered again: the same poses, masks, depth and boxes; others' trees, too."""

from __future__ import annotations

import importlib
import json
import shutil
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.io import loadmat, savemat
from scipy.spatial.transform import Rotation
from trimesh.ray.ray_pyembree import RayMeshIntersector
from viewpoint_readers import project_3d
from viewpoint_readers import read as read_mat

from proven import close, equal, told
from quick import quick
from viewsphere import Dataset, generate
from viewsphere.assets.metadata.sidecars import said_of
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.planning.plan import plan
from viewsphere.run.exports.exporting import export
from viewsphere.run.reproduce import make_again

K = np.array([[110.0, 0, 46.3], [0, 108.0, 33.7], [0, 0, 1]])
SIZE = (96, 72)
HALF = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
"""What principal points differ by that count from the first pixel's corner and centre."""

SHAPES = (
    trimesh.creation.box((60, 90, 120)),
    trimesh.creation.cylinder(40, 120, sections=40),
    trimesh.creation.icosphere(radius=55),
)


def rendered_again(kind, source, place):
    """The data set that `new --from` and `render` make of another one, and its lines of shots."""
    made = make_again(kind, source, place / "again")
    generate(str(made.recipe), place / "out", workers=0)
    return Dataset(place / "out"), [json.loads(line) for line in (place / "again/shots.jsonl").read_text().splitlines()], made


def image(file):
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert found is not None, file
    return found


def edges(mask):
    """Pixels within one pixel of the border of a mask."""
    square = np.ones((3, 3), np.uint8)
    return cv2.dilate(mask.astype(np.uint8), square) != cv2.erode(mask.astype(np.uint8), square)


def same_masks(label, against, found, expected):
    """Masks differ in 1 % of the pixels at most, all of them on edges."""
    differ = [one ^ other for one, other in zip(found, expected, strict=True)]
    assert not any((one & ~edges(mask)).any() for one, mask in zip(differ, expected, strict=True))
    share = sum(map(np.count_nonzero, differ)) / sum(map(np.count_nonzero, expected))
    assert share <= 0.01
    told(label, against, share)


@pytest.fixture(scope="module")
def of_bop(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("bop-again")
    export(stills.root, "bop", output=place)
    return place / "bop", *rendered_again("bop", place / "bop", place)


@pytest.mark.slow
def test_bop_is_the_same_again(of_bop):
    tree, again, lines, made = of_bop
    assert made.notes == ()
    for sample, line in zip(again, lines, strict=True):
        scene, name = (tree / line["image"]).parent.parent, Path(line["image"]).stem
        said = {of: json.loads((scene / f"scene_{of}.json").read_text())[str(int(name))] for of in ("gt", "gt_info", "camera")}
        close(
            "bop",
            "again: K",
            sample.camera.K - HALF,
            np.reshape(said["camera"]["cam_K"], (3, 3)),
            "px",
            atol=1e-12,
        )
        close("bop", "again: cameras", sample.camera.t, np.array(said["camera"]["cam_t_w2c"]) / 1000, "m", atol=1e-9)
        for o, gt in zip(sample.objects, said["gt"], strict=True):
            close("bop", "again: rotations", o.camera_from_object[:3, :3], np.reshape(gt["cam_R_m2c"], (3, 3)), atol=1e-9)
            close("bop", "again: translations", o.camera_from_object[:3, 3], np.array(gt["cam_t_m2c"]) / 1000, "m", atol=1e-9)
        for n, (o, info) in enumerate(zip(sample.objects, said["gt_info"], strict=True)):
            equal("bop", "again: visible masks", o.mask, image(scene / f"mask_visib/{name}_{n:06d}.png") > 0)
            close("bop", "again: visib_fract", o.visibility, info["visib_fract"], atol=2e-3)
        depth, surface = image(scene / f"depth/{name}.png") / 1000, np.isfinite(sample.depth)
        close("bop", "again: depth", sample.depth[surface], depth[surface], "m", atol=5.1e-4)


@pytest.mark.slow
def test_bop_exports_alike_again(of_bop):
    """The recipe asks for BOP: scene_gt, with the objects' numbers, and scene_gt_info are those of the first tree."""
    tree, again, lines, _ = of_bop
    for sample, line in zip(again, lines, strict=True):
        scene, name = (tree / line["image"]).parent.parent, str(int(Path(line["image"]).stem))
        own = again.root / "bop" / sample.split / "000000"
        for of in ("gt", "gt_info"):
            one, other = (json.loads((place / f"scene_{of}.json").read_text()) for place in (own, scene))
            for a, b in zip(one[str(sample.index)], other[name], strict=True):
                assert a.keys() == b.keys()
                for field in a.keys() - {"px_count_valid"}:  # the first tree's ground has depth, too
                    close("bop", "again: BOP of BOP", a[field], b[field], atol=1e-6)


@pytest.mark.slow
def test_symmetries_of_models_info_are_the_models(tmp_path, tree):
    folder = tree(shift=0.0)
    made = make_again("bop", folder, tmp_path / "again")
    again = plan(str(made.recipe))
    found = {spec.key: said_of(spec)[1] for spec in again.model_specs}
    assert len(found["obj_000001"].symmetries.discrete) == 3
    assert found["obj_000005"].symmetries.continuous[0].axis == (0, 0, 1)
    assert found["obj_000007"].symmetries is None


@pytest.fixture
def tree(tmp_path):
    """Makes a tree after BOP's documentation, by trimesh, Embree and OpenCV: objects 1, 5 and 7 in front of a camera without a
    pose in the world; masks, depth and counts by rays through pixels, `shift` pixels beside where the documentation has them.
    """

    def make(shift, save=None):
        folder = tmp_path / "tree"
        models, scene = folder / "models", folder / "train_pbr/000004"
        for name in ("rgb", "depth", "mask", "mask_visib"):
            (scene / name).mkdir(parents=True)
        models.mkdir()
        numbers = dict(zip((1, 5, 7), SHAPES, strict=True))
        for number, mesh in numbers.items():
            mesh.export(models / f"obj_{number:06d}.ply", encoding="ascii")
        halves = [np.diag([*signs, 1.0]).ravel().tolist() for signs in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1))]
        facts = {
            1: {"symmetries_discrete": halves},
            5: {"symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]},
            7: {},
        }
        (models / "models_info.json").write_text(json.dumps({str(n): {"diameter": 100, **more} for n, more in facts.items()}))
        rng, gt, info, cameras = np.random.default_rng(3), {}, {}, {}
        for number in (0, 3):
            gt[number] = [
                {
                    "cam_R_m2c": Rotation.random(random_state=int(rng.integers(2**31))).as_matrix(),
                    "cam_t_m2c": np.array([[105.0 * i - 105], [rng.uniform(-30, 30)], [520.0 + 60 * i]]),
                    "obj_id": which,
                }
                for i, which in enumerate((5, 1, 7))
            ]
            cameras[number] = {"cam_K": K, "depth_scale": 0.1}
            cv2.imwrite(str(scene / f"rgb/{number:06d}.jpg"), np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
            info[number] = seen(scene, number, gt[number], numbers, shift)
        (save or save_plainly)(scene, cameras, gt)
        (scene / "scene_gt_info.json").write_text(json.dumps(info))
        return folder

    return make


def seen(scene, number, gt, numbers, shift):
    """Write masks and depth of a picture; the counts and boxes of its objects in it."""
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    rays = np.stack([u.ravel() + shift, v.ravel() + shift, np.ones(u.size)], 1) @ np.linalg.inv(K).T
    depths = np.full((len(gt), u.size), np.inf)
    for n, one in enumerate(gt):
        mesh, pose = numbers[one["obj_id"]].copy(), np.eye(4)
        pose[:3] = np.column_stack([one["cam_R_m2c"], one["cam_t_m2c"]])
        mesh.apply_transform(pose)
        points, which, _ = RayMeshIntersector(mesh).intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
        depths[n, which] = points[:, 2]
    nearest = depths.min(axis=0)
    cv2.imwrite(
        str(scene / f"depth/{number:06d}.png"),
        np.where(np.isfinite(nearest), nearest / 0.1, 0).reshape(u.shape).astype(np.uint16),
    )
    found = []
    for n, own in enumerate(depths):
        whole, visible = np.isfinite(own).reshape(u.shape), (np.isfinite(own) & (own <= nearest)).reshape(u.shape)
        cv2.imwrite(str(scene / f"mask/{number:06d}_{n:06d}.png"), 255 * whole.astype(np.uint8))
        cv2.imwrite(str(scene / f"mask_visib/{number:06d}_{n:06d}.png"), 255 * visible.astype(np.uint8))
        boxes = {name: box(mask) for name, mask in (("bbox_obj", whole), ("bbox_visib", visible))}
        counts = {
            "px_count_all": int(whole.sum()),
            "px_count_visib": int(visible.sum()),
            "visib_fract": visible.sum() / whole.sum(),
        }
        found.append({**counts, **boxes})
    return found


def box(mask):
    y, x = np.nonzero(mask)
    return [int(v) for v in (x.min(), y.min(), x.max() - x.min(), y.max() - y.min())]


def save_plainly(scene, cameras, gt):
    plain = {n: {"cam_K": one["cam_K"].ravel().tolist(), "depth_scale": one["depth_scale"]} for n, one in cameras.items()}
    (scene / "scene_camera.json").write_text(json.dumps(plain))
    poses = {
        n: [
            {**one, "cam_R_m2c": one["cam_R_m2c"].ravel().tolist(), "cam_t_m2c": one["cam_t_m2c"].ravel().tolist()}
            for one in found
        ]
        for n, found in gt.items()
    }
    (scene / "scene_gt.json").write_text(json.dumps(poses))


def save_by_toolkit(scene, cameras, gt):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pytest.importorskip("bop_toolkit_lib")
        inout = importlib.import_module("bop_toolkit_lib.inout")
    inout.save_scene_camera(str(scene / "scene_camera.json"), cameras)
    inout.save_scene_gt(str(scene / "scene_gt.json"), gt)


@pytest.mark.slow
@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize("save", [save_plainly, save_by_toolkit])
def test_trees_that_others_write_are_the_same_again(tree, tmp_path, shift, save):
    """Masks that count from pixels' corners (rays half a pixel beside) are met, too: then the recipe says so."""
    folder = tree(shift, save)
    again, lines, made = rendered_again("bop", folder / "train_pbr", tmp_path)
    assert len(made.notes) == bool(shift) and len(again) == 2 and not check(again).findings
    whole = again.root / "bop/train_pbr/000000"
    masks = {"mask": ([], []), "mask_visib": ([], [])}
    for sample, line in zip(again, lines, strict=True):
        name = Path(line["image"]).stem
        scene = folder / "train_pbr/000004"
        lens = K + np.outer([0.5 - shift, 0.5 - shift, 0], [0, 0, 1])
        close("bop", "again, other code: K", sample.camera.K, lens, "px", atol=0.13 if shift else 1e-12)
        for kind, (found, expected) in masks.items():
            found += [image(whole / f"{kind}/{sample.index:06d}_{n:06d}.png") > 0 for n in range(3)]
            expected += [image(scene / f"{kind}/{name}_{n:06d}.png") > 0 for n in range(3)]
        infos = (json.loads((place / "scene_gt_info.json").read_text()) for place in (whole, scene))
        for own, other in zip(
            *(info[key] for info, key in zip(infos, (str(sample.index), str(int(name))), strict=True)), strict=True
        ):
            for field, atol in {
                "px_count_all": 8,
                "px_count_visib": 8,
                "visib_fract": 0.01,
                "bbox_obj": 1,
                "bbox_visib": 1,
            }.items():
                np.testing.assert_allclose(own[field], other[field], atol=atol)
        if not shift:
            depth, surface = image(scene / f"depth/{name}.png") / 1e4, np.isfinite(sample.depth)
            both = surface & (depth > 0)
            assert np.count_nonzero(surface != (depth > 0)) <= 10
            assert np.quantile(np.abs(sample.depth - depth)[both], 0.99) <= 1.1e-4
    for kind, pair in masks.items():
        same_masks("bop", f"again, other code: {kind}", *pair)


def broken(tree, what):
    scene = tree / "train_pbr/000004"
    match what:
        case "model":
            (tree / "models/obj_000005.ply").unlink()
        case "model elsewhere":
            file = tree / "models/obj_000005.ply"
            file.rename(tree.parent / "other.ply")
            file.symlink_to(tree.parent / "other.ply")
        case "poses":
            (scene / "scene_gt.json").write_text('{"0": [{"obj_id": 5}]}')
        case "pose":
            text = json.loads((scene / "scene_gt.json").read_text())
            text["3"][1]["cam_R_m2c"] = [0.0] * 9
            (scene / "scene_gt.json").write_text(json.dumps(text))
        case "half":
            (scene / "scene_gt.json").write_text((scene / "scene_gt.json").read_text()[:100])
        case "picture":
            (scene / "rgb/000003.jpg").unlink()
        case "symmetry":
            (tree / "models/models_info.json").write_text('{"1": {"symmetries_discrete": [[1, 2]]}}')
        case "mesh":
            (tree / "models/obj_000005.ply").write_text("ply\nno mesh")
        case "number":
            (scene / "scene_gt.json").write_text(
                json.dumps({"0": [{"obj_id": "../5", "cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1], "cam_t_m2c": [0, 0, 1]}]})
            )
        case _:
            out_of_bounds(tree, what)


def out_of_bounds(tree, what):
    scene = tree / "train_pbr/000004"
    match what:
        case "far":
            text = json.loads((scene / "scene_gt.json").read_text())
            text["3"][1]["cam_t_m2c"][0] = 1e300
            (scene / "scene_gt.json").write_text(json.dumps(text))
        case "wide":
            Image.new("RGB", (20_000, 4)).save(scene / "rgb/000003.jpg")
        case "crowd":
            text = json.loads((scene / "scene_gt.json").read_text())
            (scene / "scene_gt.json").write_text(json.dumps(text | {"3": text["3"] * 4_000}))
        case "long":
            (tree / "train_pbr").rename(tree / ("a" * 150))
        case "lens":
            text = json.loads((scene / "scene_camera.json").read_text())
            text["3"]["cam_K"][0] = -1
            (scene / "scene_camera.json").write_text(json.dumps(text))


BROKEN = {
    "model": r"expected models/obj_000005.ply, a model of image 0 of .*; found no such file",
    "model elsewhere": r"found a link that leads out of it",
    "poses": r"image 0: expected a lens, poses and a picture; found no 'cam_R_m2c'",
    "pose": r"image 3: expected a lens, poses and a picture; found cam_R_m2c \[0.0, .* where a rotation is expected$",
    "half": r"scene_gt.json: expected BOP's JSON; found",
    "picture": r"image 3: expected a lens, poses and a picture; found no picture",
    "symmetry": r"models_info.json: 1: symmetries_discrete: expected lists of 16 numbers",
    "mesh": r"expected masks, and models that can be read; found: .*obj_000005.ply",
    "number": r"found obj_id '../5'",
    "far": r"image 3: world_from_object\[0\]\[3\]: expected a number less than .*; found 1e\+297",
    "wide": r"image 3: camera: expected at most 16384 pixels a side; found 20000 x 4",
    "crowd": r"image 3: objects: expected at most 10,000 \(limit MAX_LISTED_OBJECTS\); found 12,000",
    "long": r"image 0: split: expected .* at most 100 characters.* \(1 more like it\)",
    "lens": r"image 3: expected a lens, poses and a picture; fx: expected a number greater than 0; found -1",
}


@pytest.mark.parametrize("what", quick(BROKEN, *(what for what in BROKEN if what != "crowd")))
def test_broken_trees_are_told_in_a_line_and_leave_nothing(tree, tmp_path, what):
    folder = tree(0.0)
    broken(folder, what)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(StoreError, match=BROKEN[what]) as error:
        make_again("bop", folder, tmp_path / "again")
    assert "\n" not in str(error.value) and sorted(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_symmetries_that_are_not_all_listed_are_left_out_and_said(tree, tmp_path):
    folder = tree(0.0)
    turns = [np.diag([1.0, -1, -1, 1]).ravel().tolist(), np.diag([-1.0, 1, -1, 1]).ravel().tolist(), np.eye(4).ravel().tolist()]
    (folder / "models/models_info.json").write_text(json.dumps({"1": {"symmetries_discrete": turns}}))
    made = make_again("bop", folder, tmp_path / "again")
    assert made.notes == ("symmetries of object 1 are left out: some follow from others that are not listed",)
    assert f"# Note: {made.notes[0]}" in made.recipe.read_text()


def test_a_folder_that_holds_something_and_other_formats_are_refused(tree, tmp_path):
    folder = tree(0.0)
    for kind, out, message in (
        ("bop", folder, "expected a new folder"),
        ("bop", tmp_path / "a.yaml", "expected a folder beside --from"),
        ("coco", tmp_path / "a", "'coco' is unknown. Valid: bop, colmap, nerfstudio, pascal3d"),
        ("bob", tmp_path / "a", "did you mean 'bop'"),
    ):
        with pytest.raises(UserError, match=message):
            make_again(kind, folder, out)
    for kind in ("bop", "colmap", "nerfstudio", "pascal3d"):
        (tmp_path / "empty").mkdir(exist_ok=True)
        with pytest.raises(StoreError, match="empty: expected"):
            make_again(kind, tmp_path / "empty", tmp_path / "a")
    assert not (tmp_path / "a").exists()


@pytest.fixture(scope="module")
def of_pascal(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("pascal-again")
    export(stills.root, "pascal3d", output=place)
    return stills, place / "pascal3d", *rendered_again("pascal3d", place / "pascal3d", place)


@pytest.mark.slow
def test_pascal3d_is_the_same_again(of_pascal):
    """All objects of a picture in one shot, as its record says K and RT; masks are those of SegmentationObject."""
    own, tree, again, lines, made = of_pascal
    assert made.notes == ()
    pairs = dict(zip((line["name"] for line in lines), zip(again, lines, strict=True), strict=True))
    splits = {f"{sample.index:08d}": sample.split for sample in own}
    for name, (sample, _line) in pairs.items():
        assert sample.split == splits[name]
        place = next((tree / "Annotations").glob(f"*/{name}.mat"))
        record, objects = read_mat(place)
        close("pascal3d", "again: K", sample.camera.K + HALF, record.K, "px", atol=1e-9)
        with Image.open(tree / f"PASCAL/VOCdevkit/VOC2012/SegmentationObject/{name}.png") as palette:
            numbers = np.asarray(palette)
        for _n, (o, expected) in enumerate(zip(sample.objects, objects, strict=True), 1):
            close("pascal3d", "again: poses", o.camera_from_object[:3], expected.RT, "m", atol=1e-9)
            close("pascal3d", "again: boxes", [o.box2d[0] + 1, o.box2d[1] + 1, *o.box2d[2:]], expected.bbox, "px", atol=1)
        same_masks(
            "pascal3d", "again: masks", [o.mask for o in sample.objects], [numbers == n for n in range(1, len(objects) + 1)]
        )


@pytest.fixture
def release(of_pascal, tmp_path):
    """The tree as releases are: without what only viewsphere writes, and CAD models in MATLAB files alone."""
    _, tree, *_ = of_pascal
    folder = shutil.copytree(tree, tmp_path / "release")
    for file in folder.glob("Annotations/*/*.mat"):
        record = loadmat(file)["record"]
        plain = {name: record[0, 0][name] for name in ("filename", "imgsize", "segmented")}
        objects = record[0, 0]["objects"]
        names = [name for name in objects.dtype.names if name not in ("RT", "id")]
        plain["objects"] = np.empty(objects.shape, [(name, object) for name in names])
        for name in names:
            plain["objects"][name] = objects[name]
        savemat(file, {"record": plain}, long_field_names=True)
    for cads in folder.glob("CAD/*/"):
        shutil.rmtree(cads)
    return folder


@pytest.mark.slow
def test_pascal3d_of_others_is_projected_as_its_toolbox_does(release, tmp_path):
    made = make_again("pascal3d", release, tmp_path / "again")
    again = plan(str(made.recipe))
    lines = {line["name"]: line for line in map(json.loads, (tmp_path / "again/shots.jsonl").read_text().splitlines())}
    points, seen_names = np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3)), set()
    for file in release.glob("Annotations/*/*.mat"):
        _, objects = read_mat(file)
        for n, one in enumerate(objects):
            name = file.stem if len(objects) == 1 else f"{file.stem}-{n}"
            line = lines[name]
            camera_from_object = np.linalg.inv(line["world_from_camera"]) @ np.array(line["objects"][0]["world_from_object"])
            inside = points @ camera_from_object[:3, :3].T + camera_from_object[:3, 3]
            lens = line["camera"]
            pixels = inside[:, :2] / inside[:, 2:] * [lens["fx"], lens["fy"]] + [lens["cx"], lens["cy"]]
            close("pascal3d", "again: toolbox's projection", pixels + 0.5, project_3d(points, one.viewpoint), "px", atol=1e-8)
            seen_names.add(name)
    assert seen_names == set(lines) and again.frames == len(lines)
    assert bool(made.notes) == any("-" in name for name in lines)


@pytest.mark.slow
def test_pascal3d_of_others_renders(release, tmp_path):
    made, shots = make_again("pascal3d", release, tmp_path / "again"), tmp_path / "again/shots.jsonl"
    shots.write_text("".join(shots.read_text().splitlines(keepends=True)[::6]))  # all were projected above
    generate(str(made.recipe), tmp_path / "out", workers=0)
    again = Dataset(tmp_path / "out")
    assert len(again) > 3
    assert all(o.area > 20 for sample in again for o in sample.objects if sample.objects.index(o) == 0)
    assert sorted(again.root.glob("pascal3d/CAD/*.mat"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("CAD", r"expected CAD/.*\.off, or it in CAD/.*\.mat; found neither"),
        ("half", "found .*is cut off"),
        ("none", "expected a struct `record`; found none"),
        ("outside", r"found a category '../../x'"),
    ],
)
def test_broken_releases_are_told_in_a_line_and_leave_nothing(release, tmp_path, what, message):
    file = next(release.glob("Annotations/*/*.mat"))
    match what:
        case "CAD":
            shutil.rmtree(release / "CAD")
        case "half":
            file.write_bytes(file.read_bytes()[:300])
        case "none":
            savemat(file, {"other": 1.0})
        case "outside":
            record = loadmat(file)["record"]
            record[0, 0]["objects"]["class"][0, 0] = np.array(["../../x"])
            savemat(file, {"record": record}, long_field_names=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(StoreError, match=message) as error:
        make_again("pascal3d", release, tmp_path / "again")
    assert "\n" not in str(error.value) and sorted(tmp_path.rglob("*")) == before
