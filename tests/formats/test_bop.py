"""BOP, read by bop_toolkit, where it is installed, by webdataset, pycocotools and trimesh, and by a small reader of its own:
the same poses, masks, depth, models and symmetries, and counts of pixels that a rasteriser of this file's finds, too.
"""

from __future__ import annotations

import importlib
import json
import tarfile
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import trimesh
import webdataset
from pycocotools.coco import COCO

from proven import close, equal
from quick import quick
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.formats import bop
from viewsphere.formats.bop import FORMAT
from viewsphere.geometry.mask import decode_rle
from viewsphere.run.exports.exporting import export
from worlds import poses, stills

SAID = ("scene_gt.json", "scene_gt_info.json")
LAYOUTS = ("scenewise", "imagewise", "webdataset")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    made = {}

    def get(dataset, layout="scenewise"):
        if (dataset.name, layout) not in made:
            place = tmp_path_factory.mktemp(f"{dataset.name}-{layout}")
            export(dataset.root, [{"bop": {"layout": layout}}], output=place)
            made[dataset.name, layout] = place / "bop"
        return made[dataset.name, layout]

    return get


@pytest.fixture(scope="module")
def shapes(tmp_path_factory):
    """A lying tin and a crate, of which symmetries are found, of categories with strange names."""
    place = tmp_path_factory.mktemp("shapes")
    trimesh.creation.cylinder(0.3, 1.0, sections=48).export(place / "tin.obj")
    trimesh.creation.box((0.4, 0.8, 1.2)).export(place / "crate.obj")
    models = [
        {"source": str(place / "tin.obj"), "category": 'tin "1" é', "supercategory": "a b", "symmetries": "found"},
        {"source": str(place / "crate.obj"), "category": "crate's", "symmetries": "found"},
    ]
    views = {"azimuth": [30], "elevation": [20], "distance": 2.5}
    camera = {"size": [64, 48], "fov_deg": 50}
    generate(poses(name="shapes", models=models, viewpoints=views, camera=camera, splits={}), place / "out", workers=0)
    return Dataset(place / "out")


def place(sample, sensors=1):
    """Scene and image: of sequences a scene for each sensor."""
    if not sample.sequence:
        return 0, sample.index
    return sample.index - sample.instant * sensors, sample.instant


def read(folder, sample, sensors=1):
    """A picture of a tree of scenes."""
    scene, image = place(sample, sensors)
    own = folder / sample.split / f"{scene:06d}"
    said = {name: json.loads((own / f"scene_{name}.json").read_text())[str(image)] for name in ("camera", "gt", "gt_info")}
    masks = {
        kind: [load(own / kind / f"{image:06d}_{n:06d}.png") for n in range(len(said["gt"]))] for kind in ("mask", "mask_visib")
    }
    rgb, depth = load(own / "rgb" / f"{image:06d}.png")[..., ::-1], load(own / "depth" / f"{image:06d}.png")
    return SimpleNamespace(**said, **masks, rgb=rgb, depth=depth * np.float64(said["camera"]["depth_scale"]))


def load(file):
    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)


def listed(sample):
    """The objects that BOP lists: those with pixels in the picture."""
    return [o for o in sample.objects if amodal(o).any()]


def amodal(o):
    return decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts)


def rigid(pose):
    return np.reshape(pose["cam_R_m2c"], (3, 3)), np.reshape(pose["cam_t_m2c"], 3)


def project(k, points):
    found = points @ np.reshape(k, (3, 3)).T
    return found[:, :2] / found[:, 2:]


@pytest.mark.parametrize("world", quick(["stills", "poses", "videos"], "stills"))
def test_poses_take_points_of_models_to_their_pixels(written, world, request):
    """The coordinates map says which point of the model a pixel shows; pose and K take it to the centre of that pixel."""
    dataset = request.getfixturevalue(world)
    folder, sensors = written(dataset), 2 if world == "videos" else 1
    names = json.loads((folder / "dataset_info.json").read_text())["objects"]
    for sample in dataset:
        found = read(folder, sample, sensors)
        equal("bop", "own reader: colours", found.rgb, sample.rgb)
        surface = np.isfinite(sample.depth)
        equal("bop", "own reader: where depth is", found.depth > 0, surface & (sample.depth < 65.5355))
        close("bop", "own reader: depth", found.depth[found.depth > 0] / 1000, sample.depth[found.depth > 0], "m", atol=5.1e-4)
        for pose, mask, o in zip(found.gt, found.mask_visib, listed(sample), strict=True):
            assert names[str(pose["obj_id"])]["key"] == o.key
            rotation, shift = rigid(pose)
            close("bop", "own reader: rotations", rotation, o.camera_from_object[:3, :3], atol=1e-15)
            close("bop", "own reader: translations", shift / 1000, o.camera_from_object[:3, 3], "m", atol=1e-12)
            y, x = np.nonzero(mask)
            inside = sample.coordinates[y, x] * 1000.0 @ rotation.T + shift
            close("bop", "own reader: pixels", project(found.camera["cam_K"], inside), np.stack([x, y], 1), "px", atol=2e-3)
            close("bop", "own reader: depth of models", inside[:, 2], found.depth[y, x], "mm", atol=0.51)
        world_points = np.random.default_rng(0).normal(size=(20, 3))
        turn, shift = np.reshape(found.camera["cam_R_w2c"], (3, 3)), np.array(found.camera["cam_t_w2c"])
        expected = sample.camera.K @ (sample.camera.R @ world_points.T + sample.camera.t[:, None])
        close(
            "bop",
            "own reader: cameras",
            project(found.camera["cam_K"], world_points * 1000 @ turn.T + shift) + 0.5,
            (expected[:2] / expected[2]).T,
            "px",
            atol=1e-9,
        )


def test_masks_and_counts(stills, written):
    folder, hidden = written(stills), 0
    for sample in stills:
        found = read(folder, sample)
        for n, (info, o) in enumerate(zip(found.gt_info, listed(sample), strict=True)):
            assert found.mask[n].dtype == np.uint8 and set(np.unique(found.mask[n])) <= {0, 255}
            equal("bop", "own reader: visible masks", found.mask_visib[n] > 0, o.mask)
            equal("bop", "own reader: whole masks", found.mask[n] > 0, amodal(o))
            assert info["px_count_visib"] == o.area and info["visib_fract"] == o.visibility
            assert info["px_count_valid"] == (found.depth[found.mask[n] > 0] > 0).sum()
            inside = info["px_count_all"] * (1 - o.truncation)
            close("bop", "own reader: px_count_all", inside, amodal(o).sum(), "px", atol=1e-6)
            if not o.area:
                assert info["bbox_obj"] == info["bbox_visib"] == [-1] * 4
                hidden += 1
                continue
            ys, xs = np.nonzero(o.mask)
            assert info["bbox_visib"] == [xs.min(), ys.min(), np.ptp(xs), np.ptp(ys)]
            if not o.truncation:
                ys, xs = np.nonzero(amodal(o))
                assert info["bbox_obj"] == [xs.min(), ys.min(), np.ptp(xs), np.ptp(ys)]


def silhouette(model, pose, k, width, height):
    """Pixels of a canvas of three times the picture's sides whose centres a projected triangle holds."""
    rotation, shift = rigid(pose)
    points = project(k, model.vertices @ rotation.T + shift) + np.array([width, height])
    out = np.zeros((3 * height, 3 * width), bool)
    for corners in points[model.faces]:
        x0, y0 = np.ceil(corners.min(axis=0)).astype(int)
        x1, y1 = np.floor(corners.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1))
        if x.size:
            at = np.stack([x, y], -1)
            edges = np.roll(corners, -1, axis=0) - corners
            to = at[:, :, None] - corners
            side = edges[:, 0] * to[..., 1] - edges[:, 1] * to[..., 0]
            out[y, x] |= (side >= 0).all(-1) | (side <= 0).all(-1)
    return out


@pytest.mark.slow
def test_pixels_outside_of_the_picture_are_counted(stills, written):
    folder, tried = written(stills), 0
    for sample in stills:
        found = read(folder, sample)
        for n, o in enumerate(listed(sample)):
            if not o.truncation > 0.2 or tried == 2:
                continue
            tried += 1
            pose, info = found.gt[n], found.gt_info[n]
            model = trimesh.load(folder / "models" / f"obj_{pose['obj_id']:06d}.ply", process=False)
            whole = silhouette(model, pose, found.camera["cam_K"], sample.width, sample.height)
            ys, xs = np.nonzero(whole)
            close("bop", "own rasteriser: px_count_all", info["px_count_all"], whole.sum(), "px", atol=2)
            box = [xs.min() - sample.width, ys.min() - sample.height, np.ptp(xs), np.ptp(ys)]
            close("bop", "own rasteriser: bbox_obj", info["bbox_obj"], box, "px", atol=1)
    assert tried == 2


def test_models_and_symmetries(shapes, written):
    folder = written(shapes)
    infos = json.loads((folder / "models" / "models_info.json").read_text())
    named = json.loads((folder / "dataset_info.json").read_text())["objects"]
    assert [named[number]["category"] for number in ("1", "2")] == ['tin "1" é', "crate's"]
    for number, model in enumerate(shapes.models, 1):
        mesh, info = trimesh.load(folder / "models" / f"obj_{number:06d}.ply", process=False), infos[str(number)]
        own = shapes.mesh(model.key)
        close("bop", "trimesh: models", sorted(mesh.bounds.ravel() / 1000), sorted(own.bounds.ravel()), "m", atol=1e-7)
        assert len(mesh.faces) == len(own.triangles) and abs(np.linalg.norm(mesh.vertex_normals, axis=1) - 1).max() < 1e-6
        close("bop", "trimesh: min", [info[f"min_{axis}"] for axis in "xyz"], mesh.bounds[0], "mm", atol=1e-3)
        close("bop", "trimesh: size", [info[f"size_{axis}"] for axis in "xyz"], np.ptp(mesh.bounds, axis=0), "mm", atol=1e-3)
        across = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices, axis=-1).max()
        close("bop", "trimesh: diameter", info["diameter"], across, "mm", atol=1e-3)
    tin, crate = infos["1"], infos["2"]
    assert tin["symmetries_continuous"] == [{"axis": [0, 1, 0], "offset": [0, 0, 0]}]  # the file's z, and that lies
    halves = [np.diag([*signs, 1.0]) for signs in ([1, -1, -1], [-1, 1, -1], [-1, -1, 1])]
    close("bop", "closed form: symmetries", [np.reshape(m, (4, 4)) for m in crate["symmetries_discrete"]], halves, atol=1e-9)
    assert [len(row) for row in crate["symmetries_discrete"]] == [16] * 3
    camera, own = json.loads((folder / "camera.json").read_text()), shapes[0].camera
    assert (camera["width"], camera["height"], camera["depth_scale"]) == (64, 48, 1.0)
    assert (camera["cx"], camera["cy"], camera["fx"]) == (own.K[0, 2] - 0.5, own.K[1, 2] - 0.5, own.K[0, 0])


def test_coco_and_targets(stills, written, capsys):
    folder, wanted = written(stills), []
    for split in stills.splits:
        read_by = COCO(str(folder / split / "000000" / "scene_gt_coco.json"))
        samples = {sample.index: sample for sample in stills if sample.split == split}
        assert read_by.imgs.keys() == samples.keys()
        for index, sample in samples.items():
            shown = read_by.loadAnns(read_by.getAnnIds(imgIds=[index]))
            for annotation, o in zip(shown, [o for o in listed(sample) if o.area], strict=True):
                equal("bop", "pycocotools: masks", read_by.annToMask(annotation), o.mask)
                x0, y0, x1, y1 = o.box2d_amodal
                assert annotation["bbox"] == [x0, y0, x1 - x0, y1 - y0] and annotation["area"] == o.area
                assert annotation["ignore"] == (o.visibility < 0.1)
            assert (folder / split / "000000" / read_by.imgs[index]["file_name"]).is_file()
            keys = [o.key for o in listed(sample) if o.visibility >= 0.1]
            if split == "test":
                wanted += [[index, stills.plan.models.index(key) + 1, keys.count(key)] for key in sorted(set(keys))]
    targets = json.loads((folder / "test_targets_bop19.json").read_text())
    assert [[t["im_id"], t["obj_id"], t["inst_count"]] for t in targets] == wanted
    assert {t["im_id"] for t in json.loads((folder / "test_targets_bop24.json").read_text())} == {row[0] for row in wanted}
    capsys.readouterr()


def test_sequences_are_scenes_of_one_sensor(videos, written):
    folder = written(videos)
    scenes = {sample.sensor: set() for sample in videos}
    for sample in videos:
        scenes[sample.sensor].add(place(sample, 2)[0])
    assert len(scenes["left"]) == len(scenes["right"]) == 2 and not scenes["left"] & scenes["right"]
    for scene in folder.glob("*/[0-9]*"):
        assert list(json.loads((scene / "scene_gt.json").read_text())) == [str(i) for i in range(6)]
        assert len(list((scene / "rgb").iterdir())) == 6


@pytest.mark.slow
@pytest.mark.parametrize("world", ["stills", "videos"])
def test_layouts_hold_the_same(written, world, request):
    dataset = request.getfixturevalue(world)
    sensors = 2 if world == "videos" else 1
    tree, single, shards = (written(dataset, layout) for layout in LAYOUTS)
    packed = {}
    for split in dataset.splits:
        urls = [str(file) for file in sorted((shards / split).glob("shard-*.tar"))]
        for one in webdataset.WebDataset(urls, shardshuffle=False):
            packed[one["__key__"]] = one
        numbers = json.loads((shards / split / "key_to_shard.json").read_text())
        for key, number in numbers.items():
            with tarfile.open(shards / split / f"shard-{number:06d}.tar") as shard:
                assert f"{key}.gt.json" in shard.getnames()
    assert len(packed) == len(dataset)
    for sample in dataset:
        (scene, image), whole = place(sample, sensors), read(tree, sample, sensors)
        key = f"{scene:06d}_{image:06d}"
        files = {f.name.partition(".")[2]: f for f in (single / sample.split / f"{scene:06d}").glob(f"{key}.*")}
        assert files.keys() == {name for name in packed[key] if not name.startswith("__")}
        assert all(packed[key][name] == file.read_bytes() for name, file in files.items())
        for name, expected in (("camera", whole.camera), ("gt", whole.gt), ("gt_info", whole.gt_info)):
            assert json.loads(files[f"{name}.json"].read_text()) == expected
        for name, masks in (("mask", whole.mask), ("mask_visib", whole.mask_visib)):
            coded = json.loads(files[f"{name}.json"].read_text())
            assert list(coded) == [str(n) for n in range(len(masks))]
            assert all(sum(code["counts"]) == mask.size for code, mask in zip(coded.values(), masks, strict=True))
            assert all(sum(code["counts"][1::2]) == (mask > 0).sum() for code, mask in zip(coded.values(), masks, strict=True))


def toolkit(name):
    """A module of bop_toolkit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pytest.importorskip("bop_toolkit_lib")
        return importlib.import_module(f"bop_toolkit_lib.{name}")


def same(label, data, sample):
    """What bop_toolkit's loaders give is the sample's."""
    shown = listed(sample)
    equal("bop", f"bop_toolkit {label}: colours", data["im_rgb"], sample.rgb)
    equal("bop", f"bop_toolkit {label}: visible masks", data["mask_visib"] > 0, [o.mask for o in shown])
    equal("bop", f"bop_toolkit {label}: whole masks", data["mask"] > 0, [amodal(o) for o in shown])
    depth = np.where(np.isfinite(sample.depth), sample.depth, 0)
    held = depth < 65.5355
    close("bop", f"bop_toolkit {label}: depth", data["im_depth"][held] / 1000, depth[held], "m", atol=5.1e-4)
    for gt, info, o in zip(data["gt"], data["gt_info"], shown, strict=True):
        close("bop", f"bop_toolkit {label}: rotations", gt["cam_R_m2c"], o.camera_from_object[:3, :3], atol=1e-15)
        close(
            "bop",
            f"bop_toolkit {label}: translations",
            gt["cam_t_m2c"][:, 0] / 1000,
            o.camera_from_object[:3, 3],
            "m",
            atol=1e-12,
        )
        close("bop", f"bop_toolkit {label}: visib_fract", info["visib_fract"], o.visibility, atol=1e-15)


def test_bop_toolkit_reads_it(stills, written):
    scenewise, imagewise, sharded = (toolkit(f"dataset.bop_{layout}") for layout in LAYOUTS)
    everything = {"load_mask": True, "load_gt": True, "load_gt_info": True}
    tree, single, shards = (written(stills, layout) for layout in LAYOUTS)
    for sample in stills:
        key = f"000000_{sample.index:06d}"
        same("scenewise", scenewise.load_image_data(tree / sample.split / "000000", sample.index, **everything), sample)
        same("imagewise", imagewise.load_image_data(single / sample.split / "000000", key, **everything), sample)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        for sample in stills:
            shard = shards / sample.split / "shard-000000.tar"
            key = f"000000_{sample.index:06d}"
            same("webdataset", sharded.load_image_data(shard, key, rgb_suffix=".png", **everything), sample)


def test_bop_toolkit_agrees(stills, shapes, written):
    """Points, boxes, diameters, symmetries and targets are those that the toolkit's own functions compute."""
    inout, misc = toolkit("inout"), toolkit("misc")
    folder = written(stills)
    camera = inout.load_cam_params(folder / "camera.json")
    close("bop", "bop_toolkit: camera.json", camera["K"][:2, 2] + 0.5, stills[0].camera.K[:2, 2], "px", atol=1e-12)
    scene = folder / "test" / "000000"
    cameras, poses_of = inout.load_scene_camera(scene / "scene_camera.json"), inout.load_scene_gt(scene / "scene_gt.json")
    infos = inout.load_json(scene / "scene_gt_info.json", keys_to_int=True)
    targets = inout.load_json(folder / "test_targets_bop19.json")
    for sample in (sample for sample in stills if sample.split == "test"):
        wanted = inout.get_im_targets(poses_of[sample.index], infos[sample.index], 0.1)
        counts = {t["obj_id"]: {"inst_count": t["inst_count"]} for t in targets if t["im_id"] == sample.index}
        assert counts == wanted
        for gt, info, o in zip(poses_of[sample.index], infos[sample.index], listed(sample), strict=True):
            y, x = np.nonzero(o.mask)
            points = sample.coordinates[y, x] * 1000.0
            found = misc.project_pts(points, cameras[sample.index]["cam_K"], gt["cam_R_m2c"], gt["cam_t_m2c"])
            close("bop", "bop_toolkit: pixels", found, np.stack([x, y], 1), "px", atol=2e-3)
            if o.area:
                assert info["bbox_visib"] == list(misc.calc_2d_bbox(x, y))
    folder = written(shapes)
    known = inout.load_json(folder / "models" / "models_info.json", keys_to_int=True)
    for number, info in known.items():
        model = inout.load_ply(folder / "models" / f"obj_{number:06d}.ply")
        assert model["faces"].max() == len(model["pts"]) - 1 and "normals" in model
        close("bop", "bop_toolkit: diameters", misc.calc_pts_diameter(model["pts"]), info["diameter"], "mm", atol=1e-3)
        box = misc.calc_3d_bbox(*model["pts"].T)
        said = [*(info[f"min_{axis}"] for axis in "xyz"), *(info[f"size_{axis}"] for axis in "xyz")]
        close("bop", "bop_toolkit: boxes", said, box, "mm", atol=1e-3)
        motions = misc.get_symmetry_transformations(info, max_sym_disc_step=np.pi / 48)
        assert len(motions) == {1: 96, 2: 4}[number]
        for motion in motions:
            moved = model["pts"] @ motion["R"].T + motion["t"].T
            off = np.linalg.norm(moved[:, None] - model["pts"], axis=-1).min(axis=1).max()
            close("bop", "bop_toolkit: symmetries", off, 0, "mm", atol=1e-3)


def made(dataset, folder, sample, **options):
    """What is said of a sample, by the files that say it."""
    pieces = bop.preparer(dataset, folder, FORMAT.options(**options))(sample)
    files = ((piece.path.rpartition("/")[2], piece.data) for piece in pieces)
    return {name: json.loads(b"{" + data + b"}") for name, data in files if name in ("scene_camera.json", *SAID)}


def test_a_picture_of_nothing_has_empty_lists(stills, tmp_path):
    empty = replace(next(s for s in stills if s.split == "train"), objects=())
    said = made(stills, tmp_path, empty)
    assert said["scene_gt.json"] == said["scene_gt_info.json"] == {str(empty.index): []}
    assert not (tmp_path / "train" / "000000" / "mask").exists()
    bop.preparer(stills, tmp_path / "single", FORMAT.options(layout="imagewise"))(empty)
    assert json.loads((tmp_path / "single" / "train" / "000000" / f"000000_{empty.index:06d}.mask.json").read_text()) == {}


def test_what_is_hidden_or_outside(stills, tmp_path):
    """Of a hidden object all but what is seen is said; one that has no pixel in the picture is left out."""
    sample = next(s for s in stills if s.split == "train")
    o, other = next(o for o in sample.objects if not o.truncation), next(o for o in sample.objects if o.truncation)
    nothing = replace(o.rle, counts=_nothing(o.rle))
    hidden = replace(o, rle=nothing, area=0, visibility=0.0)
    gone = replace(other, rle=nothing, area=0, visibility=0.0, truncation=1.0, extra={**other.extra, "amodal": nothing})
    (info,) = made(stills, tmp_path, replace(sample, objects=(hidden, gone)))["scene_gt_info.json"][str(sample.index)]
    assert info["px_count_all"] == amodal(o).sum() and info["px_count_visib"] == 0 == info["visib_fract"]
    assert info["bbox_obj"] == info["bbox_visib"] == [-1] * 4
    behind = replace(other, box2d_unclipped=None)
    (info,) = made(stills, tmp_path / "behind", replace(sample, objects=(behind,)))["scene_gt_info.json"][str(sample.index)]
    ys, xs = np.nonzero(amodal(other))
    assert info["bbox_obj"] == [xs.min(), ys.min(), np.ptp(xs), np.ptp(ys)]


def _nothing(rle):
    from viewsphere.geometry.mask import encode_rle

    return encode_rle(np.zeros((rle.height, rle.width), bool))


def test_depth_ends_where_its_steps_do(stills, tmp_path):
    sample = next(s for s in stills if s.split == "train")
    scale = 0.05  # 65,535 of them are 3.3 m
    said = made(stills, tmp_path, sample, depth_scale=scale)["scene_camera.json"]
    steps = load(tmp_path / "train" / "000000" / "depth" / f"{sample.index:06d}.png")
    near = sample.depth < 65535.5 * scale / 1000
    assert near.any() and (~near & np.isfinite(sample.depth)).any() and steps.dtype == np.uint16
    assert not steps[~near].any()
    close("bop", "own reader: fine depth", steps[near] * scale / 1000, sample.depth[near], "m", atol=2.6e-5)
    assert said[str(sample.index)]["depth_scale"] == scale


def test_scenes_are_small_where_pictures_show_much(stills):
    """No folder of masks has more than 10,000 files."""
    part = replace(stills.plan.parts[0], frames=5000, max_objects=25, first=100)
    dataset = SimpleNamespace(plan=replace(stills.plan, parts=(replace(part, first=0, frames=100), part)))
    at = {index: bop._place(dataset, replace(stills[0], index=index)) for index in (99, 100, 499, 500, 5099)}
    assert at == {99: (0, 99), 100: (100, 0), 499: (100, 399), 500: (500, 0), 5099: (4900, 199)}


def test_refusals(stills):
    lens = {"distortion": {"model": "brown_conrady", "coefficients": [0.1, 0, 0, 0]}}
    with pytest.raises(UserError, match=r"format bop: expected pinhole cameras; found the lens of camera"):
        _planned(camera={"size": [160, 120], "fov_deg": 50, **lens}, formats=["bop"])
    with pytest.raises(UserError, match=r"bop: expected rigid models; found walker, which deforms"):
        step = replace(stills.models[0], key="walker@1", track="walker", step=SimpleNamespace(frame=1))
        bop.Bop(SimpleNamespace(models=(step,), plan=stills.plan), FORMAT.options())


def _planned(**changes):
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        generate(stills(**changes), Path(place) / "out", workers=0)
