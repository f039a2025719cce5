"""Open3D: rays on the processor, one a pixel."""

import numpy as np
import open3d
from view_loop import opened

scene = opened()
car = open3d.t.io.read_triangle_mesh(scene.path("car.ply"))
rays_scene = open3d.t.geometry.RaycastingScene(nthreads=1)
rays_scene.add_triangles(car)
ground = open3d.t.io.read_triangle_mesh(scene.path("ground.ply"))
rays_scene.add_triangles(ground)
width, height = scene.size
focal = 0.5 * height / np.tan(0.5 * scene.told["fov_y"])
intrinsics = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1.0]])
scene.ready(f"Open3D {open3d.__version__}", "ids, depth, normals; no colour")
for view in scene.views():
    camera_to_world = np.array(scene.told["views"][view]) @ np.diag([1.0, -1, -1, 1])
    rays = rays_scene.create_rays_pinhole(
        intrinsic_matrix=open3d.core.Tensor(intrinsics),
        extrinsic_matrix=open3d.core.Tensor(np.linalg.inv(camera_to_world)),
        width_px=width,
        height_px=height,
    )
    hits = rays_scene.cast_rays(rays, nthreads=1)
    depth, normals, ids = (hits[name].numpy() for name in ("t_hit", "primitive_normals", "geometry_ids"))
    scene.keep(view, np.where(ids == 0, 255, np.where(np.isfinite(depth), 128, 0)).astype(np.uint8))
