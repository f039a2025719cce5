"""Cycles as a Python module, with BlenderProc's settings, 4 samples and denoising; colour as PNG, indices as EXR."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

import bench_blenderproc as blenderproc
import bpy
import numpy as np
from mathutils import Matrix
from view_loop import opened

scene = opened()
bpy.ops.wm.read_factory_settings(use_empty=True)
here = bpy.context.scene
blenderproc.set_up(here, {"threads": 1, "samples": 4, "transparent": False})
blenderproc.compose(here, scene.folder)
blenderproc.add_model(here, {"model": scene.path("model.glb"), "matrix": np.eye(4).tolist()})
blenderproc.add_ground(here, {"size": 200.0, "z": scene.told["ground_y"], "color": [0.5, 0.5, 0.5]})
x, y, z = scene.told["sun"]
sun = {"energy": 3.0, "angle": 0.0093, "direction": [x, -z, y]}
blenderproc.add_lights(here, {"sun": sun, "sky": scene.path("sky.exr")})
here.render.resolution_x, here.render.resolution_y = width, height = scene.size
data = bpy.data.cameras.new("Camera")
data.sensor_fit, data.angle = "VERTICAL", scene.told["fov_y"]
here.camera = bpy.data.objects.new("Camera", data)
scene_axes = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))  # from glTF's Y up to Blender's Z up
here.collection.objects.link(here.camera)
here.render.filepath = scene.path("cycles.png")
scene.ready(f"Cycles in bpy {bpy.app.version_string}", "colour by 4 paths a pixel, denoised, ids; both as files")
for view in scene.views():
    here.camera.matrix_world = scene_axes @ Matrix(scene.told["views"][view])
    bpy.ops.render.render(write_still=True)
    if view == 0:
        picture = bpy.data.images.load(scene.path("cycles.png"))
        pixels = np.array(picture.pixels[:]).reshape(height, width, -1)[::-1, :, :3]
        scene.keep(view, np.ascontiguousarray(255 * pixels).astype(np.uint8))
