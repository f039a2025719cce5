"""A file's animation: its first and last frame, its motion, and moving the scene to a frame."""

from __future__ import annotations

import bpy

SIMULATED = {"CLOTH", "SOFT_BODY", "FLUID", "DYNAMIC_PAINT", "PARTICLE_SYSTEM", "COLLISION"}
"""Modifiers whose result depends on earlier frames (simulations)."""

PLAYED = SIMULATED | {"BUILD", "EXPLODE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "OCEAN", "WAVE"}
"""Modifiers that change with time without any keys."""

TIME_NODES = {"GeometryNodeInputSceneTime", "GeometryNodeSimulationInput"}


def play(clip):
    """Let every object play the animation `clip`; None: the animation that the file plays, which is the first one in
    imported files.

    FBX files call an animation a take. Importers turn each take into actions named `<moved object>|<animation>`. An object
    that the first animation does not move plays the first one that does.
    """
    chosen = [action for action in bpy.data.actions if clip in (action.name, action.name.rpartition("|")[2])]
    if clip is not None and not chosen:
        raise ValueError(f"expected an animation {clip!r}, found {', '.join(map(repr, clips())) or 'none at all'}")
    for one in _animated():
        data = one.animation_data
        if data is None:
            continue
        strips = [strip.action for track in data.nla_tracks for strip in track.strips if track.mute and strip.action]
        for action in chosen if clip is not None else strips[:1] if data.action is None else ():
            kinds = one.id_type, "UNSPECIFIED"
            slot = next((s for s in action.slots if s.identifier[2:] == one.name and s.target_id_type in kinds), None)
            if slot is not None:
                data.action = action
                data.action_slot = slot


def clips():
    """Names of the animations."""
    return list(_clip_spans())


def _clip_spans():
    """First and last frame of each animation, by its name."""
    found = {}
    for action in bpy.data.actions:
        found.setdefault(action.name.rpartition("|")[2], []).append(action.frame_range)
    return {name: _span(ranges) for name, ranges in sorted(found.items())}


def _span(ranges):
    """The first and the last frame of several ranges."""
    return round(min(first for first, _ in ranges)), round(max(last for _, last in ranges))


def set_span(scene, kind):
    """Set the scene's first and last frame to those of its animation; a .blend file keeps its own."""
    if kind == "blend":
        return
    played = {one.animation_data.action for one in _animated() if one.animation_data} - {None}
    ranges = [action.frame_range for action in played or bpy.data.actions]
    if bpy.data.cache_files:  # Alembic and USD importers have set the scene's frames
        ranges.append((scene.frame_start, scene.frame_end))
    if ranges:
        scene.frame_start, scene.frame_end = _span(ranges)
    else:
        scene.frame_end = scene.frame_start


def timeline(scene):
    """First and last frame, frames per second, whether anything moves, and first and last frame of each animation."""
    return {
        "first": scene.frame_start,
        "last": scene.frame_end,
        "fps": scene.render.fps / scene.render.fps_base,
        "moves": scene.frame_end > scene.frame_start and _moves(scene),
        "clips": [{"name": name, "first": first, "last": last} for name, (first, last) in _clip_spans().items()],
    }


def curves(action, slot=None):
    """The animation curves of an action, or of one of its slots."""
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                if slot is None or bag.slot_handle == slot.handle:
                    yield from bag.fcurves


def go_to(scene, frame, after=None):
    """Go to a frame. Simulations are played up to it, from the first frame or from the last shown frame, `after`."""
    if _is_simulated(scene):
        for between in range(scene.frame_start if after is None else after + 1, frame):
            scene.frame_set(between)
    scene.frame_set(frame)


def _is_simulated(scene):
    """Return whether the scene has simulations, so that a frame depends on earlier ones."""
    world = scene.rigidbody_world
    return bool(
        (world is not None and world.enabled and world.collection is not None)
        or any(modifier.type in SIMULATED for modifier in _modifiers(scene))
        or _has_node({"GeometryNodeSimulationInput"})
    )


def _moves(scene):
    """Return whether anything in the scene could change with time."""
    return bool(
        len(bpy.data.actions)
        or len(bpy.data.cache_files)
        or _is_simulated(scene)
        or any(modifier.type in PLAYED for modifier in _modifiers(scene))
        or _has_node(TIME_NODES)
        or any(data.animation_data and data.animation_data.drivers for data in _animated())
    )


def _modifiers(scene):
    return (modifier for item in scene.objects for modifier in item.modifiers)


def _has_node(kinds):
    return any(node.bl_idname in kinds for tree in bpy.data.node_groups for node in tree.nodes)


def _animated():
    """The data-blocks that usually carry drivers and actions."""
    names = "objects", "meshes", "shape_keys", "armatures", "cameras", "lights", "curves", "materials"
    return (one for name in names for one in getattr(bpy.data, name))
