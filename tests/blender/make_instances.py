"""Makes the scene that `test_saved_blend` exports, in the folder of the first argument; run by a Python that has bpy.

`instances.blend` has a crate with an `id` of its own, leaves that a geometry nodes modifier and a particle system put on two
labelled bushes and that one leaf shows by itself, and `library/car.blend`'s collections, instanced and linked.
"""

import sys
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[-1])
BOX = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def anew():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def put(name, data, place=(0, 0, 0), scale=(1, 1, 1), into=None):
    made = bpy.data.objects.new(name, data)
    made.location, made.scale = place, scale
    (into or bpy.context.scene.collection).objects.link(made)
    return made


def box(name, *where, into=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(BOX, [], FACES)
    return put(name, mesh, *where, into=into)


def library():
    scene = anew()
    for number, x in ((41, 0.0), (42, 0.7)):
        cars = bpy.data.collections.new(f"Cars{number}")
        scene.collection.children.link(cars)
        box(f"Body{number}", (x, 0, 0), (0.5, 0.8, 0.4), into=cars).pass_index = number
    (FOLDER / "library").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "library" / "car.blend"))


def scattering(leaf):
    """A geometry nodes tree that puts the leaf on the points of a mesh, which itself stays."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = {name: tree.nodes.new(f"{kind}") for name, kind in (
        ("in", "NodeGroupInput"), ("out", "NodeGroupOutput"), ("leaf", "GeometryNodeObjectInfo"),
        ("on", "GeometryNodeInstanceOnPoints"), ("join", "GeometryNodeJoinGeometry"),
    )}  # fmt: skip
    nodes["leaf"].inputs["Object"].default_value = leaf
    nodes["leaf"].inputs["As Instance"].default_value = True
    for source, target in (
        (nodes["in"].outputs[0], nodes["on"].inputs["Points"]),
        (nodes["leaf"].outputs["Geometry"], nodes["on"].inputs["Instance"]),
        (nodes["on"].outputs[0], nodes["join"].inputs[0]),
        (nodes["in"].outputs[0], nodes["join"].inputs[0]),
        (nodes["join"].outputs[0], nodes["out"].inputs[0]),
    ):
        tree.links.new(source, target)
    return tree


def scene():
    scene = anew()
    scene.world = bpy.data.worlds.new("world")
    box("Floor", (0, 0, -1), (12, 12, 1))
    box("Crate", (-2.2, 0.5, 0), (0.7, 0.7, 0.7))["id"] = 77
    leaf = box("Leaf", (0, 0, 0), (0.15, 0.15, 0.15))
    leaf.location = (0.9, -1.2, 0)
    put("Bush", box("Bush", (-1, 1.5, 0.3), (0.9, 0.9, 0.9)).data)
    bpy.data.objects.remove(bpy.data.objects["Bush.001"])
    bpy.data.objects["Bush"].modifiers.new("scatter", "NODES").node_group = scattering(leaf)
    hedge = box("Hedge", (1.3, 1.8, 0.2), (0.8, 0.8, 0.8))
    hedge.modifiers.new("particles", "PARTICLE_SYSTEM")
    settings = hedge.particle_systems[0].settings
    settings.type, settings.count, settings.use_advanced_hair = "HAIR", 40, True
    settings.render_type, settings.instance_object, settings.particle_size = "OBJECT", leaf, 1.0
    with bpy.data.libraries.load(str(FOLDER / "library" / "car.blend"), link=True, relative=True) as (_, here):
        here.collections = ["Cars41", "Cars42"]
    empty = put("Car", None, (-0.3, -1.2, 0))
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Cars41"]
    scene.collection.children.link(bpy.data.collections["Cars42"])
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "instances.blend"))


library()
scene()
