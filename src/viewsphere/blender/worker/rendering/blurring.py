"""Motion blur: objects and the camera have keys while the shutter is open, and none afterwards."""

from __future__ import annotations

from contextlib import contextmanager

import bpy
from mathutils import Matrix

from ..files.playing import curves
from .posing import camera_matrix

STEPS = 3
"""Cycles evaluates 2 ** STEPS + 1 moments."""

ORDER = "viewsphere order"
"""Custom property of a placed object: its number among all."""


@contextmanager
def exposed(scene, told):
    """Move objects and the camera while a picture is rendered; None: nothing moves.

    `told` has `objects`, by their numbers, with their `matrices`, and the poses of the `camera`. They move evenly from half
    a frame before the scene's frame to half a frame after.
    """
    if told is None:
        yield
        return
    placed = {one[ORDER]: one for one in scene.objects if ORDER in one}
    moving = [(placed[each["object"]], [Matrix(m) for m in each["matrices"]]) for each in told["objects"]]
    if told["camera"]:
        moving.append((scene.camera, [camera_matrix(pose["R"], pose["center"]) for pose in told["camera"]]))
    resting = [(one, one.rotation_mode, one.matrix_world.copy()) for one, _ in moving]
    for one, matrices in moving:
        _move(one, matrices, scene.frame_current)
    _switch(scene, True)
    try:
        yield
    finally:
        _switch(scene, False)
        for one, mode, matrix in resting:
            action = one.animation_data.action
            one.animation_data_clear()
            bpy.data.actions.remove(action)
            one.rotation_mode = mode
            one.matrix_world = matrix


def _switch(scene, on):
    render = scene.render
    render.use_motion_blur = on
    render.motion_blur_shutter = 1.0
    render.motion_blur_position = "CENTER"
    scene.eevee.motion_blur_steps = 2**STEPS if on else 1
    scene.update_tag()


def _move(one, matrices, frame):
    """Set keys from half a frame before to half a frame after, with linear interpolation."""
    one.rotation_mode = "QUATERNION"
    one.cycles.motion_steps = STEPS
    before = None
    for k, matrix in enumerate(matrices):
        place, turn, scale = matrix.decompose()
        if before is not None:
            turn.make_compatible(before)
        one.location, one.rotation_quaternion, one.scale, before = place, turn, scale, turn
        for path in ("location", "rotation_quaternion"):
            one.keyframe_insert(path, frame=frame - 0.5 + k / (len(matrices) - 1))
    for curve in curves(one.animation_data.action):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
