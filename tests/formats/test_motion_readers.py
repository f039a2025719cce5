"""A sequence's flow, occlusions, disparity, tracks and depth, in files of other data sets, are what others' readers read.

The files are written here; none of the readers is ours, and each is skipped where it is not installed.
"""

from __future__ import annotations

import ast
import os
import pickle
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import viewsphere as vs
from sequence_recipe import eventful_recipe
from viewsphere.run.stages import Stages

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
FRAMES = 12
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
