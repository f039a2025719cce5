"""Makes the scenes that `test_scene_blend` renders, in the folder of the first argument; run by a Python that has bpy."""

import json
import math
import os
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

FOLDER = Path(sys.argv[1])
FOLDER.mkdir(exist_ok=True)
BOX = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def at(x=0.0, y=0.0, z=0.0, turn=0.0, scale=(1, 1, 1)):
    return Matrix.Translation((x, y, z)) @ Matrix.Rotation(math.radians(turn), 4, "Z") @ Matrix.Diagonal((*scale, 1))


def material(name, color, strength=0.0):
    made = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Emission Color"].default_value = (*color, 1)
    shader.inputs["Emission Strength"].default_value = strength
    return made


def box(name, matrix, color=(0.5, 0.5, 0.5), parent=None, collection=None, index=0):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(BOX, [], FACES)
    mesh.materials.append(material(f"paint {color}", color))
    return put(name, mesh, matrix, parent, collection, index)


def put(name, data, matrix, parent=None, collection=None, index=0):
    made = bpy.data.objects.new(name, data)
    made.parent = parent
    made.matrix_world = matrix
    made.pass_index = index
    (collection or bpy.context.scene.collection).objects.link(made)
    return made


def collection(name, parent=None):
    made = bpy.data.collections.new(name)
    (parent or bpy.context.scene.collection).children.link(made)
    return made


def anew(unit=None):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if unit is not None:
        bpy.context.scene.unit_settings.scale_length = unit


def save(name):
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name), check_existing=False)


def world(color):
    made = bpy.data.worlds.new("world")
    if made.node_tree is None:
        made.use_nodes = True
    made.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1)
    bpy.context.scene.world = made


def lamp(place, energy, unit):
    data = bpy.data.lights.new("lamp", "POINT")
    data.energy = energy
    put("lamp", data, at(*(v / unit for v in place)))


def street(name, unit, turn=0.0, moved=(0, 0, 0)):
    """A street, the same in metres whatever the file's unit, turned and moved together with its spot."""
    anew(unit)
    world((0.2, 0.3, 0.6))
    scene = bpy.context.scene
    m = at(*(v / unit for v in moved), turn) @ Matrix.Diagonal((1 / unit,) * 3 + (1,))
    box("Road", m @ at(0, 0, -1, 0, (30, 30, 1)), (0.25, 0.25, 0.25))
    car = box("Car.001", m @ at(-2, 1, 0, 30, (1, 2, 0.8)), (0.8, 0.1, 0.1), index=11)
    box("Cabin", m @ at(-2, 1, 0.8, 30, (0.8, 1, 0.5)), (0.8, 0.5, 0.1), parent=car, index=11)
    box("Aerial", m @ at(-2, 1, 1.3, 30, (0.1, 0.1, 0.6)), (0.1, 0.1, 0.1), parent=car, index=13)["class"] = "aerial"
    trees = collection("Trees")
    box("Oak", m @ at(2, 1.5, 0, 10, (0.5, 0.5, 2)), (0.1, 0.5, 0.1), collection=collection("Old", trees), index=12)
    box("Wall", m @ at(0, 3, 0, 0, (6, 0.2, 1.5)), (0.7, 0.7, 0.7))
    for i, color in enumerate([(1, 0, 0), (0, 1, 0), (0, 0, 1)]):
        plane = box(f"plane{i}", m @ at(0, 2.7, 0.2, 0, (1.6, 0.02, 1.2)), color)
        plane.hide_render = i > 0
        box(f"frame{i}", m @ at(0, 2.75, 0.1, 0, (1.9, 0.02, 1.4)), (0.1, 0.1, 0.1), parent=plane).hide_render = i > 0
    put("Spot", None, m @ at(0.3, -0.2, 0, 20) @ Matrix.Diagonal((unit,) * 3 + (1,)))
    data = bpy.data.lights.new("sun", "SUN")
    data.energy = 3.0
    sun = put("sun", data, at(0, 0, 0, turn) @ Matrix.Rotation(math.radians(40), 4, "X"))
    sun.location = (0, 0, 5 / unit)
    scene.render.resolution_percentage = 50
    save(name)


def composed():
    """A lit box, whose picture the compositor turns into red, and which would write a file."""
    anew()
    world((1, 1, 1))
    box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
    tree, output = compositor()
    layers = tree.nodes.new("CompositorNodeRLayers")
    split = tree.nodes.new("CompositorNodeSeparateColor")
    tree.links.new(layers.outputs["Image"], split.inputs[0])
    made = tree.nodes.new("CompositorNodeCombineColor")
    tree.links.new(split.outputs[0], made.inputs[0])
    file = tree.nodes.new("CompositorNodeOutputFile")
    folder = str(FOLDER / "written") + "/"
    if hasattr(file, "directory"):
        file.directory = folder
        file.file_output_items.new("RGBA", "Image")
    else:
        file.base_path = folder
    tree.links.new(layers.outputs["Image"], file.inputs[0])
    save("no_output.blend")
    tree.links.new(made.outputs[0], output.inputs[0])
    save("composed.blend")


def layerless():
    """Compositors for which Blender renders nothing: without nodes, of one colour, of muted layers."""
    for name in ("none", "flat", "muted"):
        anew()
        world((1, 1, 1))
        box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
        tree, output = compositor()
        if name == "none":
            tree.nodes.clear()
        else:
            node = tree.nodes.new("CompositorNodeRGB" if name == "flat" else "CompositorNodeRLayers")
            node.mute = name == "muted"
            tree.links.new(node.outputs[0], output.inputs[0])
        save(f"layers_{name}.blend")


def foggy():
    """A compositor that shows how far things are, by a pass that it asks for."""
    anew()
    world((1, 1, 1))
    box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
    bpy.context.view_layer.use_pass_z = True
    tree, output = compositor()
    layers = tree.nodes.new("CompositorNodeRLayers")
    made = tree.nodes.new("CompositorNodeCombineColor")
    tree.links.new(layers.outputs["Depth"], made.inputs[0])
    tree.links.new(made.outputs[0], output.inputs[0])
    save("foggy.blend")


def compositor():
    scene = bpy.context.scene
    if hasattr(scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("compositor", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        return tree, tree.nodes.new("NodeGroupOutput")
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new("CompositorNodeComposite")


def dark():
    """Neither light nor world nor camera."""
    anew()
    box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
    save("dark.blend")


def moving():
    """A car that drives and turns, a lamp post that stays."""
    anew()
    world((1, 1, 1))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 21, 10
    box("Floor", at(0, 0, -1, 0, (20, 20, 1)))
    car = box("Car", at(-2, 2, 0, 0, (1, 2, 0.8)), (0.8, 0.1, 0.1), index=11)
    box("Cabin", at(-2, 2, 0.8, 0, (0.8, 1, 0.5)), (0.8, 0.5, 0.1), parent=car, index=11)
    box("Post", at(1.5, 2, 0, 0, (0.2, 0.2, 2)), index=12)
    for frame, x, turn in ((1, -2, 0), (21, 2, 90)):
        car.location.x, car.rotation_euler.z = x, math.radians(turn)
        for name in ("location", "rotation_euler"):
            car.keyframe_insert(name, frame=frame)
    for curve in _curves(car):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    save("moving.blend")


def appearing():
    """What appears and what vanishes; a group of which the file itself shows one after another; names with slashes."""
    anew()
    world((1, 1, 1))
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 9
    box("Oak", at(-1.5, 1.5, 0), index=12)
    box("Oak/Floor", at(0, 0, -1, 0, (20, 20, 1)))
    for name, x, hidden, index in (("Late", -2.8, (1, 0), 11), ("Early", 2.5, (0, 1), 11)):
        _shown_by_time(box(name, at(x, 1.5), index=index), hidden)
    for i, hidden in enumerate(((0, 1), (1, 0))):
        _shown_by_time(box(f"plane{i}", at(i, 2.5, 0), index=13), hidden)
    save("appearing.blend")


def linking():
    """The same objects, of that file as a library."""
    anew()
    world((1, 1, 1))
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 9
    with bpy.data.libraries.load(str(FOLDER / "appearing.blend"), link=True) as (there, here):
        here.objects = there.objects
    for one in here.objects:
        bpy.context.scene.collection.objects.link(one)
    save("linking.blend")


def _shown_by_time(one, hidden):
    for frame, value in zip((1, 5), hidden, strict=True):
        one.hide_render = bool(value)
        one.keyframe_insert("hide_render", frame=frame)


def _curves(one):
    action = one.animation_data.action
    return action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves


def scripted():
    """What would run Python, and a node that no Blender knows."""
    anew()
    world((1, 1, 1))
    box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
    driver = box("Moving", at(3)).driver_add("location", 2).driver
    driver.type, driver.expression = "SCRIPTED", "open('/nowhere') or 1"
    text = bpy.data.texts.new("startup.py")
    text.use_module = True
    save("scripted.blend")


def foreign():
    """A node and a render engine of add-ons, a picture and a library elsewhere, hair."""
    elsewhere = FOLDER / "elsewhere"
    elsewhere.mkdir(exist_ok=True)
    anew()
    box("Far", at(1, 0, 0), (0, 1, 0))
    save("elsewhere/library.blend")
    bpy.data.images.new("paint", 4, 4).save(filepath=str(elsewhere / "paint.png"))
    (FOLDER / "apart").mkdir(exist_ok=True)
    anew()
    world((1, 1, 1))
    floor = box("Floor", at(0, 0, -1, 0, (10, 10, 1)))
    tree = floor.data.materials[0].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(str(elsewhere / "paint.png"))
    tree.links.new(texture.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])

    class Stranger(bpy.types.Node):
        bl_idname = "STRANGER_Node"
        bl_label = "Stranger"

    bpy.utils.register_class(Stranger)
    tree.nodes.new("STRANGER_Node")
    with bpy.data.libraries.load(str(elsewhere / "library.blend"), link=True) as (there, here):
        here.objects = there.objects
    bpy.context.scene.collection.objects.link(here.objects[0])
    put("Hair", bpy.data.hair_curves.new("hair"), at())
    save("apart/foreign.blend")


def grown():
    """A bush of particle hair, one whose hair no render shows, and ground that its material displaces, or bumps."""
    anew()
    world((1, 1, 1))
    for x, name in ((-1, "Bush"), (1, "Bald")):
        modifier = box(name, at(x, 1.5, 0.3)).modifiers.new("hair", "PARTICLE_SYSTEM")
        modifier.particle_system.settings.type = "HAIR"
        modifier.particle_system.settings.count = 200
        modifier.show_render = name == "Bush"
    for x, method, color in ((0, "DISPLACEMENT", (0.3, 0.3, 0.3)), (12, "BUMP", (0.4, 0.4, 0.4))):
        made = box(f"Floor{x}", at(x, 0, -1, 0, (10, 10, 1)), color).data.materials[0]
        made.name, made.displacement_method = method.lower(), method
        height = made.node_tree.nodes.new("ShaderNodeDisplacement")
        output = next(node for node in made.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
        made.node_tree.links.new(height.outputs[0], output.inputs["Displacement"])
    save("grown.blend")


grown()
street("street.blend", 1.0)
street("feet.blend", 0.3048, turn=35.0, moved=(40, -25, 3))
composed()
layerless()
dark()
foggy()
moving()
appearing()
linking()
scripted()
foreign()
(FOLDER / "made.json").write_text(json.dumps({"version": bpy.app.version_string}))
os._exit(0)  # Blender 4.5 hangs in its own way out
