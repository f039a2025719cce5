"""Render scenes that `compare.py` described with Blender's Cycles: PYTHON compare_cycles.py FOLDER SAMPLES.

To be run by a Python that has `bpy`. Reads FOLDER/<name>.json and its GLB files; writes FOLDER/<name>_cycles.exr, scene-linear.
Units of light: a sun's strength is irradiance; a point or spot lamp of P watts gives P / 4 pi at one metre, an area lamp P /
pi.
"""

import json
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector


def empty_scene(samples):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = True
    scene.cycles.max_bounces = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    return scene


def add_camera(scene, camera):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.angle_x = 2 * math.atan(camera["width"] / 2 / camera["fx"])
    scene.render.resolution_x, scene.render.resolution_y = camera["width"], camera["height"]
    node = bpy.data.objects.new("camera", data)
    rotation, centre = np.array(camera["R"]), np.array(camera["center"])
    node.matrix_world = Matrix.Translation(centre) @ Matrix((rotation.T @ np.diag([1, -1, -1])).tolist()).to_4x4()
    scene.collection.objects.link(node)
    scene.camera = node


def add_model(scene, file, matrix):
    known = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=file)
    for node in set(bpy.data.objects) - known:
        if node.parent is None:
            node.matrix_world = Matrix(matrix) @ node.matrix_world


def add_ground(scene, z, image, color, repeat, shift, size=2000.0):
    mesh = bpy.data.meshes.new("ground")
    mesh.from_pydata([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("ground")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    place, picture = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeTexImage")
    picture.image = bpy.data.images.load(image, check_existing=True)
    in_repeats, tinted = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeVectorMath")
    in_repeats.operation, tinted.operation = "MULTIPLY_ADD", "MULTIPLY"
    in_repeats.inputs[1].default_value, tinted.inputs[1].default_value = (1 / repeat,) * 3, color
    in_repeats.inputs[2].default_value = shift, -shift, 0
    tree.links.new(place.outputs["Position"], in_repeats.inputs[0])
    tree.links.new(in_repeats.outputs[0], picture.inputs["Vector"])
    tree.links.new(picture.outputs["Color"], tinted.inputs[0])
    tree.links.new(tinted.outputs[0], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("ground", mesh))


def facing(position, toward):
    return Matrix.Translation(position) @ (Vector(toward) - Vector(position)).to_track_quat("-Z", "Y").to_matrix().to_4x4()


def add_light(scene, light, centre):
    kind = light["kind"]
    data = bpy.data.lights.new(kind, {"sun": "SUN", "point": "POINT", "spot": "SPOT", "area": "AREA"}[kind])
    data.color = light["color"]
    node = bpy.data.objects.new(kind, data)
    if kind == "sun":
        data.energy, data.angle = light["strength"], math.radians(light["angle_deg"])
        a, e = math.radians(light["azimuth"]), math.radians(light["elevation"])
        away = (math.cos(e) * math.sin(a), -math.cos(e) * math.cos(a), math.sin(e))
        node.matrix_world = facing(away, (0, 0, 0))
    else:
        position = Vector(light["position"]) + Vector(centre)
        toward = Vector(light.get("toward", (0, 0, -1))) + Vector(centre)
        node.matrix_world = facing(position, toward)
        data.energy = light["strength"] * (math.pi if kind == "area" else 4 * math.pi)
        if kind == "area":
            data.shape, data.size, data.size_y = "RECTANGLE", *light["size"]
        else:
            data.shadow_soft_size = light["radius"]
        if kind == "spot":
            data.spot_size, data.spot_blend = math.radians(light["angle_deg"]), light["blend"]
    scene.collection.objects.link(node)


def add_world(scene, sky):
    world = bpy.data.worlds.new("world")
    scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = nodes["Background"] if "Background" in nodes else nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = sky["strength"]
    if sky["kind"] == "hdri":
        image = nodes.new("ShaderNodeTexEnvironment")
        image.image = bpy.data.images.load(sky["file"])
        links.new(image.outputs["Color"], background.inputs["Color"])
        place, turn = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
        turn.inputs["Rotation"].default_value = (0, 0, -math.radians(sky["rotation_deg"]))
        links.new(place.outputs["Generated"], turn.inputs["Vector"])
        links.new(turn.outputs["Vector"], image.inputs["Vector"])
    else:
        background.inputs["Color"].default_value = (*sky["zenith"], 1)


def main():
    folder, samples = Path(sys.argv[1]), int(sys.argv[2])
    for file in sorted(folder.glob("*.json")):
        told = json.loads(file.read_text())
        scene = empty_scene(samples)
        add_camera(scene, told["camera"])
        for model in told["models"]:
            add_model(scene, model["file"], model["matrix"])
        if told["ground"]:
            add_ground(scene, **told["ground"])
        for light in told["lights"]:
            add_light(scene, light, told["centre"])
        add_world(scene, told["sky"])
        scene.render.filepath = str(folder / f"{file.stem}_cycles.exr")
        bpy.ops.render.render(write_still=True)


main()
