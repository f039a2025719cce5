"""Makes the animated files that `test_animation` reads, in the folder of the first argument; run by a Python that has bpy.

`jump`: a cube of 1 m that jumps over and turns, and a camera that follows it. Standard output is a JSON: by frame, where
Blender itself sees the cube's corners, in pixels.
"""

import json
import os
import sys
from pathlib import Path

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

FOLDER = Path(sys.argv[1])
CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
SIZE = 160, 120


def put(name, data):
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def cube(name="cube"):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(CORNERS, [], FACES)
    return put(name, mesh)


def anew(last=25):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, last
    return scene


def save(name):
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name), check_existing=False)


def jump():
    """The cube is at x = 0, 1 and 2, in the middle 1 m higher, at the frames 1, 13 and 25."""
    scene = anew()
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    body = cube()
    for frame, x, z in ((1, 0, 0), (13, 1, 1), (25, 2, 0)):
        body.location, body.rotation_euler = (x, 0, z), (0, 0, (frame - 1) / 24)
        body.keyframe_insert("location", frame=frame)
        body.keyframe_insert("rotation_euler", frame=frame)
    camera = put("eye", bpy.data.cameras.new("eye"))
    camera.data.lens, camera.data.shift_x, camera.data.shift_y = 35, 0.05, -0.1
    for frame, place in ((1, (0, -6, 2)), (25, (6, -6, 3))):
        camera.location = place
        camera.keyframe_insert("location", frame=frame)
    turned = camera.constraints.new("TRACK_TO")
    turned.target, turned.track_axis, turned.up_axis = body, "TRACK_NEGATIVE_Z", "UP_Y"
    spot = put("spot", None)
    spot.location, spot.rotation_euler, spot.scale = (1, 2, 3), (0, 0, 0.5), (2, 2, 2)
    put("orthographic", bpy.data.cameras.new("flat")).data.type = "ORTHO"
    scene.camera = camera
    save("jump.blend")
    bpy.data.objects.remove(bpy.data.objects["orthographic"])
    bpy.ops.export_scene.gltf(filepath=str(FOLDER / "jump.glb"), export_cameras=True)
    bpy.ops.wm.usd_export(filepath=str(FOLDER / "jump.usdc"), export_animation=True)
    bpy.ops.wm.alembic_export(filepath=str(FOLDER / "jump.abc"), as_background_job=False)
    bpy.ops.export_scene.fbx(filepath=str(FOLDER / "jump.fbx"))
    return {frame: _seen(scene, camera, body, frame) for frame in (1, 13, 25)}


def _seen(scene, camera, body, frame):
    scene.frame_set(frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    seen = [world_to_camera_view(scene, camera, shown.matrix_world @ Vector(corner)) for corner in CORNERS]
    return [[x * SIZE[0], (1 - y) * SIZE[1]] for x, y, _ in seen]


def bend():
    """An armature's bone that lifts the cube's upper half, and a shape key that widens it, by 1 m in 24 frames each."""
    anew()
    bones = bpy.data.armatures.new("bones")
    armature = put("armature", bones)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones.edit_bones.new("bone").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    body = cube()
    body.shape_key_add(name="Basis")
    wide = body.shape_key_add(name="wide")
    for k, (x, _, _) in enumerate(CORNERS):
        wide.data[k].co.x += 2 * x
    upper = [k for k, (_, _, z) in enumerate(CORNERS) if z == 1]
    body.vertex_groups.new(name="bone").add(upper, 1.0, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature
    bone = armature.pose.bones["bone"]
    for frame, value in ((1, 0.0), (25, 1.0)):
        bone.location, wide.value = (0, value, 0), value
        bone.keyframe_insert("location", frame=frame)
        wide.keyframe_insert("value", frame=frame)
    save("bend.blend")


def fall():
    """A rigid body that falls from 9 m."""
    scene = anew()
    body = cube()
    body.location.z = 9
    bpy.ops.rigidbody.world_add()
    scene.rigidbody_world.collection = bpy.data.collections.new("bodies")
    scene.rigidbody_world.collection.objects.link(body)
    save("fall.blend")


def still():
    anew()
    cube()
    save("still.blend")


seen = jump()
for make in (bend, fall, still):
    make()
print(json.dumps(seen), flush=True)
os._exit(0)  # Blender 4.5 hangs in its own way out
