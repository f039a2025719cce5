"""Finds the parts of an open file that need add-ons or scripts; the worker loads none of these."""

from __future__ import annotations

import bpy

NAMES_SAID = 5
"""Largest number of names in a message, which is one line."""
DRIVEN = "objects", "meshes", "curves", "shape_keys", "materials", "armatures", "lights", "cameras", "worlds", "scenes"


def needed():
    """Warnings about nodes, node trees and render engines that Blender itself lacks, and about scripts that would run on
    opening.
    """
    said = []
    strangers = sorted({node.name for tree in _trees() for node in tree.nodes if node.bl_idname == "NodeUndefined"})
    strangers += sorted(tree.name for tree in bpy.data.node_groups if tree.bl_idname in ("", "NodeTreeUndefined"))
    if strangers:
        said.append(f"needs add-ons, which are not loaded, for the nodes {_listed(strangers)}: rendered without them")
    scripts = sorted(text.name for text in bpy.data.texts if text.use_module)
    if scripts:
        said.append(f"scripts that would run on opening do not run: {_listed(scripts)}")
    drivers = sorted({f"{owner.name}: {curve.data_path}" for owner in _driven() for curve in _of_python(owner)})
    if drivers:
        said.append(f"drivers with Python do not run: {_listed(drivers)}")
    return said


def remove_styles():
    """Remove the style modules of Freestyle from all scenes. Blender runs their Python at rendering, although it runs no
    other scripts, and a compositor may render other scenes than the open one. Returns a warning if there were any.
    """
    layers = [layer for scene in bpy.data.scenes for layer in scene.view_layers if hasattr(layer, "freestyle_settings")]
    styles = {one.script for layer in layers for one in layer.freestyle_settings.modules if one.script is not None}
    names = sorted(style.name for style in styles)
    for style in styles:
        bpy.data.texts.remove(style)
    return [f"style modules of Freestyle do not run: {_listed(names)}"] if names else []


def _trees():
    """Yield every node tree: groups, and the trees within materials, worlds, lights and scenes."""
    yield from bpy.data.node_groups
    for owner in (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights, *bpy.data.scenes):
        tree = getattr(owner, "node_tree", None)
        if tree is not None:
            yield tree


def _driven():
    """Yield every data-block with drivers; shape keys, materials and meshes have their own."""
    for name in DRIVEN:
        for owner in getattr(bpy.data, name):
            if owner.animation_data is not None:
                yield owner


def _of_python(owner):
    """The owner's drivers that would need Python: expressions beyond Blender's own arithmetic."""
    drivers = owner.animation_data.drivers
    return [one for one in drivers if one.driver.type == "SCRIPTED" and not one.driver.is_simple_expression]


def _listed(names):
    more = f" and {len(names) - NAMES_SAID} more" if len(names) > NAMES_SAID else ""
    return ", ".join(map(repr, names[:NAMES_SAID])) + more
