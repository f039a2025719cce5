"""The ground's end: far behind the scene it fades into the sky, as the raster engine's does."""

from __future__ import annotations

import math

import bpy

from .graph import Graph

SKY = "viewsphere sky"
"""Name of the node that says whether the sky is seen."""


def fade(material, middle, fading, sky):
    """Let the camera see the sky instead of the ground as far as it has faded; light and mirrors meet all of it.

    Transparency would be drawn by lot: a holdout, or the sky's light where the film is not transparent, has no noise. `fading`:
    metres behind the `middle` at which it begins and ends, and sines of the angle between the view and the ground at which
    flat views do. `sky`: picture and turn of what is seen.
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
    """Whether what has faded is the sky, or nothing."""
    for material in bpy.data.materials:
        node = material.node_tree.nodes.get(SKY) if material.node_tree is not None else None
        if node is not None and node.outputs[0].default_value != is_shown:
            node.outputs[0].default_value = is_shown


def _gone(graph, middle, fading):
    """The share that has faded; few nodes, as each sample of the ground works them out."""
    place = graph.node(
        "ShaderNodeVectorTransform", {0: tuple(middle)}, vector_type="POINT", convert_from="WORLD", convert_to="CAMERA"
    )
    middle_away = graph.node("ShaderNodeVectorMath", {0: place.outputs[0]}, operation="LENGTH").outputs["Value"]
    behind = graph.math("SUBTRACT", graph.node("ShaderNodeCameraData").outputs["View Distance"], middle_away)
    near = _between(graph, behind, fading["end"], fading["begin"])
    left = _smooth(graph, graph.math("MULTIPLY", near, near), 0.0, 1.0)
    incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    sine = graph.math("ABSOLUTE", graph.node("ShaderNodeSeparateXYZ", {0: incoming}).outputs["Z"])
    left = graph.math("MULTIPLY", left, _smooth(graph, sine, fading["flattest"], fading["flat"]))
    return graph.product(graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"], graph.complement(left))


def _seen(graph, image, turn_deg):
    """The sky's picture in the direction of the view."""
    view = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    away = graph.vector("MULTIPLY", view, (-1.0, -1.0, -1.0))
    turned = graph.node("ShaderNodeMapping", {"Vector": away, "Rotation": (0.0, 0.0, -math.radians(turn_deg))})
    return graph.node("ShaderNodeTexEnvironment", {"Vector": turned.outputs[0]}, image=image).outputs["Color"]


def _between(graph, value, low, high):
    """0 at low, 1 at high, and no less and no more beyond."""
    return graph.node("ShaderNodeMapRange", {"Value": value, "From Min": low, "From Max": high}, clamp=True).outputs["Result"]


def _smooth(graph, value, low, high):
    """The same by 3 x^2 - 2 x^3."""
    inputs = {"Value": value, "From Min": low, "From Max": high}
    return graph.node("ShaderNodeMapRange", inputs, interpolation_type="SMOOTHSTEP").outputs["Result"]
