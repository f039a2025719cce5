"""pyrender: OpenGL without a window, through EGL, under one light with a shadow map."""

import os

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import numpy as np
import pyrender
import trimesh
from view_loop import opened

scene = opened()
if not hasattr(np, "infty"):
    setattr(np, "infty", np.inf)  # noqa: B010 - pyrender 0.1.45 is older than numpy 2
world = pyrender.Scene.from_trimesh_scene(
    trimesh.load(scene.path("model.glb")), bg_color=[0.4, 0.6, 0.9], ambient_light=[0.3] * 3
)
world.add(pyrender.Mesh.from_trimesh(trimesh.load(scene.path("ground.ply"), process=False)))
direction = -np.array(scene.told["sun"])
sideways = np.cross([0, 1.0, 0], -direction)
axes = np.column_stack([sideways / np.linalg.norm(sideways), np.cross(-direction, sideways), -direction])
pose = np.eye(4)
pose[:3, :3] = axes / np.linalg.norm(axes, axis=0)
pose[:3, 3] = -10 * direction
world.add(pyrender.DirectionalLight(intensity=3.0), pose=pose)
width, height = scene.size
camera = world.add(pyrender.PerspectiveCamera(scene.told["fov_y"], aspectRatio=width / height))
renderer = pyrender.OffscreenRenderer(width, height)
scene.ready(f"pyrender {pyrender.__version__}", "colour under one light with shadows, depth; no sky or labels")
for view in scene.views():
    world.set_pose(camera, np.array(scene.told["views"][view]))
    color, depth = renderer.render(world, flags=pyrender.RenderFlags.SHADOWS_DIRECTIONAL)
    scene.keep(view, color)
