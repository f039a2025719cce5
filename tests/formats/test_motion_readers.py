"""A sequence's flow, occlusions, disparity, tracks and depth, in files of other data sets, are what others' readers read.

The files are written here; none of the readers is ours, and each is skipped where it is not installed.
"""

from __future__ import annotations

import ast
import os
import pickle
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from torchvision_readers import torchvision_datasets

import viewsphere as vs
from sequence_recipe import eventful_recipe
from viewsphere.run.stages import Stages

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
FRAMES = 12
UNKNOWN = np.float32(1e10)
"""Flow that is not known, as files of Middlebury say."""

TAPNET = "VIEWSPHERE_TAPNET"
"""Names a checkout of https://github.com/google-deepmind/tapnet, whose evaluation is in no package."""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    root = tmp_path_factory.mktemp("sequence") / "out"
    vs.generate(eventful_recipe(FRAMES, formats=[]), root, workers=0)
    return vs.open(root)


def of(dataset, sensor):
    """The samples of a sensor in the first sequence."""
    first = dataset[0].sequence
    return [sample for sample in dataset if (sample.sequence, sample.sensor) == (first, sensor)]


def flow_of(sample):
    return np.where(np.isnan(sample.flow), UNKNOWN, sample.flow)


def write_flo(path, flow):
    """https://vision.middlebury.edu/flow/code/flow-code/README.txt"""
    height, width = flow.shape[:2]
    path.write_bytes(b"PIEH" + np.array([width, height], "<i4").tobytes() + flow.astype("<f4").tobytes())


def write_mask(path, mask):
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(path)


def write_disparity(path, disparity):
    """Of Sintel's stereo pairs: 4 R + G / 2^6 + B / 2^14 pixels."""
    whole = np.rint(disparity.astype(np.float64) * 2**14).astype(np.int64)
    Image.fromarray(np.stack([whole >> 16, whole >> 8 & 255, whole & 255], axis=-1).astype(np.uint8)).save(path)


@pytest.fixture(scope="module")
def sintel(dataset, tmp_path_factory):
    """The sequence as Sintel's files (http://sintel.is.tue.mpg.de): what is not visible counts as occluded."""
    root = tmp_path_factory.mktemp("sintel")
    folder = root / "Sintel" / "training"
    names = ("clean", "final", "clean_left", "clean_right", "final_left", "final_right", "flow", "occlusions", "invalid")
    for name in (*names, "disparities", "outofframe", "flow_occlusions"):
        (folder / name / "post_box").mkdir(parents=True)
    for left, right in zip(of(dataset, "left"), of(dataset, "right"), strict=True):
        png = f"post_box/frame_{left.instant + 1:04d}.png"
        for name, sample in ((n, right if n.endswith("right") else left) for n in names[:6]):
            Image.fromarray(sample.rgb).save(folder / name / png)
        write_disparity(folder / "disparities" / png, left.disparity)
        write_mask(folder / "occlusions" / png, left.disparity_state == 1)
        write_mask(folder / "outofframe" / png, left.disparity_state == 2)
        if left.instant < FRAMES - 1:
            write_flo((folder / "flow" / png).with_suffix(".flo"), flow_of(left))
            write_mask(folder / "flow_occlusions" / png, (left.flow_state > 0) & (left.flow_state < 4))
            write_mask(folder / "invalid" / png, left.flow_state == 4)
    return root


def test_torchvision_reads_the_flow(dataset, sintel):
    found = torchvision_datasets().Sintel(sintel, split="train", pass_name="clean")
    left = of(dataset, "left")
    assert len(found) == FRAMES - 1
    for a, b, item in zip(left[:-1], left[1:], found, strict=True):
        first, second, flow = item
        assert np.array_equal(np.asarray(first), a.rgb) and np.array_equal(np.asarray(second), b.rgb)
        assert np.array_equal(flow.transpose(1, 2, 0), flow_of(a)) and (np.abs(flow) < 1e9).mean() > 0.9


def test_torchvision_reads_disparity_and_its_occlusions(dataset, sintel):
    found = torchvision_datasets().SintelStereo(sintel, pass_name="both")
    pairs = list(zip(of(dataset, "left"), of(dataset, "right"), strict=True))
    assert len(found) == 2 * FRAMES
    hidden = 0
    for (left, right), (seen_left, seen_right, disparity, valid) in zip(2 * pairs, found, strict=True):
        assert np.array_equal(np.asarray(seen_left), left.rgb) and np.array_equal(np.asarray(seen_right), right.rgb)
        assert np.abs(disparity[0] - left.disparity).max() <= 2**-15
        assert np.array_equal(valid, left.disparity_state == 0)
        hidden += (left.disparity_state == 1).sum()
    assert hidden > 100


def test_ptlflow_reads_flow_and_occlusions(dataset, sintel, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torchvision_datasets()
        datasets = pytest.importorskip("ptlflow.data.datasets")
    root = tmp_path / "MPI-Sintel"
    (root / "training").mkdir(parents=True)
    for name in ("clean", "final", "flow", "invalid"):
        (root / "training" / name).symlink_to(sintel / "Sintel" / "training" / name)
    (root / "training" / "occlusions").symlink_to(sintel / "Sintel" / "training" / "flow_occlusions")
    found = datasets.SintelDataset(root, split="trainval", pass_names="clean", get_occlusion_mask=True)
    left = of(dataset, "left")
    assert len(found) == FRAMES - 1
    for a, item in zip(left[:-1], (found[i] for i in range(len(found))), strict=True):
        flow, known = np.asarray(item["flows"][0]), a.flow_state < 4
        assert np.array_equal(flow[known], a.flow[known])
        occluded = np.asarray(item["occs"][0])[..., 0] > 0
        assert np.array_equal(occluded, (a.flow_state > 0) & known)


def tapvid():
    """What the public evaluation of TAP-Vid computes with, without the packages that its module asks for."""
    folder = os.environ.get(TAPNET, "")
    files = [file for file in (Path(folder).rglob("evaluation_datasets.py") if folder else ()) if "tapvid" in file.parts]
    if not files:
        pytest.skip(f"needs a checkout of tapnet, named by ${TAPNET}")
    wanted = {"compute_tapvid_metrics", "sample_queries_first", "sample_queries_strided"}
    tree = ast.parse(files[0].read_text("utf-8"))
    tree.body = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name in wanted]
    found = {"np": np, "Mapping": Mapping}
    exec(compile(tree, str(files[0]), "exec"), found)
    return found


@pytest.mark.parametrize("mode", ["first", "strided"])
def test_our_own_tracks_score_one_in_tapvid(dataset, tmp_path, mode):
    public = tapvid()
    samples = of(dataset, "left")
    tracks, size = dataset.tracks(samples[0].sequence, "left"), np.array([samples[0].width, samples[0].height])
    hidden = tracks.state.T != 0
    points = np.nan_to_num(tracks.xy.transpose(1, 0, 2) / size).astype(np.float32)
    video = np.stack([sample.rgb for sample in samples])
    (tmp_path / "ours.pkl").write_bytes(pickle.dumps({"ours": {"video": video, "points": points, "occluded": hidden}}))
    read = pickle.loads((tmp_path / "ours.pkl").read_bytes())["ours"]
    assert read["occluded"].any() and not read["occluded"].all()
    frames, scaled = read["video"] / 255.0 * 2 - 1, read["points"] * np.float32(256)
    asked = public[f"sample_queries_{mode}"](read["occluded"], scaled, frames)
    scores = public["compute_tapvid_metrics"](
        asked["query_points"], asked["occluded"], asked["target_points"], asked["occluded"], asked["target_points"], mode
    )
    kept = ~read["occluded"].all(axis=1)
    if mode == "first":
        mine = tracks.xy.transpose(1, 0, 2)[kept] * (256 / size)
        seen = ~read["occluded"][kept]
        assert np.abs(asked["target_points"][0][seen] - mine[seen]).max() < 1e-4
    print(f"TAP-Vid, {mode}: {kept.sum()} tracks, " + ", ".join(f"{name} {float(value[0])}" for name, value in scores.items()))
    assert all(float(value[0]) == 1.0 for value in scores.values())


SEEN = 6
"""Pictures that have to agree on a piece of surface: one that sees it at a grazing angle only is no measure of it."""


def test_a_tsdf_of_an_orbit_lies_on_the_model():
    """Open3D fuses the pictures and the depth of an orbit around a post box; its pixels' centres are whole numbers."""
    open3d = pytest.importorskip("open3d")
    recipe = vs.Recipe(
        models=[{"source": "zoo:post_box", "scale": {"length": 0.4}}],
        viewpoints={"kind": "orbit", "elevation": [10, 50], "turns": 2, "distance": 1.5},
        time={"frames": 48, "fps": 25},
        camera={"size": [960, 720], "fov_deg": 50},
        channels=["rgb", "depth", "instances"],
        splits={"by": "sequence"},
    )
    tensor, image, kinds = open3d.core.Tensor, open3d.t.geometry.Image, (open3d.core.float32,) * 3
    grid = open3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight", "color"), kinds, ((1,), (1,), (3,)), 0.002, 16, 40_000, open3d.core.Device("CPU:0")
    )
    world = np.eye(4)
    for sample in vs.render(recipe):
        pose, k = np.eye(4), sample.camera.K.copy()
        pose[:3, :3], pose[:3, 3] = sample.camera.R, sample.camera.t
        k[:2, 2] -= 0.5
        depth = image(tensor(np.where(sample.instances > 0, sample.depth, 0).astype(np.float32)))
        color, lens, place = image(tensor(sample.rgb.astype(np.float32) / 255)), tensor(k), tensor(pose)
        blocks = grid.compute_unique_block_coordinates(depth, lens, place, 1.0, 10.0, 3.0)
        grid.integrate(blocks, depth, color, lens, lens, place, 1.0, 10.0, 3.0)
        world = np.asarray(sample.objects[0].world_from_object)
    fused = grid.extract_point_cloud(weight_threshold=SEEN).point.positions.numpy()
    mesh, scene = Stages().model(vs.plan(recipe).model_specs[0]), open3d.t.geometry.RaycastingScene()
    corners = mesh.vertices.astype(np.float64) @ world[:3, :3].T + world[:3, 3]
    scene.add_triangles(tensor(corners.astype(np.float32)), tensor(mesh.triangles.astype(np.uint32)))
    away = 1e3 * scene.compute_distance(tensor(fused.astype(np.float32))).numpy()
    middle, most = np.quantile(away, (0.5, 0.99))
    print(f"TSDF: {len(fused):,} points, {middle:.2f} mm away in the middle, 99 % {most:.2f} mm, farthest {away.max():.2f} mm")
    assert len(fused) > 200_000 and away.max() < 2
