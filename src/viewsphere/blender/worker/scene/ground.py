"""The end of the ground: far behind the scene it fades into the sky, as in the raster engine."""

from __future__ import annotations

import math

import bpy

from .graph import Graph

SKY = "viewsphere sky"
"""Name of the node that sets whether the sky is visible."""


def fade(material, middle, fading, sky):
    """Show the camera the sky instead of the faded ground; light and mirrors meet the whole ground.

    A transparent shader would be sampled at random, with noise. A holdout has no noise, nor does emission of the sky's light
    if the film is opaque. `fading`: metres behind the `middle` at which fading begins and ends, and the sine of the angle
    between view and ground at which flat views begin to fade; at the horizon they have faded. `sky`: the visible sky's
    picture, and its turn in degrees.
    """
    graph = Graph(material.node_tree)
    output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL").inputs["Surface"]
    surface = output.links[0].from_socket
    light = graph.node("ShaderNodeEmission", {"Color": _seen(graph, *sky)}).outputs[0]
    nothing = graph.node("ShaderNodeHoldout").outputs[0]
    behind = graph.mix(graph.node("ShaderNodeValue", name=SKY).outputs[0], nothing, light)
    graph.give(output, graph.mix(_gone(graph, middle, fading), surface, behind))
    material.cycles.emission_sampling = "NONE"


def show_sky(is_shown):
    """Choose the background behind the faded ground: the sky, or nothing (transparency)."""
    for material in bpy.data.materials:
        node = material.node_tree.nodes.get(SKY) if material.node_tree is not None else None
        if node is not None and node.outputs[0].default_value != is_shown:
            node.outputs[0].default_value = is_shown


def _gone(graph, middle, fading):
    """The share of the ground that has faded. It takes few nodes, because Cycles evaluates them for each sample of the
    ground.
    """
    place = graph.node(
        "ShaderNodeVectorTransform", {0: tuple(middle)}, vector_type="POINT", convert_from="WORLD", convert_to="CAMERA"
    )
    middle_away = graph.node("ShaderNodeVectorMath", {0: place.outputs[0]}, operation="LENGTH").outputs["Value"]
    behind = graph.math("SUBTRACT", graph.node("ShaderNodeCameraData").outputs["View Distance"], middle_away)
    near = _between(graph, behind, fading["end"], fading["begin"])
    left = _smooth(graph, graph.math("MULTIPLY", near, near), 0.0, 1.0)
    incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    sine = graph.math("ABSOLUTE", graph.node("ShaderNodeSeparateXYZ", {0: incoming}).outputs["Z"])
    left = graph.math("MULTIPLY", left, _smooth(graph, sine, 0.0, fading["flat"]))
    return graph.product(graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"], graph.complement(left))


def _seen(graph, image, turn_deg):
    """The sky's picture in the direction of the view."""
    view = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    away = graph.vector("MULTIPLY", view, (-1.0, -1.0, -1.0))
    turned = graph.node("ShaderNodeMapping", {"Vector": away, "Rotation": (0.0, 0.0, -math.radians(turn_deg))})
    return graph.node("ShaderNodeTexEnvironment", {"Vector": turned.outputs[0]}, image=image).outputs["Color"]


def _between(graph, value, low, high):
    """0 up to `low`, 1 from `high` on, linear between them."""
    return graph.node("ShaderNodeMapRange", {"Value": value, "From Min": low, "From Max": high}, clamp=True).outputs["Result"]


def _smooth(graph, value, low, high):
    """0 up to `low`, 1 from `high` on, smooth (3 x^2 - 2 x^3) between them."""
    inputs = {"Value": value, "From Min": low, "From Max": high}
    return graph.node("ShaderNodeMapRange", inputs, interpolation_type="SMOOTHSTEP").outputs["Result"]
