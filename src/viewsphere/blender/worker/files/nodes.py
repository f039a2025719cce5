"""Node trees of materials as plain expressions, which `viewsphere.assets.readers.blender.nodes` evaluates.

An expression is a number, a list of three or four (linear colours), or a dict `{"do": name, ...}` of other expressions.
`lost` lists the names of the parts of a tree that expressions cannot represent.
"""

from __future__ import annotations

from contextlib import contextmanager

STEPS = 256
"""Steps of the tables that approximate curves and colour ramps."""

MOST = 1000
"""Most nodes that are followed in one material; a node counts each time that it is used."""

PLAIN = {
    "color": [0.8, 0.8, 0.8],
    "alpha": 1.0,
    "metallic": 0.0,
    "roughness": 1.0,
    "specular": 0.0,
    "specular_color": [1.0, 1.0, 1.0],
    "ior": 1.5,
    "emission": [0.0, 0.0, 0.0],
    "transmission": 0.0,
    "coat": 0.0,
    "coat_roughness": 0.0,
    "normal": None,
}
"""A surface as expressions; `normal` is None, or a normal map's colours and strength."""

GLTF_NODES = ("gltf material output", "gltf settings")
"""Beginnings of names of node groups, in lower case. Blender's glTF importer and exporter keep properties in these groups
that no shader has: https://docs.blender.org/manual/en/latest/addons/import_export/scene_gltf2.html, "Baked Ambient
Occlusion".
"""

UNSEEN = {"alpha": 0.0}
"""An invisible surface: only its alpha counts."""

BLENDS = ("MIX", "MULTIPLY", "ADD", "SUBTRACT", "SCREEN", "DARKEN", "LIGHTEN", "DIFFERENCE", "DIVIDE", "OVERLAY")
MATHS = (
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "POWER", "MINIMUM", "MAXIMUM", "LESS_THAN", "GREATER_THAN",
    "ROUND", "ABSOLUTE", "SQRT",
)  # fmt: skip
WRAPS = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "clamp", "MIRROR": "mirror"}

UNKEPT = {
    "Subsurface Weight": "subsurface scattering",
    "Sheen Weight": "sheen",
    "Anisotropic": "anisotropy",
    "Thin Film Thickness": "thin film",
}
"""Inputs of the Principled BSDF that are lost unless they are 0."""


class Reader:
    """Reads one material's tree. `images` lists the pictures of all materials so far."""

    def __init__(self, images):
        self.images = images
        self.lost = []
        self._groups = []  # the group nodes around the node being read, the innermost last
        self._count = 0

    def read(self, material):
        """The material's surface and name, as expressions."""
        tree = material.node_tree if material.use_nodes else None
        output = tree.get_output_node("CYCLES") if tree else None
        if output is None:
            color = list(material.diffuse_color)
            look = PLAIN | {"color": color[:3], "metallic": material.metallic, "roughness": material.roughness, "specular": 1.0}
        else:
            look = self._shader(output.inputs["Surface"]) or PLAIN | {"color": [0.0, 0.0, 0.0]}
            for name in ("Volume", "Displacement"):
                if output.inputs[name].is_linked:
                    self._lose(name.lower())
        told = {"name": material.name, "double_sided": not material.use_backface_culling, "lost": self.lost}
        return told | PLAIN | look | {"occlusion": self._occlusion(tree)}

    def _occlusion(self, tree):
        """glTF's ambient occlusion, the share of the ambient light that arrives; None if the tree has none."""
        for node in tree.nodes if tree else ():
            group = node.node_tree if node.bl_idname == "ShaderNodeGroup" else None
            if group is not None and group.name.lower().startswith(GLTF_NODES):
                socket = node.inputs.get("Occlusion")
                if socket is not None and socket.is_linked:
                    return self._number(socket)
        return None

    def _lose(self, what):
        if what not in self.lost:
            self.lost.append(what)

    # Shaders: a surface, None where nothing is linked.

    def _shader(self, socket):
        with self._feeding(socket) as found:
            return None if found is None else self._surface(found[0])

    def _surface(self, node):
        if node.bl_idname in SHADERS:
            return SHADERS[node.bl_idname](self, node)
        self._lose(f"the shader {node.bl_label or node.bl_idname}")
        color = node.inputs.get("Color") or node.inputs.get("Base Color")
        return PLAIN | {"color": self._color(color)} if color else PLAIN

    def _principled(self, node):
        inputs = node.inputs
        for name, what in UNKEPT.items():
            if name in inputs and (inputs[name].is_linked or inputs[name].default_value != 0):
                self._lose(what)
        return PLAIN | {
            "color": self._color(inputs["Base Color"]),
            "alpha": self._number(inputs["Alpha"]),
            "metallic": self._number(inputs["Metallic"]),
            "roughness": self._number(inputs["Roughness"]),
            "specular": _multiplied(2.0, self._number(inputs["Specular IOR Level"])),
            "specular_color": self._color(inputs["Specular Tint"]),
            "ior": self._number(inputs["IOR"]),
            "emission": _multiplied(self._color(inputs["Emission Color"]), self._number(inputs["Emission Strength"])),
            "transmission": self._number(inputs["Transmission Weight"]),
            "coat": self._number(inputs["Coat Weight"]),
            "coat_roughness": self._number(inputs["Coat Roughness"]),
            "normal": self._normal(inputs["Normal"]),
        }

    def _matt(self, node):
        normal = self._normal(node.inputs["Normal"]) if "Normal" in node.inputs else None
        return PLAIN | {"color": self._color(node.inputs["Color"]), "normal": normal}

    def _glossy(self, node):
        return self._matt(node) | {"metallic": 1.0, "roughness": self._number(node.inputs["Roughness"]), "specular": 1.0}

    def _glass(self, node):
        found = {"transmission": 1.0, "specular": 1.0, "ior": self._number(node.inputs["IOR"])}
        return self._matt(node) | found | {"roughness": self._number(node.inputs["Roughness"])}

    def _emission(self, node):
        glow = _multiplied(self._color(node.inputs["Color"]), self._number(node.inputs["Strength"]))
        return PLAIN | {"color": [0.0, 0.0, 0.0], "emission": glow}

    def _transparent(self, node):
        color = self._color(node.inputs["Color"])
        if color != [1.0, 1.0, 1.0]:
            self._lose("the colour of what is transparent")
        return UNSEEN

    def _mix_of_two(self, node):
        first, second = (self._shader(node.inputs[k]) or UNSEEN for k in (1, 2))
        with self._feeding(node.inputs[0]) as found:
            by_angle = found is not None and getattr(found[0], "bl_idname", "") in BY_ANGLE
        if by_angle and first is not UNSEEN and second is not UNSEEN:
            return first | {"roughness": second["roughness"], "specular": 1.0}  # an older way to build plastic
        return _mixed(self._number(node.inputs[0]), first, second)

    def _sum_of_two(self, node):
        first, second = (self._shader(node.inputs[k]) or UNSEEN for k in (0, 1))
        if first is UNSEEN or second is UNSEEN:
            other = second if first is UNSEEN else first
            return other | {"alpha": 0.5} if other is not UNSEEN else UNSEEN
        glow = {"do": "math", "how": "ADD", "of": [first["emission"], second["emission"]]}
        if first["color"] == [0.0, 0.0, 0.0]:
            return second | {"emission": glow}
        if second["color"] != [0.0, 0.0, 0.0]:
            self._lose("the sum of two shaders")
        return first | {"emission": glow}

    # Values.

    def _color(self, socket):
        value = self._value(socket)
        return value if isinstance(value, (dict, list)) else [value] * 3

    def _number(self, socket):
        value = self._value(socket)
        return {"do": "grey", "of": [value]} if isinstance(value, list) else value

    def _value(self, socket):
        """An expression of the socket's own kind."""
        with self._feeding(socket) as found:
            if found is None:
                return _own(socket)
            node, output = found
            value = _own(output) if node is None else self._worked(node, output)
        if socket.type in ("VALUE", "INT") and output.type in ("RGBA", "VECTOR"):
            return {"do": "grey", "of": [value]}
        if socket.type in ("RGBA", "VECTOR") and output.type in ("VALUE", "INT"):
            return {"do": "color", "of": [value]}
        return value

    @contextmanager
    def _feeding(self, socket):
        """The node and output of `_source`. In the context, `_groups` are the groups around that node."""
        groups = list(self._groups)
        try:
            yield self._source(socket)
        finally:
            self._groups = groups

    def _source(self, socket):
        """The node and output that feed a socket, through reroutes and groups. None if the socket is not linked; (None,
        input) if the link leads to a group's input socket that has a value of its own.
        """
        while socket.is_linked and socket.links[0].is_valid and not socket.links[0].is_muted:
            output = socket.links[0].from_socket
            node = output.node
            if node.bl_idname == "NodeReroute":
                socket = node.inputs[0]
            elif node.bl_idname == "NodeGroupInput" and self._groups:
                outer = self._groups.pop()
                socket = next(s for s in outer.inputs if s.identifier == output.identifier)
                if not socket.is_linked:
                    return None if socket.type == "SHADER" else (None, socket)
            elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and len(self._groups) < 50:
                inner = next((n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
                if inner is None:
                    return None
                self._groups.append(node)
                socket = next(s for s in inner.inputs if s.identifier == output.identifier)
                if not socket.is_linked:
                    return None if socket.type == "SHADER" else (None, socket)
            elif node.mute and node.internal_links:
                inside = next((link for link in node.internal_links if link.to_socket == output), None)
                if inside is None:
                    return None
                socket = inside.from_socket
            else:
                return node, output
        return None

    def _worked(self, node, output):
        """The expression of a node's output."""
        self._count += 1
        if self._count > MOST:
            self._lose(f"a tree of more than {MOST:,} nodes")
            return [0.5, 0.5, 0.5] if output.type in ("RGBA", "VECTOR") else 0.5
        return VALUES.get(node.bl_idname, Reader._unknown)(self, node, output)

    def _unknown(self, node, output):
        """The expression for an unsupported node: the first linked input of the output's type, else a middle value."""
        self._lose(f"the node {node.bl_label or node.bl_idname}")
        linked = [s for s in node.inputs if s.is_linked and s.type == output.type and s.type in ("RGBA", "VALUE")]
        if linked:
            return self._value(linked[0])
        return [0.5, 0.5, 0.5] if output.type in ("RGBA", "VECTOR") else 0.5

    def _teximage(self, node, output):
        if node.image is None:
            return [0.0, 0.0, 0.0] if output.name == "Color" else 1.0
        if node.projection != "FLAT":
            self._lose("the projection of an image from its sides")
        told = {"do": "image", "image": self.images.index(node.image, self._lose)}
        told |= {"wrap": WRAPS[node.extension], "nearest": node.interpolation == "Closest"}
        told |= self._place(node.inputs["Vector"])
        if output.name == "Alpha":
            return told | {"alpha": True}
        # Where the alpha is not linked, clear texels show black, unless the picture's alpha is an independent channel.
        is_black = not node.outputs["Alpha"].is_linked and node.image.alpha_mode in ("STRAIGHT", "PREMUL")
        return told | {"black": is_black}

    def _place(self, socket):
        """The name of the texture coordinates and their transform: first scaled, then rotated, then shifted, v upwards."""
        place = {"uv": "", "scale": [1.0, 1.0], "rotation": 0.0, "offset": [0.0, 0.0]}
        found = self._source(socket)
        if found is not None and found[0] is not None and found[0].bl_idname == "ShaderNodeMapping":
            place |= self._mapping(found[0])
            found = self._source(found[0].inputs["Vector"])
        if found is None or found[0] is None:
            return place
        node, output = found
        if node.bl_idname == "ShaderNodeUVMap" and not node.from_instancer:
            return place | {"uv": node.uv_map}
        if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type == "GEOMETRY":
            return place | {"uv": node.attribute_name}
        if node.bl_idname == "ShaderNodeTexCoord" and output.name == "UV":
            return place
        self._lose(f"the texture coordinates of {node.bl_label or node.bl_idname} ({output.name})")
        return place | {"uv": None}

    def _mapping(self, node):
        turn, scale = self._constant(node.inputs["Rotation"]), self._constant(node.inputs["Scale"])
        shift = self._constant(node.inputs["Location"]) if "Location" in node.inputs else [0.0] * 3
        if node.vector_type not in ("POINT", "VECTOR") or turn[0] or turn[1]:
            self._lose("a mapping that tilts or inverts")
            return {}
        offset = shift[:2] if node.vector_type == "POINT" else [0.0, 0.0]
        return {"scale": scale[:2], "rotation": turn[2], "offset": offset}

    def _constant(self, socket):
        value = self._value(socket)
        if isinstance(value, dict):
            self._lose("a mapping that changes")
            return list(socket.default_value)
        return value

    def _given(self, _, output):
        return _own(output)

    def _vertexcolor(self, node, output):
        return self._painted(node.layer_name, output)

    def _attribute(self, node, output):
        if node.attribute_type != "GEOMETRY":
            return self._unknown(node, output)
        return self._painted(node.attribute_name, output)

    def _painted(self, name, output):
        if output.name == "Alpha":
            self._lose("the alpha of vertex colours")
            return 1.0
        told = {"do": "attribute", "name": name}
        return {"do": "grey", "of": [told]} if output.type == "VALUE" else told

    def _mix(self, node, output):
        sockets = {s.identifier.split("_")[0]: s for s in node.inputs if s.enabled}
        if output.type not in ("RGBA", "VALUE"):
            return self._unknown(node, output)
        read = self._color if output.type == "RGBA" else self._number
        blend = node.blend_type if output.type == "RGBA" else "MIX"
        factor = self._number(sockets["Factor"])
        if node.clamp_factor:
            factor = {"do": "clamp", "of": [factor]}
        mixed = self._blend(blend, factor, read(sockets["A"]), read(sockets["B"]))
        return {"do": "clamp", "of": [mixed]} if getattr(node, "clamp_result", False) else mixed

    def _mixrgb(self, node, _):
        values = self._number(node.inputs[0]), self._color(node.inputs[1]), self._color(node.inputs[2])
        mixed = self._blend(node.blend_type, *values)
        return {"do": "clamp", "of": [mixed]} if node.use_clamp else mixed

    def _blend(self, how, factor, first, second):
        if how not in BLENDS:
            self._lose(f"the blend mode {how.lower().replace('_', ' ')}")
            how = "MIX"
        if factor == {"do": "clamp", "of": [1.0]}:
            factor = 1.0
        if how == "MULTIPLY" and factor == 1.0:
            return _multiplied(first, second)
        return {"do": "mix", "how": how, "of": [factor, first, second]}

    def _math(self, node, output):
        if node.operation not in MATHS:
            return self._unknown(node, output)
        values = [self._number(s) for s in node.inputs if s.enabled]
        worked = _multiplied(*values) if node.operation == "MULTIPLY" else {"do": "math", "how": node.operation, "of": values}
        return {"do": "clamp", "of": [worked]} if node.use_clamp else worked

    def _clamp(self, node, _):
        low, high = (self._constant_number(node.inputs[name]) for name in ("Min", "Max"))
        return {"do": "clamp", "of": [self._number(node.inputs["Value"])], "low": low, "high": high}

    def _constant_number(self, socket):
        value = self._number(socket)
        if isinstance(value, dict):
            self._lose("a bound that changes")
            return socket.default_value
        return value

    def _invert(self, node, _):
        return {"do": "invert", "of": [self._number(node.inputs[0]), self._color(node.inputs[1])]}

    def _gamma(self, node, _):
        return {"do": "math", "how": "POWER", "of": [self._color(node.inputs[0]), self._number(node.inputs[1])]}

    def _brightcontrast(self, node, _):
        return {"do": "contrast", "of": [self._color(node.inputs[0]), *map(self._number, (node.inputs[1], node.inputs[2]))]}

    def _huesaturation(self, node, _):
        names = "Hue", "Saturation", "Value", "Fac"
        values = [self._number(node.inputs.get(name) or node.inputs["Factor"]) for name in names]
        return {"do": "hue", "of": [self._color(node.inputs["Color"]), *values]}

    def _rgbtobw(self, node, _):
        return {"do": "grey", "of": [self._color(node.inputs[0])]}

    def _separatecolor(self, node, output):
        if getattr(node, "mode", "RGB") != "RGB":
            return self._unknown(node, output)
        return {"do": "channel", "which": list(node.outputs).index(output), "of": [self._color(node.inputs[0])]}

    def _combinecolor(self, node, output):
        if getattr(node, "mode", "RGB") != "RGB":
            return self._unknown(node, output)
        return {"do": "combine", "of": [self._number(s) for s in list(node.inputs)[:3]]}

    def _valtorgb(self, node, output):  # Color Ramp
        colors = [list(node.color_ramp.evaluate(k / STEPS)) for k in range(STEPS + 1)]
        table = [c[3] for c in colors] if output.name == "Alpha" else [c[:3] for c in colors]
        return {"do": "ramp", "of": [self._number(node.inputs[0])], "table": table}

    def _rgbcurve(self, node, _):
        node.mapping.initialize()
        curves = node.mapping.curves
        steps = [k / STEPS for k in range(STEPS + 1)]
        whole = [node.mapping.evaluate(curves[3], x) for x in steps]
        table = [[node.mapping.evaluate(curves[k], y) for k in range(3)] for y in whole]
        return {"do": "curves", "of": [self._number(node.inputs[0]), self._color(node.inputs[1])], "table": table}

    def _maprange(self, node, output):
        if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
            return self._unknown(node, output)
        names = "Value", "From Min", "From Max", "To Min", "To Max"
        values = [self._number(next(s for s in node.inputs if s.enabled and s.name == name)) for name in names]
        return {"do": "range", "of": values, "clamp": node.clamp}

    def _by_angle(self, _, __):
        self._lose("what depends on the angle of view")
        return 0.0

    def _lightpath(self, _, output):
        return 1.0 if output.name == "Is Camera Ray" else 0.0

    def _newgeometry(self, node, output):
        return 0.0 if output.name == "Backfacing" else self._unknown(node, output)

    # Normals.

    def _normal(self, socket):
        with self._feeding(socket) as found:
            if found is None or found[0] is None:
                return None
            node = found[0]
            if node.bl_idname == "ShaderNodeNormalMap" and node.space == "TANGENT":
                return self._normal_map(node)
            self._lose(f"the node {node.bl_label or node.bl_idname}")
            return self._normal(node.inputs["Normal"]) if "Normal" in node.inputs else None

    def _normal_map(self, node):
        strength, color = self._number(node.inputs["Strength"]), self._color(node.inputs["Color"])
        if isinstance(strength, dict):
            self._lose("a normal map's strength that changes")
            strength = 1.0
        return {"map": color, "strength": strength} if isinstance(color, dict) else None


def _own(socket):
    """A socket's own value."""
    value = socket.default_value
    if socket.type == "RGBA":
        return list(value)[:3]
    return list(value) if socket.type == "VECTOR" else float(value)


def _multiplied(*values):
    return {"do": "multiply", "of": list(values)}


def _mixed(share, first, second):
    """Two surfaces mixed field by field; an invisible surface (`UNSEEN`) contributes only its alpha."""
    whole = [field for field in PLAIN if field not in ("alpha", "normal")]
    if first is UNSEEN or second is UNSEEN:
        mixed = dict(second if first is UNSEEN else first)
    else:
        mixed = {field: _mix(share, first[field], second[field]) for field in whole}
        mixed["normal"] = first["normal"] or second["normal"]
    return mixed | {"alpha": _mix(share, first["alpha"], second["alpha"])}


def _mix(share, first, second):
    return first if first == second else {"do": "mix", "how": "MIX", "of": [share, first, second]}


BY_ANGLE = ("ShaderNodeFresnel", "ShaderNodeLayerWeight")

SHADERS = {
    "ShaderNodeAddShader": Reader._sum_of_two,
    "ShaderNodeBsdfAnisotropic": Reader._glossy,
    "ShaderNodeBsdfDiffuse": Reader._matt,
    "ShaderNodeBsdfGlass": Reader._glass,
    "ShaderNodeBsdfGlossy": Reader._glossy,
    "ShaderNodeBsdfPrincipled": Reader._principled,
    "ShaderNodeBsdfRefraction": Reader._glass,
    "ShaderNodeBsdfToon": Reader._matt,
    "ShaderNodeBsdfTranslucent": Reader._matt,
    "ShaderNodeBsdfTransparent": Reader._transparent,
    "ShaderNodeEmission": Reader._emission,
    "ShaderNodeMixShader": Reader._mix_of_two,
    "ShaderNodeSubsurfaceScattering": Reader._matt,
}

VALUES = {
    "ShaderNodeAttribute": Reader._attribute,
    "ShaderNodeBrightContrast": Reader._brightcontrast,
    "ShaderNodeClamp": Reader._clamp,
    "ShaderNodeCombineColor": Reader._combinecolor,
    "ShaderNodeCombineXYZ": Reader._combinecolor,
    "ShaderNodeFresnel": Reader._by_angle,
    "ShaderNodeGamma": Reader._gamma,
    "ShaderNodeHueSaturation": Reader._huesaturation,
    "ShaderNodeInvert": Reader._invert,
    "ShaderNodeLayerWeight": Reader._by_angle,
    "ShaderNodeLightPath": Reader._lightpath,
    "ShaderNodeMapRange": Reader._maprange,
    "ShaderNodeMath": Reader._math,
    "ShaderNodeMix": Reader._mix,
    "ShaderNodeMixRGB": Reader._mixrgb,
    "ShaderNodeNewGeometry": Reader._newgeometry,
    "ShaderNodeRGB": Reader._given,
    "ShaderNodeRGBCurve": Reader._rgbcurve,
    "ShaderNodeRGBToBW": Reader._rgbtobw,
    "ShaderNodeSeparateColor": Reader._separatecolor,
    "ShaderNodeSeparateXYZ": Reader._separatecolor,
    "ShaderNodeTexImage": Reader._teximage,
    "ShaderNodeValToRGB": Reader._valtorgb,
    "ShaderNodeValue": Reader._given,
    "ShaderNodeVertexColor": Reader._vertexcolor,
}
