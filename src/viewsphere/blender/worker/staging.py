"""A scene from plain data: meshes, objects, ground, lights and settings, as `viewsphere.engines.cycles.told` tells them."""

from __future__ import annotations

from contextlib import suppress

import bpy
from mathutils import Matrix

from . import ground, lights, materials, meshes
from .scene_file import open_scene

ENOUGH = 8
"""Samples from which on normals help the denoiser."""


def stage(told):
    """Replace whatever there is by the scene that is told; the camera comes with each render."""
    if told["file"]:
        scene = open_scene(told["file"])
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.view_layers[0].use_pass_z = False
    made = {}  # copies of a model that are painted otherwise share its textures
    kinds = [_mesh(mesh["name"], mesh, made) for mesh in told["meshes"]]
    for item in told["objects"]:
        _place(scene, kinds[item["mesh"]], item["matrix"], item["index"])
    for light in told["lights"]:
        lights.add_light(scene, light)
    sky = lights.add_world(scene, told["world"]) if told["world"] else None
    if told["ground"]:
        _lay_ground(scene, told["ground"], sky, made)
    set_up(scene, told["settings"])
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    return {}


def set_up(scene, settings):
    """How Cycles works: one process a core, no adaptive sampling unless asked for, what is unchanged stays in memory."""
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = True
    scene.render.threads_mode = "FIXED" if settings["threads"] else "AUTO"
    scene.render.threads = max(settings["threads"], 1)
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.samples = settings["samples"]
    cycles.use_adaptive_sampling = False
    cycles.use_light_tree = False
    cycles.max_bounces = settings["bounces"]
    cycles.transparent_max_bounces = 16
    cycles.seed = 0
    _denoise(cycles, settings["denoise"], settings["samples"])
    _choose_device(cycles, settings["device"])
    for name, value in settings["cycles"].items():
        _set(cycles, name, value)


def _set(cycles, name, value):
    """A setting by its name in Python; raises ValueError for one that Cycles does not have, or a value it does not take."""
    try:
        setattr(cycles, name, value)
    except (AttributeError, TypeError) as error:
        raise ValueError(
            f"engine.settings.{name}: expected a setting of Cycles and a value it takes, found {value!r}: {error}"
        ) from None


def _denoise(cycles, how, samples):
    """Open Image Denoise; normals that are themselves noise, of a few samples, would tell it to keep the noise."""
    cycles.use_denoising = how != "off"
    if how != "off":
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL" if samples >= ENOUGH else "RGB_ALBEDO"
        cycles.denoising_prefilter = "ACCURATE" if how == "best" else "NONE"
        if hasattr(cycles, "denoising_quality"):  # Blender 4.2 and later
            cycles.denoising_quality = "HIGH" if how == "best" else "FAST"


def _choose_device(cycles, name):
    """The processor, or all graphics cards that Cycles reaches this way; raises ValueError if there is none."""
    cycles.device = "CPU" if name == "CPU" else "GPU"
    if name == "CPU":
        return
    preferences = bpy.context.preferences.addons["cycles"].preferences
    chosen = []
    with suppress(TypeError):  # a kind that this build does not know
        preferences.compute_device_type = name
        preferences.refresh_devices()
        chosen = [device for device in preferences.devices if device.type == name]
    if not chosen:
        raise ValueError(f"engine.device: expected cpu or a device that Cycles can reach, found no {name.lower()} device")
    for device in preferences.devices:
        device.use = device in chosen


def _lay_ground(scene, told, sky, known):
    """The ground: it fades into the sky far behind the scene, or shows nothing but the shadows on it."""
    floor = _place(scene, _mesh("ground", told["mesh"], known), Matrix.Identity(4), 0)
    floor.is_shadow_catcher = told["catcher"]
    if not told["catcher"]:
        ground.fade(floor.data.materials[0], told["middle"], told["unit"], sky)


def _mesh(name, told, known):
    images = meshes.build_images(told["images"], known)
    uv = told["uv0"] is not None, told["uv1"] is not None
    made = [materials.build_material(m, images, uv, told["colors"] is not None) for m in told["materials"]]
    return meshes.build_mesh(name, told, made)


def _place(scene, mesh, matrix, index):
    placed = bpy.data.objects.new(mesh.name, mesh)
    placed.matrix_world = Matrix(matrix)
    placed.pass_index = placed["id"] = index
    scene.collection.objects.link(placed)
    return placed
