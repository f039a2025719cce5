"""glTF 2.0 materials as Cycles' nodes: the fields of `viewsphere.assets.mesh.Material`, as the raster engine interprets
them.

A Principled BSDF covers most fields. glTF and Cycles share metals and dielectrics, roughness squared, Fresnel between the
reflectance at normal incidence and 1, and a clear coat of ior 1.5. In addition:

- Occlusion textures are left out: Cycles computes the light that does not reach a crevice.
- Reflections and emission of a BLEND material stay when its alpha falls (glass is often made by alpha), except where the
  material is almost clear. A material that transmits is never cut out: labels count it as solid, too.
- Transmitting surfaces without a thickness are thin and refract nothing. The light from straight behind passes, tinted by the
  base colour; the square of the roughness is the share that is scattered. A picture's alpha has no colours: if a background
  is laid behind a finished picture, it shows by the smallest of the three tints. Light of the surroundings fills the surplus
  of the other two.
- Transmitting surfaces with a thickness refract, whatever the thickness; in a picture's alpha they are opaque.
- Shadow rays pass both kinds straight on, as through thin glass, so clear glass casts light shadows.
- Unlit colours are shown unchanged, to the camera and in mirrors; they light nothing and cast shadows.
- All surfaces have two sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..rendering import passes
from .graph import Graph
from .meshes import COLORS
from .textures import Textures

UNEXPOSED = 1 / 0.7
"""Radiance of an unlit white surface, which the view shows as white: 1 / `viewsphere.rendering.view.EXPOSURE`."""

TOTAL = 0.99
"""Largest reflectance of dielectrics at normal incidence, as in Cycles."""

GREY = 0.02
"""Colours whose red, green and blue differ by less count as grey."""

SHARP = 0.1
"""Roughness up to which thin glass counts as clear: at this roughness it would scatter a hundredth of the light."""


@dataclass(frozen=True)
class _Look:
    """Properties of a material: numbers, colours (three numbers) or nodes' outputs. A normal of None is the surface's own."""

    color: Any
    alpha: Any
    metallic: Any
    roughness: Any
    emission: Any
    specular: Any
    tint: Any
    normal: Any
    coat: Any
    coat_roughness: Any
    coat_normal: Any
    transmission: Any  # share of the light that is not mirrored


def build_material(told, images, has_uv, has_colors, is_traced=True):
    """A Blender material from a `Material` as a dict and `meshes.build_images` of its mesh.

    has_uv: for both sets of coordinates, whether the mesh has them; textures that need absent coordinates are ignored. If
    the dict has `fixed_metallic` or `fixed_roughness`, and not None, they replace the factor and its texture.
    """
    material = bpy.data.materials.new(told["name"] or "material")
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    fill_material(material, told, images, has_uv, has_colors, is_traced)
    return material


def fill_material(material, told, images, has_uv, has_colors, is_traced=True):
    """Replace the nodes of a material by those of `build_material`."""
    material.node_tree.nodes.clear()
    graph = Graph(material.node_tree)
    textures = Textures(graph, images, tuple(has_uv))
    if told["unlit"]:
        color, alpha = _base(graph, textures, told, has_colors)
        material.cycles.emission_sampling = "NONE"
        surface = _veiled(graph, alpha, _unlit(graph, color))
    else:
        look = _look(graph, textures, told, has_colors)
        surface = _lit(graph, told, look, is_traced)
        if is_traced:
            _tell(graph, told, look)
        if told["transmission"] > 0 and not is_traced:
            material.surface_render_method = "BLENDED"
    graph.node("ShaderNodeOutputMaterial", {"Surface": _single_sided(graph, surface) if told.get("fronts_only") else surface})


def _single_sided(graph, surface):
    """The surface with a back that cameras do not see; shadows and reflections do not change."""
    camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    back = graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
    return graph.mix(graph.product(camera, back), surface, _nothing(graph))


def _tell(graph, told, look):
    """Fill the passes of materials where the surface counts as seen; Cycles evaluates these nodes only for these passes."""
    seen = 1.0
    if look.alpha != 1 and told["transmission"] == 0:
        seen = graph.complement(_is_less(graph, look.alpha, graph.node("ShaderNodeValue", name=passes.LEAST).outputs[0]))
    for name, value in zip(passes.MATERIALS, (look.roughness, look.metallic), strict=True):
        graph.node("ShaderNodeOutputAOV", {"Value": graph.product(seen, value)}, aov_name=name)


def build_plain(told, images, has_uv):
    """A material for Workbench, which shows the base colour's picture unchanged, or the base colour factor without a
    picture.
    """
    material = bpy.data.materials.new(told["name"] or "material")
    material.diffuse_color = [min(max(c, 0.0), 1.0) for c in told["base_color"]]
    material.metallic, material.roughness = told["metallic"], told["roughness"]
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    material.node_tree.nodes.clear()  # Workbench takes any texture node for the base colour
    Textures(Graph(material.node_tree), images, tuple(has_uv)).color(told["base_color_texture"])
    return material


def _nothing(graph, tint=(1.0, 1.0, 1.0)):
    """A closure through which all light passes straight on, tinted."""
    return graph.node("ShaderNodeBsdfTransparent", {"Color": tint}).outputs[0]


def _veiled(graph, alpha, surface):
    """The surface mixed with transparency by its alpha."""
    return surface if alpha == 1 else graph.mix(alpha, _nothing(graph), surface)


def _base(graph, textures, told, has_colors):
    """Base colour and the share of the light that the surface stops."""
    *factor, opacity = told["base_color"]
    texture, mode = told["base_color_texture"], told["alpha_mode"]
    colors = graph.node("ShaderNodeVertexColor", layer_name=COLORS).outputs if has_colors else None
    color = graph.colors(tuple(max(c, 0.0) for c in factor), *_given(textures.color(texture), colors and colors["Color"]))
    if mode == "OPAQUE" or (mode == "MASK" and told["transmission"] > 0 and not told["unlit"]):
        return color, 1.0
    # Labels cut out by the nearest texel, and the picture's cut-out must end where the labels' does.
    texels = textures.alpha(texture, nearest=mode == "MASK")
    alpha = graph.product(opacity, *_given(texels, colors and colors["Alpha"]))
    if mode == "BLEND":
        return color, _limited(graph, alpha)
    return color, graph.complement(_is_less(graph, alpha, told["alpha_cutoff"] - 1e-6))


def _given(*values):
    return [value for value in values if value is not None]


def _limited(graph, value):
    """A number between 0 and 1."""
    if isinstance(value, bpy.types.NodeSocket):
        return graph.node("ShaderNodeClamp", {0: value}).outputs[0]
    return min(max(value, 0.0), 1.0)


def _is_less(graph, value, limit):
    if any(isinstance(one, bpy.types.NodeSocket) for one in (value, limit)):
        return graph.math("LESS_THAN", value, limit)
    return float(value < limit)


def _look(graph, textures, told, has_colors):
    color, alpha = _base(graph, textures, told, has_colors)
    metallic = _limited(graph, _textured(graph, textures, told, "metallic", "Blue"))
    roughness = _limited(graph, _textured(graph, textures, told, "roughness", "Green"))
    has_coat, has_specular = told["clearcoat"] > 0, told["specular"] > 0

    def scaled(factor, texture, name):
        return graph.product(told[factor], *_given(textures.channel(told[texture], name))) if told[factor] > 0 else 0.0

    glow = tuple(max(c, 0.0) for c in told["emissive"])
    return _Look(
        color=color,
        alpha=alpha,
        metallic=metallic,
        roughness=roughness,
        emission=graph.colors(glow, *_given(textures.color(told["emissive_texture"]))) if max(glow) > 0 else glow,
        specular=scaled("specular", "specular_texture", "Alpha"),
        tint=_tint(graph, textures, told, metallic) if has_specular else (1.0, 1.0, 1.0),
        normal=textures.normal(told["normal_texture"], told["normal_scale"]),
        coat=scaled("clearcoat", "clearcoat_texture", "Red"),
        coat_roughness=scaled("clearcoat_roughness", "clearcoat_roughness_texture", "Green") if has_coat else 0.0,
        coat_normal=textures.normal(told["clearcoat_normal_texture"], 1.0) if has_coat else None,
        transmission=_without_metal(graph, scaled("transmission", "transmission_texture", "Red"), metallic),
    )


def _textured(graph, textures, told, name, channel):
    if told.get(f"fixed_{name}") is not None:
        return told[f"fixed_{name}"]
    if told[name] == 0:
        return 0.0
    return graph.product(told[name], *_given(textures.channel(told["metallic_roughness_texture"], channel)))


def _without_metal(graph, share, metallic):
    return 0.0 if share == 0 else graph.product(share, graph.complement(metallic))


def _reflectance(told):
    """Reflectance of a dielectric at normal incidence; an ior of 0 means total reflection (KHR_materials_ior)."""
    return min(((told["ior"] - 1) / (told["ior"] + 1)) ** 2 if told["ior"] > 0 else 1.0, TOTAL)


def _ior(reflectance):
    root = reflectance**0.5
    return (1 + root) / (1 - root)


def _tint(graph, textures, told, metallic):
    """KHR_materials_specular's colour, limited to total reflection; metals have their own."""
    factor = tuple(max(c, 0.0) for c in told["specular_color"])
    texels = textures.color(told["specular_color_texture"])
    if factor == (1, 1, 1) and texels is None:
        return factor
    limit = 1 / max(_reflectance(told), 1e-6)
    if texels is None:
        tint = tuple(min(c, limit) for c in factor)
    else:
        tint = graph.colors(factor, texels)
        tint = graph.vector("MINIMUM", tint, (limit,) * 3) if max(factor) > limit else tint
    if metallic == 0:
        return tint
    node = graph.node("ShaderNodeMix", data_type="RGBA")
    # The node has sockets of equal names, one for each data type: addressed by number.
    graph.give(node.inputs[0], metallic)
    graph.give(node.inputs[6], tint)
    graph.give(node.inputs[7], (1.0, 1.0, 1.0))
    return node.outputs[2]


def _unlit(graph, color):
    """Emission that only camera and mirror rays see: it lights no surface."""
    path = graph.node("ShaderNodeLightPath").outputs
    seen = graph.complement(path["Is Diffuse Ray"])
    return graph.node("ShaderNodeEmission", {"Color": color, "Strength": graph.product(UNEXPOSED, seen)}).outputs[0]


def _lit(graph, told, look, is_traced):
    """The whole surface: reflection, emission, and the light that passes through it."""
    has_glass, is_blended = look.transmission != 0, told["alpha_mode"] == "BLEND" and look.alpha != 1
    shine = None
    if has_glass or is_blended:
        shine = _principled(graph, told, look, graph.shades(look.color, look.metallic))
    body = None if look.transmission == 1 else _principled(graph, told, look, look.color)
    if has_glass:
        thin = graph.add(shine, _through(graph, told, look, is_traced))
        body = graph.mix(
            look.transmission, body, _solid(graph, told, look, thin) if is_traced and told["thickness"] > 0 else thin
        )
    surface = _veiled(graph, look.alpha, body)
    return graph.add(surface, graph.mix(_more_shine(graph, look.alpha), None, shine)) if is_blended else surface


def _more_shine(graph, alpha):
    """The share of mirrored light that a blended surface adds beyond its opacity.

    Only camera rays include the addition. Between surfaces, more light would leave than arrives.
    """
    shown = graph.math("MINIMUM", graph.product(8.0, alpha), 1.0)
    camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    return graph.product(graph.math("SUBTRACT", shown, alpha), camera)


def _principled(graph, told, look, color, transmission=0.0):
    """Return the opaque surface, or the surface of a transmitting solid. A black dielectric only mirrors and emits."""
    reflectance = _reflectance(told)
    inputs = {
        "Base Color": color,
        "Metallic": look.metallic,
        "Roughness": look.roughness,
        "IOR": _ior(reflectance),
        "Specular IOR Level": graph.product(0.5, look.specular),
        "Specular Tint": look.tint,
        "Transmission Weight": transmission,
    }
    if look.normal is not None:
        inputs["Normal"] = look.normal
    if look.coat != 0:
        inputs |= {"Coat Weight": look.coat, "Coat Roughness": look.coat_roughness}
        if look.coat_normal is not None:
            inputs["Coat Normal"] = look.coat_normal
    if look.emission != (0, 0, 0):
        inputs |= {"Emission Color": look.emission, "Emission Strength": 1.0}
    return graph.node("ShaderNodeBsdfPrincipled", inputs, distribution="MULTI_GGX").outputs[0]


def _solid(graph, told, look, thin):
    """The surface of solid glass, which refracts the view and mirrors. For shadow rays it is thin. So it is for rays from
    scattering surfaces that look for light: they would count the light of the shadow rays a second time.
    """
    # The node tints what passes by the root of its colour.
    squared = graph.vector("MULTIPLY", look.color, look.color)
    bulk = _principled(graph, told, look, squared, transmission=1.0)
    path = graph.node("ShaderNodeLightPath").outputs
    return graph.mix(graph.math("MAXIMUM", path["Is Shadow Ray"], path["Is Diffuse Ray"]), bulk, thin)


def _through(graph, told, look, is_traced):
    """Light from behind thin glass: the share that the surface does not mirror, tinted by its colour."""
    reflectance = min(_reflectance(told) * told["specular"], TOTAL)
    left = graph.complement(_fresnel(graph, _ior(reflectance), look.normal)) if reflectance > 0 else 1.0
    if look.coat != 0:
        left = graph.product(left, graph.complement(graph.product(look.coat, _fresnel(graph, 1.5, look.coat_normal))))
    tint = graph.shades(look.color, left)
    clear = _clear(graph, look.color, left, tint) if is_traced else _nothing(graph, tint)
    if not isinstance(look.roughness, bpy.types.NodeSocket) and look.roughness <= SHARP:
        return clear
    milky = graph.node("ShaderNodeBsdfTranslucent", {"Color": tint}).outputs[0]
    return graph.mix(graph.product(look.roughness, look.roughness), clear, milky)


def _clear(graph, color, left, tint):
    """Light from straight behind, times `tint`: the glass's colour times the share `left` that is not mirrored."""
    excess = _above_least(graph, color)
    if not isinstance(excess, bpy.types.NodeSocket) and max(excess) < GREY:
        return _nothing(graph, tint)
    camera = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    excess = graph.shades(excess, graph.product(left, camera))
    # A refraction of ior 1 lets light go straight on, but does not count as transparent in the picture's alpha.
    straight = graph.node("ShaderNodeBsdfRefraction", {"Color": excess, "Roughness": 0.0, "IOR": 1.0}).outputs[0]
    return graph.add(_nothing(graph, graph.vector("SUBTRACT", tint, excess)), straight)


def _above_least(graph, color):
    """A colour without its grey share."""
    if not isinstance(color, bpy.types.NodeSocket):
        return tuple(c - min(color) for c in color)
    red, green, blue = graph.node("ShaderNodeSeparateColor", {0: color}).outputs
    least = graph.math("MINIMUM", graph.math("MINIMUM", red, green), blue)
    return graph.vector("SUBTRACT", color, least)


def _fresnel(graph, ior, normal):
    """Fresnel reflectance of a thin sheet, equal from both sides: Cycles' own node treats the back as a solid's inside."""
    back = graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
    turned = graph.math("POWER", ior, graph.math("MULTIPLY_ADD", back, -2.0, 1.0))
    inputs = {"IOR": turned} | ({"Normal": normal} if normal is not None else {})
    return graph.node("ShaderNodeFresnel", inputs).outputs[0]
