"""The motion and the lens of a file's camera at frames of its animation."""

from __future__ import annotations

from pathlib import Path

import bpy
from mathutils import Matrix

from .opening import NAMES_SAID, open_file
from .playing import go_to

OPENCV_FROM_BLENDER = Matrix.Diagonal((1.0, -1.0, -1.0))


def read_cameras(told):
    """The motion and the lens of a camera at frames of an animation.

    `camera` names the camera (None: the scene's, or the only one), `frames` the frames (None: the first), `clip` the
    animation and `fps` its frames per second (None: the file's own).

    A motion is `rotation` (3, 3), world from camera in OpenCV's axes, and `center` in metres. Both are relative to the
    position and rotation of the object `at`, if given, at the first frame. The lens is for a picture of `size` (width,
    height), by default the scene's.
    """
    unit, warnings = open_file(told["file"], told["kind"], told["root"], cameras=True, clip=told["clip"], fps=told["fps"])
    scene = bpy.context.scene
    camera = _camera(scene, told["camera"])
    world_from_at = Matrix() if told["at"] is None else _rigid(_object(scene, told["at"]))
    size = told["size"] or _size(scene)
    aspect = scene.render.pixel_aspect_y / scene.render.pixel_aspect_x if told["kind"] == "blend" else 1.0
    found, after = [], None
    for frame in told["frames"] or [scene.frame_start]:
        go_to(scene, frame, after)
        after = frame
        shown = camera.evaluated_get(bpy.context.evaluated_depsgraph_get())
        found.append(_motion(world_from_at.inverted() @ _rigid(shown), unit) | {"lens": _lens(shown.data, size, aspect)})
    files = [str(Path(file).resolve()) for file in bpy.utils.blend_paths(absolute=True)]
    return {"cameras": found, "warnings": warnings, "files": files}


def _camera(scene, name):
    cameras = sorted((one for one in scene.objects if one.type == "CAMERA"), key=lambda one: one.name)
    if name is None and scene.camera is not None and scene.camera.type == "CAMERA":
        found = scene.camera
    elif name is None and len(cameras) == 1:
        found = cameras[0]
    else:
        found = next((one for one in cameras if one.name == name), None)
    if found is None:
        names = ", ".join(repr(one.name) for one in cameras[:NAMES_SAID]) or "none at all"
        raise ValueError(f"expected {'one camera' if name is None else f'a camera {name!r}'}, found {names}")
    if found.data.type != "PERSP":
        raise ValueError(f"camera {found.name!r}: expected a perspective lens, found {found.data.type.lower()}")
    return found


def _object(scene, name):
    found = scene.objects.get(name)
    if found is None:
        names = ", ".join(repr(one.name) for one in list(scene.objects)[:NAMES_SAID])
        raise ValueError(f"expected an object {name!r}, found {names}")
    return found.evaluated_get(bpy.context.evaluated_depsgraph_get())


def _rigid(shown):
    """The world-from-object matrix without its scale, which makes it rigid."""
    place, turn, _ = shown.matrix_world.decompose()
    return Matrix.LocRotScale(place, turn, None)


def _motion(matrix, unit):
    rotation = matrix.to_3x3() @ OPENCV_FROM_BLENDER
    return {"rotation": [list(row) for row in rotation], "center": [unit * value for value in matrix.translation]}


def _size(scene):
    scale = scene.render.resolution_percentage / 100
    return [int(scene.render.resolution_x * scale), int(scene.render.resolution_y * scale)]


def _lens(camera, size, aspect):
    """Focal lengths and centre in pixels, from the picture's corner; `aspect` is the height of a pixel over its width."""
    width, height = size
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if width >= aspect * height else "VERTICAL"
    across = width if fit == "HORIZONTAL" else aspect * height
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    focal = camera.lens / sensor * across
    center = width / 2 - camera.shift_x * across, height / 2 + camera.shift_y * across / aspect
    return {"width": width, "height": height, "fx": focal, "fy": focal / aspect, "cx": center[0], "cy": center[1]}
