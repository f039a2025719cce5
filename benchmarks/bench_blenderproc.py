"""Render a scene that `bench_cycles.py` described as BlenderProc would: PYTHON bench_blenderproc.py FOLDER.

To be run by a Python that has `bpy`. The settings are BlenderProc's documented ones (https://dlr-rm.github.io/BlenderProc/,
`DefaultConfig`), but for the number of samples: at most three bounces, of them none glossy, adaptive sampling down to a noise
of 0.01, no light tree, persistent data, all cores, Intel's denoiser as a compositor node with albedo and normals at the node's
own settings, object indices from a pass of the same render; one process, poses as keyframes, an animation. Pictures are PNG,
indices EXR.

Reads FOLDER/told.json; writes FOLDER/cpu.json: CPU seconds of this process, all threads, after each frame.
"""

import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

SENSOR = 36.0


def set_up(scene, told):
    """`renderer.render_init`, and what `DefaultConfig` sets."""
    render, cycles = scene.render, scene.cycles
    render.engine, render.resolution_percentage = "CYCLES", 100
    render.threads_mode, render.threads = ("FIXED", told["threads"]) if told["threads"] else ("AUTO", 1)
    render.use_persistent_data = True
    render.use_simplify, render.simplify_subdivision_render = True, 3
    cycles.debug_use_spatial_splits = True
    cycles.use_denoising = False
    cycles.use_light_tree = False
    cycles.samples = told["samples"]
    cycles.use_adaptive_sampling, cycles.adaptive_threshold = True, 0.01
    cycles.diffuse_bounces = cycles.max_bounces = cycles.ao_bounces_render = 3
    cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 8
    render.film_transparent = told["transparent"]
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA" if told["transparent"] else "RGB"
    scene.view_layers[0].pass_alpha_threshold = 0.05


def compose(scene, folder):
    """`set_denoiser("INTEL")` and `enable_segmentation_output`."""
    layer = scene.view_layers[0]
    layer.use_pass_normal = layer.use_pass_diffuse_color = layer.use_pass_object_index = True
    is_five = hasattr(scene, "compositing_node_group")
    if is_five:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        picture = tree.nodes.new("NodeGroupOutput").inputs[0]
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        picture = tree.nodes.new("CompositorNodeComposite").inputs["Image"]
    layers, denoise = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeDenoise")
    color, index = ("Diffuse Color", "Object Index") if is_five else ("DiffCol", "IndexOB")
    for source, target in (("Image", "Image"), (color, "Albedo"), ("Normal", "Normal")):
        tree.links.new(layers.outputs[source], denoise.inputs[target])
    tree.links.new(denoise.outputs["Image"], picture)
    file = tree.nodes.new("CompositorNodeOutputFile")
    if is_five:
        file.directory, file.file_name = str(folder), "segmap_"
        file.file_output_items.new("FLOAT", "index")
    else:
        file.base_path = str(folder)
        file.file_slots[0].path = "segmap_"
    if is_five:
        file.format.media_type = "IMAGE"
    file.format.file_format = "OPEN_EXR"
    tree.links.new(layers.outputs[index], file.inputs[0])


def add_model(scene, told):
    known = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=told["model"])
    for thing in set(bpy.data.objects) - known:
        if thing.parent is None:
            thing.matrix_world = Matrix(told["matrix"]) @ thing.matrix_world
        thing.pass_index = 1


def add_ground(scene, told):
    """`object.create_primitive("PLANE")` and a matt material."""
    bpy.ops.mesh.primitive_plane_add(size=told["size"], location=(0, 0, told["z"]))
    material = bpy.data.materials.new("ground")
    material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*told["color"], 1)
    principled.inputs["Roughness"].default_value = 1.0
    bpy.context.object.data.materials.append(material)


def add_lights(scene, told):
    """`types.Light` of type sun, and `world.set_world_background_hdr_img`."""
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = told["sun"]["energy"], told["sun"]["angle"]
    place = bpy.data.objects.new("sun", sun)
    place.matrix_world = Vector(told["sun"]["direction"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
    scene.collection.objects.link(place)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    sky = nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.load(told["sky"])
    links.new(sky.outputs["Color"], nodes["Background"].inputs["Color"])


def add_poses(scene, camera, poses):
    """`camera.set_intrinsics_from_K_matrix`, and `camera.add_camera_pose` for each pose."""
    scene.render.resolution_x, scene.render.resolution_y = camera["width"], camera["height"]
    data = bpy.data.cameras.new("Camera")
    data.lens_unit, data.sensor_width, data.lens = "MILLIMETERS", SENSOR, SENSOR * camera["fx"] / camera["width"]
    thing = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(thing)
    scene.camera = thing
    for frame, pose in enumerate(poses):
        rotation = np.array(pose["R"]).T @ np.diag([1, -1, -1])
        thing.matrix_world = Matrix.Translation(pose["center"]) @ Matrix(rotation.tolist()).to_4x4()
        thing.keyframe_insert("location", frame=frame)
        thing.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_start, scene.frame_end = 0, len(poses) - 1


def main(folder):
    told = json.loads((folder / "told.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    set_up(scene, told)
    compose(scene, folder)
    add_model(scene, told)
    if told["ground"]:
        add_ground(scene, told["ground"])
    add_lights(scene, told)
    add_poses(scene, told["camera"], told["poses"])
    times = [time.process_time()]
    bpy.app.handlers.render_write.append(lambda *_: times.append(time.process_time()))
    scene.render.filepath = str(folder / "rgb_")
    bpy.ops.render.render(animation=True, write_still=True)
    (folder / "cpu.json").write_text(json.dumps(times))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
