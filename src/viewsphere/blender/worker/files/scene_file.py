"""Opens a user's .blend file as the scene; its world, lights, meshes and compositor are kept."""

from __future__ import annotations

from contextlib import suppress

import bpy

from ..rendering import compositing
from .opening import open_file
from .playing import curves, go_to


def open_scene(told):
    """Open the file that `told` names, with its objects shown and hidden as requested; returns the scene."""
    open_file(told["file"], "blend", told["root"])
    scene = bpy.context.scene
    reveal(scene, told["shown"])
    for name in told["hidden"]:
        if name in bpy.data.objects:
            _fix(bpy.data.objects[name], "hide_render", True)
    go_to(scene, scene.frame_start if told["frame"] is None else told["frame"])
    _only_color(scene)
    compositing.stop_writing()
    compositing.set_up(scene)
    if not compositing.is_used(scene):
        compositing.leave_out(scene)
    return scene


def reveal(scene, names):
    """Let renders show the objects of these names. An object hidden at the first frame is shown with all its descendants."""
    there = set(scene.collection.objects)
    for one in (bpy.data.objects[name] for name in names if name in bpy.data.objects):
        for member in (one, *(one.children_recursive if one.hide_render else ())):
            _fix(member, "hide_render", False)
            _fix(member, "hide_viewport", False)
            if member not in there:  # the object's own collections may be hidden
                scene.collection.objects.link(member)
                there.add(member)


def _fix(one, name, value):
    """Set a property permanently, despite the file's drivers and animations, by a driver, which overrides animations.

    Objects from a library cannot have drivers; their animation curves are muted.
    """
    if one.animation_data is not None and one.library is None:
        one.driver_remove(name)
        one.driver_add(name).driver.expression = str(int(value))
    elif one.animation_data is not None:
        for curve in _all_curves(one.animation_data):
            if curve.data_path == name:
                curve.mute = True
    setattr(one, name, value)


def _all_curves(animation):
    """Yield every driver and animation curve of an object's animation data."""
    yield from animation.drivers
    strips = (strip for track in animation.nla_tracks for strip in track.strips)
    for played in (animation, *strips):
        if played.action and played.action_slot:
            yield from curves(played.action, played.action_slot)


def _only_color(scene):
    """Switch off effects that labels do not show: labels have one moment, one view and the triangles of modifiers."""
    render = scene.render
    render.use_motion_blur = render.use_multiview = render.use_freestyle = render.use_sequencer = render.use_stamp = False
    render.use_border = render.use_crop_to_border = False
    render.dither_intensity = 0.0
    if not compositing.is_used(scene):
        for layer in scene.view_layers:
            layer.use = layer == bpy.context.view_layer
    for one in bpy.data.objects:
        with suppress(AttributeError):
            one.cycles.use_adaptive_subdivision = False  # Blender 4.5
        for modifier in one.modifiers:
            if getattr(modifier, "use_adaptive_subdivision", False):
                modifier.use_adaptive_subdivision = False
    cycles = scene.cycles
    cycles.use_auto_tile = False
    cycles.shading_system = False
    cycles.film_exposure = 1.0
