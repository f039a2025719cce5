"""A scene from plain data: meshes, objects, ground, lights and settings, as sent by `engines.shared.blender.requests`."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix

from ..files.scene_file import open_scene
from ..rendering import renderers
from ..rendering.blurring import ORDER
from . import ground, lights, materials, meshes, scripting

DARKEST = 0.6
"""Largest share of the light that shadows remove. Workbench darkens faces turned away from the sun equally, although the sun
does not light them.
"""

TURNED = 0.05
"""Cosine of the angle between the sun and a surface's normal below which Workbench treats the surface as shadowed."""


NUMBER = "number"
"""Custom property of a model's mesh: the mesh's index in the request."""


def stage(told):
    """Replace the open scene by the scene in `told`, which has no camera: each render brings its own."""
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
        _studio_light(scene.display, told["lights"], told["hemispheres"])
    renderers.set_up(scene, told["settings"])
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    if told["script"]:
        scripting.run(scene, told["script"])
    return {}


def paint(told):
    """Rebuild the materials of some models, whose pictures have become coarser or finer; the rest of the scene is kept."""
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
    """Return whether an object is viewsphere's own, not part of a user's file."""
    return ORDER in one


def _place(scene, mesh, matrix, index):
    placed = bpy.data.objects.new(mesh.name, mesh)
    placed.matrix_world = Matrix(matrix)
    placed.pass_index = placed["id"] = index
    scene.collection.objects.link(placed)
    return placed


def _studio_light(display, lights, hemispheres):
    """Light the display's studio by the sun among the `lights`, and by `hemispheres` (2, 3): the radiance of a white matt
    surface that faces up, and of one that faces down. None leaves Blender's own studio unchanged.
    """
    if hemispheres is None:
        return
    system, shading = bpy.context.preferences.system, display.shading
    above, below = np.array(hemispheres)
    sun = next((one for one in lights if one["kind"] == "sun"), None)
    direct = np.zeros(3) if sun is None else np.array(sun["irradiance"]) / math.pi
    toward = (0.0, 0.0, 1.0) if sun is None else sun["direction"]
    system.use_studio_light_edit = True
    least = np.minimum(above, below)
    system.light_ambient = least.tolist()
    for lamp in system.solid_lights:
        lamp.use, lamp.specular_color = False, (0, 0, 0)
    # A studio lamp of smoothness 1 gives (1 + cosine) / 4 of its colour.
    for lamp, way, more in zip(system.solid_lights, (1.0, -1.0), (above - least, below - least), strict=False):
        _shine(lamp, (0.0, 0.0, way), 2 * more, 1.0)
    _shine(system.solid_lights[2], toward, direct, 0.0)
    shading.use_world_space_lighting = True
    shading.show_shadows = sun is not None
    if sun is not None:
        lit = direct.mean() * max(toward[2], 0.05)
        shading.shadow_intensity = min(float(lit / (lit + above.mean())), DARKEST)
        display.shadow_shift, display.shadow_focus = TURNED, 1 - TURNED
        display.light_direction = _turned(toward)


def _shine(lamp, toward, color, smooth):
    lamp.use, lamp.smooth = True, smooth
    lamp.direction, lamp.diffuse_color = _turned(toward), color.tolist()


def _turned(direction):
    """A world direction in the axes of a studio."""
    x, y, z = direction
    return x, z, -y
