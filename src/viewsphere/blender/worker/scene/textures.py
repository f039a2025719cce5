"""Look-ups in pictures: glTF's coordinates, transforms, wrapping and normal maps as Cycles' nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from .graph import Graph
from .meshes import UV_LAYERS, Images

_EXTENSIONS = {"repeat": "REPEAT", "clamp": "EXTEND", "mirror": "MIRROR"}


@dataclass(frozen=True)
class Textures:
    """The textures of one material; one node looks up each texture, for any number of its channels."""

    graph: Graph
    images: Images
    has_uv: tuple[bool, bool]
    _nodes: dict = field(default_factory=dict)

    def color(self, told):
        """A texture's linear colour; None without a texture, or if the mesh lacks its coordinates."""
        return self._output(told, "Color", True)

    def alpha(self, told, nearest):
        """Alpha of a colour texture, of the nearest texel with `nearest`, or None."""
        return self._output(told and {**told, "nearest": nearest or told["nearest"]}, "Alpha", True)

    def channel(self, told, name):
        """Channel Red, Green, Blue or Alpha of a data texture, or None."""
        if name == "Alpha" or not self._is_usable(told):
            return self._output(told, name, False)
        key = _key(told), "channels"
        if key not in self._nodes:
            color = self._output(told, "Color", False)
            self._nodes[key] = self.graph.node("ShaderNodeSeparateColor", {0: color})
        return self._nodes[key].outputs[name]

    def normal(self, told, scale):
        """The surface's normal changed by a normal map, or None.

        Tangent space: Blender's x runs along the mesh's u, y up in the picture, as in glTF; a rotated texture rotates both.
        """
        color = self._output(told, "Color", False)
        if color is None or scale == 0:
            return None
        (a, b), (c, d) = np.array(_turn(told)) * scale
        if (a, b, c, d) != (1, 0, 0, 1):
            x = self.graph.math("ADD", self.graph.dot(color, (a, b, 0.0)), 0.5 - (a + b) / 2)
            y = self.graph.math("ADD", self.graph.dot(color, (c, d, 0.0)), 0.5 - (c + d) / 2)
            z = self.graph.dot(color, (0.0, 0.0, 1.0))
            color = self.graph.node("ShaderNodeCombineXYZ", enumerate((x, y, z))).outputs[0]
        layer = UV_LAYERS[told["texcoord"]]
        return self.graph.node("ShaderNodeNormalMap", {"Color": color}, space="TANGENT", uv_map=layer).outputs[0]

    def _is_usable(self, told):
        return told is not None and self.has_uv[told["texcoord"]]

    def _output(self, told, name, is_color):
        if not self._is_usable(told):
            return None
        key = _key(told), is_color
        if key not in self._nodes:
            self._nodes[key] = self._lookup(told, self.images.get(told["image"], is_color))
        return self._nodes[key].outputs[name]

    def _lookup(self, told, image):
        place = self.graph.node("ShaderNodeUVMap", uv_map=UV_LAYERS[told["texcoord"]]).outputs[0]
        if _matrix(told) != ((1, 0), (0, 1)) or any(told["offset"]):
            place = self._transformed(told, place)
        wraps = told["wrap_s"], told["wrap_t"]
        native = min(wraps, key=("repeat", "mirror", "clamp").index)
        if wraps[0] != wraps[1]:
            place = self._wrapped(place, [None if wrap == native else wrap for wrap in wraps], image.size)
        return self.graph.node(
            "ShaderNodeTexImage",
            {0: place},
            image=image,
            extension=_EXTENSIONS[native],
            interpolation="Closest" if told["nearest"] else "Linear",
        )

    def _transformed(self, told, place):
        """KHR_texture_transform with v pointing up: the same scale and rotation, but about the picture's other corner."""
        (_, b), (_, d) = _matrix(told)
        x, y = told["offset"]
        inputs = {
            "Vector": place,
            "Location": (x + b, 1 - y - d, 0.0),  # where glTF's transform takes u = 0, v = 1, Blender's origin
            "Rotation": (0.0, 0.0, told["rotation"]),
            "Scale": (*told["scale"], 1.0),
        }
        return self.graph.node("ShaderNodeMapping", inputs, vector_type="POINT").outputs[0]

    def _wrapped(self, place, wraps, size):
        """Wrap the axes whose entry of `wraps` is not None by nodes; the image node's own mode wraps the other axis.

        Coordinates stay half a texel inside the edge, where a look-up does not blend with the opposite edge. Mirrored or
        clamped look-ups beyond the edge have the same texel.
        """
        split = self.graph.node("ShaderNodeSeparateXYZ", {0: place}).outputs
        axes = [self._wrapped_axis(split[k], wraps[k], 0.5 / size[k]) for k in range(2)]
        return self.graph.node("ShaderNodeCombineXYZ", enumerate(axes)).outputs[0]

    def _wrapped_axis(self, value, wrap, half):
        if wrap is None:
            return value
        if wrap == "mirror":
            value = self.graph.math("PINGPONG", value, 1.0)
        return self.graph.node("ShaderNodeClamp", enumerate((value, half, 1 - half))).outputs[0]


def _key(told):
    return tuple((name, tuple(value) if isinstance(value, list) else value) for name, value in sorted(told.items()))


def _matrix(told):
    """Scale, then rotation, of (u, v), v down: the linear part of `viewsphere.assets.mesh.Texture.matrix`."""
    c, s = math.cos(told["rotation"]), math.sin(told["rotation"])
    u, v = told["scale"]
    return (c * u, s * v), (-s * u, c * v)


def _turn(told):
    """Rows (2, 2) that convert a normal map's x and y to the mesh's u and to up in the picture, as orthogonal directions."""
    (a, b), (c, d) = _matrix(told)
    turning = a * d - b * c
    if turning == 0:
        return (1.0, 0.0), (0.0, 1.0)
    length = math.hypot(d, c)
    side = math.copysign(1.0, turning)
    # Along the texture's u: the first column of the inverse, its second number along v, which points down.
    x, y = side * d / length, side * c / length
    return (x, -y * side), (y, x * side)
