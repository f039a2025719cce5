"""The camera on the viewing sphere: a frame of the timeline for every pose.

An empty, `target`, is at the point where the camera looks. Its child `viewing sphere` is not rendered. The sphere's radius
is the camera's distance; it is rotated by 90 degrees less the elevation about X and by the azimuth about Z. The sphere's
child is the camera, rolled by the tilt: rotating or scaling the sphere moves the camera. Keys are constant: poses are not
interpolated.
"""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix

from ..files.playing import curves
from ..rendering.frames import place_camera

STILL = 1e-9
"""Largest change of a property that gets no keys: metres, radians, millimetres or shares of the picture."""

RINGS, SIDES = 12, 48
"""Circles of the displayed sphere, and edges of each circle."""


def make_rig(scene, poses):
    """Target, sphere and the scene's camera, and a marker for each of the poses.

    Returns the camera's largest error over all poses, in the scene's units; directions are compared at the distance of the
    target.
    """
    scene.frame_start, scene.frame_end = 1, len(poses)
    camera = scene.camera
    _key_lens(scene, [pose["camera"] for pose in poses])
    target = bpy.data.objects.new("target", None)
    target.empty_display_size = 0.1 * min(pose["distance"] for pose in poses)
    sphere = bpy.data.objects.new("viewing sphere", _ball())
    sphere.hide_render = True
    for made in (target, sphere):
        scene.collection.objects.link(made)
    sphere.parent, camera.parent = target, sphere
    camera.matrix_parent_inverse = Matrix.Identity(4)
    camera.matrix_basis = Matrix.Translation((0, 0, 1))
    camera.data.display_size = 0.2
    key(target, "location", [pose["target"] for pose in poses])
    turns = [(math.radians(90 - pose["elevation"]), 0.0, math.radians(pose["azimuth"])) for pose in poses]
    key(sphere, "rotation_euler", turns)
    key(sphere, "scale", [(pose["distance"],) * 3 for pose in poses])
    key(camera, "rotation_euler", [(0.0, 0.0, -math.radians(pose["tilt"])) for pose in poses])
    for number, pose in enumerate(poses, 1):
        scene.timeline_markers.new(pose["name"], frame=number)
    return max(_off(scene, number, pose) for number, pose in enumerate(poses, 1))


def key(owner, path, values):
    """Set a data-block's property to the first of the values; if they change, add a constant key for each frame."""
    rows = np.array(values, float).reshape(len(values), -1)
    is_array = np.ndim(values[0]) > 0
    holder, _, name = path.rpartition(".")
    setattr(owner.path_resolve(holder) if holder else owner, name, rows[0].tolist() if is_array else float(rows[0, 0]))
    for i in np.flatnonzero(np.ptp(rows, axis=0) > STILL).tolist():
        owner.keyframe_insert(path, frame=1, **({"index": i} if is_array else {}))
        curve = next(c for c in curves(owner.animation_data.action) if c.data_path == path and c.array_index == i)
        points = curve.keyframe_points
        points.add(len(rows) - len(points))
        points.foreach_set("co", np.stack([np.arange(1, len(rows) + 1), rows[:, i]], axis=1).astype(np.float32).ravel())
        for point in points:
            point.interpolation = "CONSTANT"
        curve.update()


def _key_lens(scene, views):
    lenses = []
    for view in views:
        place_camera(scene, view)
        data = scene.camera.data
        lenses.append((data.lens, data.ortho_scale, data.shift_x, data.shift_y))
    place_camera(scene, views[0])
    for name, values in zip(("lens", "ortho_scale", "shift_x", "shift_y"), zip(*lenses, strict=True), strict=True):
        key(scene.camera.data, name, values)


def _off(scene, number, pose):
    scene.frame_set(number)
    found, view = np.array(scene.camera.matrix_world), pose["camera"]
    turned = found[:3, :3] / np.linalg.norm(found[:3, :3], axis=0)
    turned_off = np.abs(turned - np.array(view["R"]).T @ np.diag([1, -1, -1])).max()
    return float(max(np.abs(found[:3, 3] - view["center"]).max(), turned_off * pose["distance"]))


def _ball():
    """Circles of equal elevation and of equal azimuth, of radius 1, as edges. Their poles are on Y, which points up in the
    picture of a camera without tilt.
    """
    angles = [2 * math.pi * i / SIDES for i in range(SIDES)]
    circles = []
    for k in range(1, RINGS):
        c, s = math.sin(math.pi * k / RINGS), math.cos(math.pi * k / RINGS)
        circles.append([(c * math.cos(a), s, c * math.sin(a)) for a in angles])
    for k in range(RINGS):
        c, s = math.cos(math.pi * k / RINGS), math.sin(math.pi * k / RINGS)
        circles.append([(c * math.cos(a), math.sin(a), s * math.cos(a)) for a in angles])
    points = [point for circle in circles for point in circle]
    edges = [(k * SIDES + i, k * SIDES + (i + 1) % SIDES) for k in range(len(circles)) for i in range(SIDES)]
    mesh = bpy.data.meshes.new("viewing sphere")
    mesh.from_pydata(points, edges, [])
    return mesh
