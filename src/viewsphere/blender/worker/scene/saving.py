"""Saves the staged scene as a .blend file for people to open: rendering a frame of this file gives that frame's picture."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import bpy

from . import ground
from .rig import key, make_rig
from .settling import settle
from .staging import is_placed

CURVES = {"standard": "Standard", "raw": "Standard", "filmic": "Filmic", "agx": "AgX"}
"""Blender's view transform for each of viewsphere's."""

LOOKS = {"Filmic": "Very High Contrast"}
"""Blender's look that is nearest to each of viewsphere's transforms; with a look, no background can be shown unchanged."""

SHOWN_AS = {"Standard": "sRGB", "Filmic": "Filmic sRGB", "AgX": "AgX Base sRGB"}
"""The colour space of a background's file for each view transform, so that the background is shown unchanged."""

MODELS, SCENERY, LIGHTS, RIG = "models", "scenery", "lights", "rig"


def save(told):
    """Write the staged scene to `told["file"]`, with the poses' cameras on a rig; returns the cameras' largest error."""
    scene = bpy.context.scene
    scene.name = told["name"]
    if told["is_users"]:
        settle(scene, told["members"])
    off = make_rig(scene, told["poses"])
    _describe(scene, told)
    _show(scene, told)
    if not told["is_users"]:
        _sort(scene)
    _set_output(scene.render, told["transparent"])
    _pack(told["sequence"])
    scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=told["file"], compress=True, relative_remap=False)
    return {"off": off}


def _describe(scene, told):
    """Store viewsphere's facts about the frames and objects as custom properties, and as a text."""
    for name, value in told["properties"].items():
        scene[name] = value
    for one in scene.objects:
        for name, value in told["objects"].get(str(one.pass_index), {}).items():
            if is_placed(one) or name not in one:  # the user's own properties stay: materials may read them
                one[name] = value
    bpy.data.texts.new("viewsphere").write(told["text"])


def _show(scene, told):
    """Set up the visible background and the view transform."""
    scene.render.film_transparent = told["is_open"]
    ground.show_sky(not told["is_open"])
    shown, transform = scene.view_settings, CURVES[told["transform"]]
    scene.display_settings.display_device = "sRGB"
    shown.view_transform, shown.gamma = transform, 1.0
    shown.look = "None" if told["background"] else LOOKS.get(transform, "None")
    key(scene, "view_settings.exposure", told["exposures"])
    if told["temperature_k"] is not None:
        shown.use_white_balance, shown.white_balance_temperature = True, told["temperature_k"]
    if told["background"] is not None and not told["is_users"]:
        _lay_behind(scene, told, SHOWN_AS[transform])


def _lay_behind(scene, told, space):
    """Add compositor nodes that put the picture over a background; exposure and view transform leave the background
    unchanged.
    """
    tree, out = _compositor(scene)
    behind, render = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("CompositorNodeRLayers")
    dim, over = tree.nodes.new("CompositorNodeExposure"), tree.nodes.new("CompositorNodeAlphaOver")
    behind.image = bpy.data.images.load(told["background"])
    behind.image.name = "background"
    behind.image.colorspace_settings.name = space
    if told["sequence"]:
        behind.image.source = "SEQUENCE"
        behind.frame_start, behind.frame_duration, behind.frame_offset = 1, len(told["poses"]), 0
        behind.use_auto_refresh = True
    key(tree, f'nodes["{dim.name}"].inputs[1].default_value', [-stops for stops in told["exposures"]])
    # Blender 5 has names for these two sockets; before, both were called Image and came after the factor.
    below, above = ("Background", "Foreground") if "Background" in over.inputs else (1, 2)
    for source, socket in (
        (behind.outputs["Image"], dim.inputs["Image"]),
        (dim.outputs[0], over.inputs[below]),
        (render.outputs["Image"], over.inputs[above]),
        (over.outputs[0], out.inputs[0]),
    ):
        tree.links.new(source, socket)
    for place, node in enumerate((behind, dim, over, out)):
        node.location = 250 * place, 0
    render.location = 250, 300


def _compositor(scene):
    """The scene's compositor tree, emptied, and its output node."""
    if hasattr(scene, "compositing_node_group"):  # Blender 5
        tree = bpy.data.node_groups.new("picture", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        return tree, tree.nodes.new("NodeGroupOutput")
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new("CompositorNodeComposite")


def _sort(scene):
    """Sort the objects into collections of models, scenery, lights and the rig."""
    for name in (MODELS, SCENERY, LIGHTS, RIG):
        scene.collection.children.link(bpy.data.collections.new(name))
    for one in list(scene.collection.objects):
        scene.collection.children[_collection_of(one)].objects.link(one)
        scene.collection.objects.unlink(one)


def _collection_of(one):
    if one.type == "LIGHT":
        return LIGHTS
    if one.type != "MESH" or one.hide_render:
        return RIG
    return MODELS if one.pass_index else SCENERY


def _set_output(render, is_transparent):
    """Save rendered pictures beside the .blend file, and render on all cores."""
    if hasattr(render.image_settings, "media_type"):  # Blender 5
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGBA" if is_transparent else "RGB"
    render.filepath = "//"
    render.threads_mode = "AUTO"
    render.use_persistent_data = False


def _pack_one(one, is_packed):
    """Pack a picture or a font into the file, unless its own file is missing."""
    with suppress(RuntimeError):
        if not is_packed:
            one.pack()
        if one.filepath and one.filepath != "<builtin>":
            one.filepath = f"//{Path(one.filepath).name}"


def _pack(sequence):
    """Pack all pictures into the file, except the backgrounds' sequence beside it; no path leads to another folder."""
    for image in bpy.data.images:
        if image.source == "SEQUENCE" and sequence:
            image.filepath = f"//{sequence}/{Path(image.filepath).name}"
        elif image.source in ("FILE", "GENERATED", "TILED"):
            _pack_one(image, image.packed_files)
    for font in bpy.data.fonts:
        _pack_one(font, font.packed_file or font.filepath == "<builtin>")
    for screen in bpy.data.screens:
        for space in (space for area in screen.areas for space in area.spaces):
            if space.type == "FILE_BROWSER" and space.params is not None:
                space.params.directory = b"/" * 1000  # a shorter path would leave the end of the old one
                space.params.directory = b"//"
