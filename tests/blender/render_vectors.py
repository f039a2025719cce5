"""Makes three animated files, or renders one with Cycles' own motion vectors; run by a Python that has bpy.

`make FOLDER`: turn.blend (a rigid motion), bend.blend (an armature and a shape key), wave.blend (a modifier that depends on
the time). `render FILE CAMERAS OUT`: of each frame named in the JSON file of cameras (R, center, fx, width, height), the pass
Vector, (H, W, 4), and the depth, as arrays of an NPZ file; the first row is on top.
"""

import json
import os
import sys
from pathlib import Path

import bpy  # first: the next two are parts of it

# isort: split
import bmesh
import cycles
import numpy as np
from mathutils import Matrix

SENSOR = 36.0


def anew():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 5, 24
    return scene


def put(build):
    """An object of triangles only, so that no quad is cut in two ways."""
    mesh, made = bpy.data.meshes.new("thing"), bmesh.new()
    build(made)
    bmesh.ops.triangulate(made, faces=made.faces)
    made.to_mesh(mesh)
    found = bpy.data.objects.new("thing", mesh)
    bpy.context.scene.collection.objects.link(found)
    return found


def turn():
    body = put(lambda made: bmesh.ops.create_icosphere(made, subdivisions=3, radius=0.7))
    for frame, place, angles in ((1, (-0.3, 0, 0.7), (0, 0, 0)), (5, (0.4, 0.3, 1.0), (0.5, -0.7, 1.2))):
        body.location, body.rotation_euler, body.scale = place, angles, (1, 1.2, 0.8)
        body.keyframe_insert("location", frame=frame)
        body.keyframe_insert("rotation_euler", frame=frame)


def bend():
    bones = bpy.data.armatures.new("bones")
    armature = bpy.data.objects.new("armature", bones)
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    low, high = bones.edit_bones.new("low"), bones.edit_bones.new("high")
    low.head, low.tail, high.head, high.tail = (0, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 2)
    high.parent = low
    bpy.ops.object.mode_set(mode="OBJECT")
    body = put(lambda made: bmesh.ops.create_cone(
        made, cap_ends=True, segments=12, radius1=0.4, radius2=0.3, depth=2, matrix=Matrix.Translation((0, 0, 1))
    ))  # fmt: skip
    cut = bmesh.new()
    cut.from_mesh(body.data)
    for height in np.linspace(0.2, 1.8, 9):
        geometry = cut.verts[:] + cut.edges[:] + cut.faces[:]
        bmesh.ops.bisect_plane(cut, geom=geometry, plane_co=(0, 0, height), plane_no=(0, 0, 1))
    bmesh.ops.triangulate(cut, faces=cut.faces)
    cut.to_mesh(body.data)
    body.shape_key_add(name="Basis")
    wide = body.shape_key_add(name="wide")
    for k, vertex in enumerate(body.data.vertices):
        wide.data[k].co.x = 1.5 * vertex.co.x
    for name, sign in (("low", -1), ("high", 1)):
        group = body.vertex_groups.new(name=name)
        for vertex in body.data.vertices:
            group.add([vertex.index], min(max(0.5 + sign * (vertex.co.z - 1), 0), 1), "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature
    bone = armature.pose.bones["high"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (5, 0.9)):
        bone.rotation_euler, wide.value = (angle, 0.2 * angle, 0), angle
        bone.keyframe_insert("rotation_euler", frame=frame)
        wide.keyframe_insert("value", frame=frame)


def wave():
    body = put(lambda made: bmesh.ops.create_grid(made, x_segments=10, y_segments=10, size=1.2))
    body.location.z = 0.5
    changed = body.modifiers.new("wave", "WAVE")
    changed.height, changed.width, changed.speed, changed.time_offset = 0.3, 0.8, 0.1, -30
    body.keyframe_insert("location", frame=1)


def make(folder):
    for build in (turn, bend, wave):
        anew()
        build()
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder) / f"{build.__name__}.blend"), check_existing=False)


def watched():
    """Gives the passes of the next renders, by name."""
    found, original = {}, cycles.CyclesRender.render

    def render(self, depsgraph):
        original(self, depsgraph)
        result = self.get_result()
        for one in result.layers[0].passes:
            values = np.empty(result.resolution_x * result.resolution_y * one.channels, np.float32)
            one.rect.foreach_get(values)
            found[one.name] = values.reshape(result.resolution_y, result.resolution_x, -1)[::-1].copy()

    cycles.CyclesRender.render = render
    return found


def place(camera, view, frame):
    """A key at this frame: the pose, and the focal length."""
    camera.rotation_mode = "QUATERNION"
    camera.matrix_world = (
        Matrix.Translation(view["center"]) @ Matrix((np.array(view["R"]).T @ np.diag([1, -1, -1])).tolist()).to_4x4()
    )
    camera.data.sensor_fit, camera.data.sensor_width, camera.data.lens = (
        "HORIZONTAL",
        SENSOR,
        SENSOR * view["fx"] / view["width"],
    )
    for name in ("location", "rotation_quaternion"):
        camera.keyframe_insert(name, frame=frame)
    camera.data.keyframe_insert("lens", frame=frame)


def render(file, cameras, out):
    bpy.ops.wm.open_mainfile(filepath=file)
    views = {int(frame): view for frame, view in json.loads(Path(cameras).read_text()).items()}
    scene, one = bpy.context.scene, next(iter(views.values()))
    scene.camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    scene.collection.objects.link(scene.camera)
    for frame, view in views.items():
        place(scene.camera, view, frame)
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", one["width"], one["height"]
    scene.render.use_motion_blur = False  # Cycles has no vectors with it
    own = scene.cycles
    own.samples, own.use_denoising, own.use_adaptive_sampling, own.pixel_filter_type, own.filter_width = (
        1,
        False,
        False,
        "BOX",
        0.01,
    )
    layer = scene.view_layers[0]
    layer.use_pass_vector = layer.use_pass_z = True
    found, kept = watched(), {}
    for frame in views:
        scene.frame_set(frame)
        bpy.ops.render.render()
        kept |= {f"vector{frame}": found["Vector"], f"depth{frame}": found["Depth"][..., 0]}
    np.savez(out, **kept)


{"make": make, "render": render}[sys.argv[1]](*sys.argv[2:])
sys.stdout.flush()
os._exit(0)  # Blender 4.5 hangs in its own way out
