"""A material's node tree, built from values that are numbers or sockets."""

from __future__ import annotations

import bpy


class Graph:
    """Adds nodes and links; a value is a number, a tuple of three, or another node's output."""

    def __init__(self, tree):
        self._tree = tree

    def node(self, kind, inputs=(), **properties):
        """A node of this kind; `inputs` are pairs of a socket's name or number and its value, or a dict of them."""
        node = self._tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in dict(inputs).items():
            self.give(node.inputs[name], value)
        return node

    def math(self, operation, *values):
        """The result of a Math node, a number."""
        return self.node("ShaderNodeMath", enumerate(values), operation=operation).outputs[0]

    def vector(self, operation, *values):
        """The result of a Vector Math node, three numbers."""
        return self.node("ShaderNodeVectorMath", enumerate(values), operation=operation).outputs[0]

    def dot(self, a, b):
        """The dot product, a number."""
        return self.node("ShaderNodeVectorMath", enumerate((a, b)), operation="DOT_PRODUCT").outputs["Value"]

    def product(self, *values):
        """The product of numbers; constants are multiplied here, without nodes."""
        constant, sockets = 1.0, []
        for value in values:
            if isinstance(value, bpy.types.NodeSocket):
                sockets.append(value)
            else:
                constant *= value
        if not sockets or constant == 0:
            return constant
        result = sockets[0]
        for value in sockets[1:] + ([constant] if constant != 1 else []):
            result = self.math("MULTIPLY", result, value)
        return result

    def colors(self, *values):
        """The product of colours; constants are multiplied here, without nodes."""
        constant, sockets = (1.0, 1.0, 1.0), []
        for value in values:
            if isinstance(value, bpy.types.NodeSocket):
                sockets.append(value)
            else:
                constant = tuple(a * b for a, b in zip(constant, value, strict=True))
        if not sockets or max(constant) == 0:
            return constant
        result = sockets[0]
        for value in sockets[1:] + ([constant] if constant != (1, 1, 1) else []):
            result = self.vector("MULTIPLY", result, value)
        return result

    def shades(self, color, value):
        """A colour times a number."""
        if not isinstance(value, bpy.types.NodeSocket):
            return self.colors(color, (value,) * 3)
        node = self.node("ShaderNodeVectorMath", {0: color}, operation="SCALE")
        self.give(node.inputs["Scale"], value)
        return node.outputs[0]

    def complement(self, value):
        """One minus a number."""
        return self.math("SUBTRACT", 1.0, value) if isinstance(value, bpy.types.NodeSocket) else 1.0 - value

    def mix(self, share, first, second):
        """A mix of two closures (shaders); None is a closure that neither reflects nor hides anything."""
        if not isinstance(share, bpy.types.NodeSocket) and share in (0, 1):
            return second if share else first
        inputs = {0: share} | {k: closure for k, closure in ((1, first), (2, second)) if closure is not None}
        return self.node("ShaderNodeMixShader", inputs).outputs[0]

    def add(self, first, second):
        """The sum of two closures (shaders); None is no closure."""
        if first is None or second is None:
            return first or second
        return self.node("ShaderNodeAddShader", {0: first, 1: second}).outputs[0]

    def give(self, socket, value):
        """Link or set one socket."""
        if isinstance(value, bpy.types.NodeSocket):
            self._tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
