"""Makes a place, `yard.blend` and `yard.glb`, in the folder of the first argument; run by a Python that has bpy."""

import json
import math
import os
import sys
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[1])
WAY = [(-8, -30, 0), (-8, -10, 0), (-7, 10, 0.5), (-4, 30, 1)]


def put(name, data, at=(0, 0, 0), parent=None, **properties):
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    made.location, made.parent = at, parent
    for key, value in properties.items():
        made[key] = value
    return made


def plane(name, width, length):
    corners = [(x * width / 2, y * length / 2, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    made = bpy.data.meshes.new(name)
    made.from_pydata(corners, [], [(0, 1, 2, 3)])
    return made


bpy.ops.wm.read_factory_settings(use_empty=True)
put("Floor", plane("a", 6, 4))
put("Surface.Table", plane("b", 1.2, 0.8), (1.5, 1.2, 0.75)).rotation_euler[2] = math.radians(20)
curve = bpy.data.curves.new("c", "CURVE")
curve.dimensions = "3D"
spline = curve.splines.new("POLY")
spline.points.add(len(WAY) - 1)
for point, place in zip(spline.points, WAY, strict=True):
    point.co = (*place, 1)
put("lane_north", curve, width=4.0)
line = bpy.data.meshes.new("d")
line.from_pydata(WAY, [(0, 1), (1, 2), (2, 3)], [])
put("Way", line, (20, 0, 0), viewsphere="lane")
ring = put("Lane_Loop.001", None, (5, 0, 0), closed=True)
for name, place in (("p10", (9, 9, 0)), ("p2", (9, -9, 0)), ("p1", (-9, -9, 0))):
    put(name, None, place, ring)
put("room", None, viewsphere="indoors")
bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "yard.blend"), check_existing=False)
bpy.ops.export_scene.gltf(filepath=str(FOLDER / "yard.glb"), export_extras=True, use_mesh_edges=True)
print(json.dumps(WAY), flush=True)
sys.stdout.flush()
os._exit(0)
