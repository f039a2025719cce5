"""Pictures and depth of an orbit, fused by Open3D where it is installed, are the model."""

from __future__ import annotations

import numpy as np
import pytest

import viewsphere as vs
from viewsphere.run.shots.stages import Stages

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
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
