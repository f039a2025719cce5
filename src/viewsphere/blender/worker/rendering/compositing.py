"""The compositor of a file, which affects only colours."""

from __future__ import annotations

import bpy
import numpy as np


def _tree_of(scene):
    """The nodes of a scene's compositor, or None."""
    if not scene.render.use_compositing:
        return None
    if hasattr(scene, "compositing_node_group"):  # Blender 5.0 and later
        return scene.compositing_node_group
    return scene.node_tree if scene.use_nodes else None


HOW = "pictures are those that the renderer gives; link Render Layers to its output, or switch the compositor off"


def fault(scene):
    """The warnings if the compositor produces no picture, so that the uncomposited one is used; else an empty list."""
    tree = _tree_of(scene)
    if tree is None or not len(tree.nodes) or is_used(scene):
        return []
    lacks = "render layers (or has muted ones)" if _has_output(tree) else "output that something leads to"
    return [f"the compositor has no {lacks}: {HOW}"]


def is_used(scene):
    """Return whether a compositor produces the picture; Blender renders nothing for a compositor without render layers."""
    tree = _tree_of(scene)
    return tree is not None and _has_output(tree) and _asks_for_layers(tree)


def leave_out(scene):
    """Remove the compositor from a scene."""
    if hasattr(scene, "compositing_node_group"):  # Blender 5.0 and later
        scene.compositing_node_group = None
    else:
        scene.use_nodes = False


def _has_output(tree):
    return any(_is_output(node) and not node.mute and node.inputs[0].is_linked for node in tree.nodes)


def _asks_for_layers(tree):
    return any(node.bl_idname == "CompositorNodeRLayers" and not node.mute for node in tree.nodes)


def _is_output(node):
    return node.bl_idname in ("CompositorNodeComposite", "NodeGroupOutput") and len(node.inputs) > 0


def stop_writing():
    """Switch off all File Output nodes, in compositors and in node groups, so that only requested pictures are written."""
    trees = [*bpy.data.node_groups, *(tree for s in bpy.data.scenes if (tree := getattr(s, "node_tree", None)) is not None)]
    for tree in trees:
        for node in tree.nodes:
            if node.bl_idname == "CompositorNodeOutputFile":
                node.mute = True


def set_up(scene):
    """Let Blender write pictures as scene-linear floating point numbers, composited at full precision on the processor."""
    render, image = scene.render, scene.render.image_settings
    if hasattr(image, "media_type"):  # Blender 5.0 and later
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGBA", "32", "NONE"
    image.color_management = "FOLLOW_SCENE"
    image.use_preview = False
    render.use_file_extension = render.use_render_cache = False
    render.use_overwrite, render.use_placeholder = True, False
    for name, value in (("compositor_device", "CPU"), ("compositor_precision", "FULL")):
        if hasattr(render, name):
            setattr(render, name, value)


def read_picture(file):
    """The composed picture (H, W, 4) float32, premultiplied, the first row on top."""
    image = bpy.data.images.load(str(file))
    try:
        image.colorspace_settings.name = "Linear Rec.709"
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return np.ascontiguousarray(pixels.reshape(height, width, 4)[::-1])


def with_alpha(composed, rendered):
    """The composed picture, with the rendered alpha if the compositor dropped it; without alpha no background would show."""
    if composed.shape == rendered.shape and (composed[..., 3] == 1).all():
        composed[..., 3] = rendered[..., 3]
    return composed
