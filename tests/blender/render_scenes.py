"""Run by a Python that has `bpy`: PYTHON render_scenes.py PACKAGE FOLDER.

Renders what FOLDER/scenes.json lists with the worker of PACKAGE (the folder that holds `worker`), in one Blender; each picture
goes to its scene's `out`, (H, W, 4) float32: scene-linear, premultiplied, the first row on top.
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.append(sys.argv[1])
from worker.scene import materials, meshes


def render(told, folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for mesh in told["meshes"]:
        images = meshes.build_images(mesh["images"])
        has_uv = mesh["uv0"] is not None, mesh["uv1"] is not None
        made = [materials.build_material(m, images, has_uv, mesh["colors"] is not None) for m in mesh["materials"]]
        scene.collection.objects.link(bpy.data.objects.new("mesh", meshes.build_mesh("mesh", mesh, made)))
    add_camera(scene, told["camera"])
    add_light(scene, told)
    set_up(scene, told)
    scene.render.filepath = str(folder / "picture.exr")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(picture.size[0] * picture.size[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    np.save(told["out"], pixels.reshape(picture.size[1], picture.size[0], 4)[::-1])


def add_camera(scene, told):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    width, height = told["width"], told["height"]
    camera.data.sensor_fit, camera.data.sensor_width, camera.data.lens = "HORIZONTAL", 36, 36 * told["focal"] / width
    camera.data.clip_start = 0.01
    rotation = (np.array(told["R"]).T @ np.diag([1, -1, -1])).tolist()
    camera.matrix_world = Matrix.Translation(told["center"]) @ Matrix(rotation).to_4x4()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height


def add_light(scene, told):
    scene.world = bpy.data.worlds.new("world")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = told["sky"]
    tree.links.new(background.outputs[0], output.inputs[0])
    if told["sun"]:
        lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        lamp.data.energy, lamp.data.angle = 1.0, 0.0
        lamp.matrix_world = Vector(told["sun"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
        scene.collection.objects.link(lamp)


def set_up(scene, told):
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.film_transparent = told["transparent"]
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.cycles.samples = told["samples"]
    scene.cycles.max_bounces = 4
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = 0
    if told["sharp"]:
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01  # a box is a whole pixel


folder = Path(sys.argv[2])
for scene in json.loads((folder / "scenes.json").read_text()):
    render(scene, folder)
