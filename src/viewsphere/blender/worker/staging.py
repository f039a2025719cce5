"""A scene from plain data: meshes, objects, ground, lights and settings, as `engines._blender.requests` tells them."""

from __future__ import annotations

import bpy
from mathutils import Matrix

from . import ground, lights, materials, meshes, renderers, scripting, studio
from .blurring import ORDER
from .scene_file import open_scene

NUMBER = "number"
"""Custom property of a model's mesh: the mesh's index in the request."""


def stage(told):
    """Replace the open scene by the one in `told`, which has no camera: each render brings its own."""
    if told["file"]:
        scene = open_scene(told["file"])
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.view_layers[0].use_pass_z = False
    renderer = told["settings"]["renderer"]
    made = {}  # copies of a model with other materials share its textures
    kinds = [_mesh(mesh["name"], mesh, made, renderer) for mesh in told["meshes"]]
    for number, kind in enumerate(kinds):
        kind[NUMBER] = number
    for order, item in enumerate(told["objects"]):
        _place(scene, kinds[item["mesh"]], item["matrix"], item["index"])[ORDER] = order
    for light in told["lights"]:
        lights.add_light(scene, light)
    sky = lights.add_world(scene, told["world"]) if told["world"] else None
    if told["ground"]:
        _lay_ground(scene, told["ground"], sky, made, renderer)
    if renderer == "workbench":
        studio.light(scene.display, told["lights"], told["hemispheres"])
    renderers.set_up(scene, told["settings"])
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    if told["script"]:
        scripting.run(scene, told["script"])
    return {}


def paint(told):
    """Rebuild the materials of some models, whose pictures have become coarser or finer; the scene is otherwise kept."""
    numbered = {mesh[NUMBER]: mesh for mesh in bpy.data.meshes if NUMBER in mesh}
    made = {}
    before = set(bpy.data.images)
    for look in told["looks"]:
        mesh, images = numbered[look["mesh"]], meshes.build_images(look["images"], made)
        has_uv = [name in mesh.uv_layers for name in meshes.UV_LAYERS]
        for material, one in zip(mesh.materials, look["materials"], strict=True):
            materials.fill_material(material, one, images, has_uv, meshes.COLORS in mesh.color_attributes)
    bpy.data.batch_remove([image for image in before if not image.users])
    return {}


def _lay_ground(scene, told, sky, known, renderer):
    """Add the ground, which fades into the sky far behind the scene, or, as a shadow catcher, shows only shadows."""
    floor = _place(scene, _mesh("ground", told["mesh"], known, renderer), Matrix.Identity(4), 0)
    floor.is_shadow_catcher = told["catcher"]
    if not told["catcher"] and renderer != "workbench":
        ground.fade(floor.data.materials[0], told["middle"], told["fading"], sky)


def _mesh(name, told, known, renderer):
    images = meshes.build_images(told["images"], known)
    uv = told["uv0"] is not None, told["uv1"] is not None
    has_colors = told["colors"] is not None
    if renderer == "workbench":
        made = [materials.build_plain(m, images, uv) for m in told["materials"]]
    else:
        made = [materials.build_material(m, images, uv, has_colors, renderer == "cycles") for m in told["materials"]]
    return meshes.build_mesh(name, told, made)


def is_placed(one):
    """Return whether an object is viewsphere's own, not one of a user's file."""
    return ORDER in one


def _place(scene, mesh, matrix, index):
    placed = bpy.data.objects.new(mesh.name, mesh)
    placed.matrix_world = Matrix(matrix)
    placed.pass_index = placed["id"] = index
    scene.collection.objects.link(placed)
    return placed
