"""Lamps, and the world's environment picture.

viewsphere's irradiance E gives a white Lambert surface the radiance E / pi. Cycles: a sun's strength is irradiance; a lamp of P
watts gives P / (4 pi) at one metre, a rectangle P / pi.
"""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix, Vector

KINDS = {"sun": "SUN", "point": "POINT", "spot": "SPOT", "area": "AREA"}

EVEN = 0.05
"""Largest relative deviation of the light within one cell of the map from which Cycles samples the sky."""

FEWEST = 32
"""Fewest columns of the map from which Cycles samples the sky."""


def add_light(scene, told):
    """Add a lamp that is invisible to the camera. Its strength is its brightest colour channel, so that colours stay within
    1.
    """
    kind = told["kind"]
    data = bpy.data.lights.new(kind, KINDS[kind])
    color = told["irradiance"]
    strength = max(*color, 1e-12)
    data.color = [value / strength for value in color]
    if kind == "sun":
        data.energy, data.angle = strength, math.radians(told["angle_deg"])
        place = _facing((0, 0, 0), [-v for v in told["direction"]])
    else:
        data.energy = strength * (math.pi if kind == "area" else 4 * math.pi)
        place = _facing(told["position"], [b - a for a, b in zip(told["position"], told.get("toward", (0, 0, 0)), strict=True)])
    if kind == "area":
        data.shape, data.size, data.size_y = "RECTANGLE", *told["size"]
    if kind in ("point", "spot"):
        data.shadow_soft_size = told["radius"]
    if kind == "spot":
        data.spot_size, data.spot_blend = math.radians(told["angle_deg"]), told["blend"]
    lamp = bpy.data.objects.new(kind, data)
    lamp.matrix_world = place
    lamp.visible_camera = False
    scene.collection.objects.link(lamp)


def _facing(position, direction):
    """The matrix of a lamp that shines along its -Z in this direction; the width of an area lamp is level."""
    direction = Vector(direction) if any(direction) else Vector((0, 0, -1))
    return Matrix.Translation(position) @ direction.to_track_quat("-Z", "Y").to_matrix().to_4x4()


def add_world(scene, told):
    """Set the environment picture that lights the scene and the one that the camera sees (often the same one).

    Returns the picture that the camera sees, and its turn in degrees.
    """
    world = bpy.data.worlds.new("world")
    scene.world = world
    if hasattr(world, "use_nodes") and not world.use_nodes:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputWorld")
    pixels = np.load(told["picture"])
    place, image = _turned(tree, told["turn_deg"]), _picture(pixels)
    # The finer map that Cycles would take holds no more; each light sample looks the map up, and a small one stays in cache.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", _columns(pixels)
    lighting, seen = _background(tree, place, image), image
    if told["seen"] == told["picture"]:
        tree.links.new(lighting, output.inputs["Surface"])
    else:
        seen = _picture(np.load(told["seen"]))
        rays, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(rays.outputs["Is Camera Ray"], mix.inputs[0])
        tree.links.new(lighting, mix.inputs[1])
        tree.links.new(_background(tree, place, seen), mix.inputs[2])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return seen, told["turn_deg"]


def _turned(tree, turn_deg):
    """World directions in the axes of a picture that is turned counter-clockwise, seen from above."""
    place, turn = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value = (0, 0, -math.radians(turn_deg))
    tree.links.new(place.outputs["Generated"], turn.inputs["Vector"])
    return turn.outputs["Vector"]


def _background(tree, place, image):
    node, light = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeBackground")
    node.image = image
    tree.links.new(place, node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], light.inputs["Color"])
    return light.outputs[0]


def _columns(pixels):
    """The smallest number of columns of a light map of a picture (H, W, 3) that keeps each cell even."""
    light = pixels.mean(axis=2, dtype=np.float64)
    height, width = light.shape
    size = 1
    while width // (2 * size) >= FEWEST and width == 2 * height and height % (2 * size) == 0:
        size *= 2
        cells = light.reshape(height // size, size, width // size, size)
        mean = cells.mean(axis=(1, 3), keepdims=True)
        if (np.abs(cells - mean) > EVEN * mean).any():
            return width // size * 2
    return width // size


def _picture(pixels):
    height, width, _ = pixels.shape
    image = bpy.data.images.new("sky", width, height, float_buffer=True, is_data=True)
    rows = np.ones((height, width, 4), np.float32)
    rows[..., :3] = pixels[::-1]  # Blender's first row is the lowest
    image.pixels.foreach_set(rows.reshape(-1))
    image.pack()
    return image
