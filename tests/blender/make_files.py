"""Makes the files that `test_formats` reads, in the folder of the first argument; run by a Python that has bpy."""

import json
import math
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

FOLDER = Path(sys.argv[1])
CORNER = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
"""A tetrahedron with edges of 1, 2 and 3 m along x, y and z."""


def anew():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def put(name, data, matrix=None, collection=None):
    made = bpy.data.objects.new(name, data)
    made.matrix_world = matrix or Matrix()
    if collection is None or collection.name != "nowhere":
        (collection or bpy.context.scene.collection).objects.link(made)
    return made


def mesh(name="corner", vertices=CORNER[0], faces=CORNER[1], material=None):
    made = bpy.data.meshes.new(name)
    made.from_pydata(vertices, [], faces)
    if material is not None:
        made.materials.append(material)
    return made


def grid(name="grid", material=None, uv=((0, 0), (1, 0), (1, 1), (0, 1))):
    made = mesh(name, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)], material)
    layer = made.uv_layers.new(name="first")
    layer.uv.foreach_set("vector", [x for pair in uv for x in pair])
    return made


def material(name, **values):
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    for key, value in values.items():
        made.node_tree.nodes["Principled BSDF"].inputs[key].default_value = value
    return made


def save(name):
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name), check_existing=False)


def at(x, y=0.0, z=0.0):
    return Matrix.Translation((x, y, z))


def picture(name, pixels, size=None, is_data=False):
    """An 8-bit picture of a file; pixels (H, W, 3 or 4), the first row on top."""
    pixels = np.asarray(pixels, float)
    height, width = pixels.shape[:2]
    made = bpy.data.images.new(name, width, height, alpha=pixels.shape[2] == 4)
    full = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)[..., :4]
    made.pixels.foreach_set(np.ascontiguousarray(full[::-1], np.float32).reshape(-1))
    made.filepath_raw = str(FOLDER / f"{name}.png")
    made.file_format = "PNG"
    made.save()
    bpy.data.images.remove(made)
    loaded = bpy.data.images.load(str(FOLDER / f"{name}.png"))
    if is_data:
        loaded.colorspace_settings.name = "Non-Color"
    return loaded


def node(made, kind, **values):
    found = made.node_tree.nodes.new(kind)
    for key, value in values.items():
        setattr(found, key, value)
    return found


def link(made, output, name):
    made.node_tree.links.new(output, made.node_tree.nodes["Principled BSDF"].inputs[name])


def exchange():
    """One tetrahedron and a mirrored one in every exchange format."""
    anew()
    red = material("red", **{"Base Color": (0.8, 0.1, 0.1, 1), "Roughness": 0.25, "Metallic": 1.0})
    put("corner", mesh(material=red))
    put("mirrored", mesh("other"), at(-2) @ Matrix.Diagonal((-1, 1, 1, 1)))
    bpy.ops.export_scene.fbx(filepath=str(FOLDER / "corner.fbx"))
    for suffix in ("usda", "usdc", "usdz"):
        bpy.ops.wm.usd_export(filepath=str(FOLDER / f"corner.{suffix}"))
    bpy.ops.wm.alembic_export(filepath=str(FOLDER / "corner.abc"), as_background_job=False)
    save("corner.blend")
    bpy.ops.export_scene.gltf(filepath=str(FOLDER / "draco.glb"), export_draco_mesh_compression_enable=True)


def sides():
    """A face of one side, and one of two, in a .blend file."""
    anew()
    for place, name in enumerate(("single", "double")):
        made = material(name)
        made.use_backface_culling = name == "single"
        put(name, grid(name, made), at(3 * place))
    save("sides.blend")


def evaluated():
    """What has to be evaluated, an object of each kind."""
    anew()
    scene = bpy.context.scene
    smooth = put("smooth", mesh("cube", [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], FACES))
    levels = smooth.modifiers.new("Subdivision", "SUBSURF")
    levels.levels, levels.render_levels = 0, 2
    put("hidden", mesh(), at(5)).hide_render = True
    put("not in the window", mesh(), at(10)).hide_viewport = True
    text = bpy.data.curves.new("text", "FONT")
    text.body = "I"
    put("text", text, at(15))
    tube = bpy.data.curves.new("tube", "CURVE")
    tube.dimensions, tube.bevel_depth = "3D", 0.1
    tube.splines.new("POLY").points.add(1)
    tube.splines[0].points[1].co = (0, 0, 2, 1)
    put("tube", tube, at(20))
    ball = bpy.data.metaballs.new("ball")
    ball.elements.new()
    put("ball", ball, at(25))
    keyed = put("keyed", mesh("keyed mesh"), at(30))
    keyed.shape_key_add(name="Basis")
    keyed.shape_key_add(name="tall").data[3].co = (0, 0, 6)
    keyed.data.shape_keys.key_blocks["tall"].value = 1.0
    moving = put("moving", mesh())
    for frame, x in ((3, 40.0), (9, 99.0)):
        moving.location.x = x
        moving.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 3, 9
    scene.frame_set(9)
    inner = bpy.data.collections.new("inner")
    put("part", mesh(), at(0), inner)
    for k, name in enumerate(("one", "two")):
        empty = put(name, None, at(50 + 5 * k))
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
    parent = put("parent", mesh(), at(60))
    child = put("child", mesh(), at(63))
    child.parent, child.matrix_parent_inverse = parent, parent.matrix_world.inverted()
    shelf = bpy.data.collections.new("shelf")
    scene.collection.children.link(shelf)
    put("on the shelf", mesh(), at(70), shelf)
    put("flat", mesh(), at(80) @ Matrix.Diagonal((1, 1, 0, 1)))
    put("nothing", mesh(), at(85) @ Matrix.Diagonal((0, 0, 0, 1)))
    scatter(put("scattered", grid("points"), at(90)))
    spare = put("spare", mesh(), at(0), type("Nowhere", (), {"name": "nowhere"}))
    spare.use_fake_user = True
    save("evaluated.blend")


FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def scatter(item):
    """Geometry nodes: a cube on each of its vertices, in a material of its own."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    names = (
        "NodeGroupInput",
        "GeometryNodeMeshCube",
        "GeometryNodeSetMaterial",
        "GeometryNodeInstanceOnPoints",
        "NodeGroupOutput",
    )
    start, cube, paint, spread, end = (tree.nodes.new(name) for name in names)
    cube.inputs["Size"].default_value = (0.1, 0.1, 0.1)
    paint.inputs["Material"].default_value = material("blue", **{"Base Color": (0.1, 0.1, 0.8, 1)})
    tree.links.new(cube.outputs["Mesh"], paint.inputs["Geometry"])
    tree.links.new(start.outputs[0], spread.inputs["Points"])
    tree.links.new(paint.outputs["Geometry"], spread.inputs["Instance"])
    tree.links.new(spread.outputs["Instances"], end.inputs[0])
    item.modifiers.new("scatter", "NODES").node_group = tree


def posed():
    """An armature whose bone lifts a vertex group, with an action and without."""
    for name in ("acting", "resting"):
        anew()
        bones = bpy.data.armatures.new("bones")
        armature = put("armature", bones)
        bpy.context.view_layer.objects.active = armature
        bpy.ops.object.mode_set(mode="EDIT")
        bones.edit_bones.new("bone").tail = (0, 0, 1)
        bpy.ops.object.mode_set(mode="OBJECT")
        body = put("body", mesh())
        body.vertex_groups.new(name="bone").add([0, 1, 2, 3], 1.0, "REPLACE")
        body.modifiers.new("Armature", "ARMATURE").object = armature
        if name == "acting":
            bone = armature.pose.bones["bone"]
            for frame, y in ((1, 5.0), (10, 0.0)):
                bone.location = (0, y, 0)
                bone.keyframe_insert("location", frame=frame)
        save(f"{name}.blend")
        bpy.ops.export_scene.fbx(filepath=str(FOLDER / f"{name}.fbx"))


def pointed():
    """Empties that are points: of a name, with a property, below one another; and one that is none."""
    anew()
    body = put("body", mesh())
    nose = put("keypoint:nose", None, at(0, 1, 0))
    eye = put("any name", None)
    eye["keypoint"], eye.parent, eye.location = "eye.L", nose, (0, 0, 2)
    other = put("eye.R", None)
    other["keypoint"], other.parent, other.location = True, nose, (1, 0, 2)
    put("no point", None, at(5)).parent = body
    save("pointed.blend")
    bpy.ops.export_scene.gltf(filepath=str(FOLDER / "pointed.glb"), export_extras=True)


def painted():
    """Materials, a grid each."""
    anew()
    rgb = picture("rgb", [[(1, 0, 0), (0, 1, 0)], [(0, 0, 1), (0.5, 0.5, 0.5)]])
    holed = picture("holed", [[(1, 1, 1, 1), (1, 1, 1, 0)], [(1, 1, 1, 0), (1, 1, 1, 1)]])
    data = picture("data", [[(0, 0.25, 0.5), (1, 1, 1)], [(0, 0, 0), (0.5, 0.75, 0.25)]], is_data=True)
    bumps = picture("bumps", [[(0.5, 0.5, 1), (0.8, 0.5, 0.9)]], is_data=True)
    made = {name: material(name) for name in NAMES}
    for k, (name, one) in enumerate(made.items()):
        put(name, grid(name, one), at(2 * k))
        if name not in ("plastic", "glass", "old", "procedural", "painted"):
            image = node(one, "ShaderNodeTexImage", image={"roughness": data, "normals": bumps, "holes": holed}.get(name, rgb))
            if name not in ("roughness", "normals"):
                link(one, image.outputs["Color"], "Base Color")
            globals()[f"_{name}"](one, image) if f"_{name}" in globals() else None
    for key, value in {"Coat Weight": 0.5, "IOR": 1.4, "Emission Color": (1, 0.5, 0, 1), "Emission Strength": 4.0}.items():
        made["plastic"].node_tree.nodes["Principled BSDF"].inputs[key].default_value = value
    made["plastic"].node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5
    made["glass"].node_tree.nodes["Principled BSDF"].inputs["Transmission Weight"].default_value = 1.0
    link(made["procedural"], node(made["procedural"], "ShaderNodeTexNoise").outputs["Color"], "Base Color")
    old = made["old"]
    mixed, diffuse, glossy = (node(old, f"ShaderNode{kind}") for kind in ("MixShader", "BsdfDiffuse", "BsdfAnisotropic"))
    diffuse.inputs["Color"].default_value, glossy.inputs["Roughness"].default_value = (0.1, 0.4, 0.2, 1), 0.3
    links = old.node_tree.links
    links.new(node(old, "ShaderNodeFresnel").outputs[0], mixed.inputs[0])
    links.new(diffuse.outputs[0], mixed.inputs[1])
    links.new(glossy.outputs[0], mixed.inputs[2])
    links.new(mixed.outputs[0], next(n for n in old.node_tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    color = bpy.data.objects["painted"].data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER")
    color.data.foreach_set("color", [0.2, 0.4, 0.6, 1] * 4)
    link(made["painted"], node(made["painted"], "ShaderNodeVertexColor", layer_name="paint").outputs[0], "Base Color")
    bare = put("bare", grid("bare"), at(-2))
    bare.data.color_attributes.new("paint", "FLOAT_COLOR", "POINT").data.foreach_set("color", [0.9, 0.1, 0.1, 1] * 4)
    save("painted.blend")


NAMES = (
    "picture", "tinted", "moved", "second", "roughness", "normals", "holes", "packed", "lost", "away",
    "plastic", "glass", "old", "procedural", "painted",
)  # fmt: skip


def _tinted(one, image):
    tint = node(one, "ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
    tint.inputs["Factor"].default_value = 1.0
    a, b = (next(s for s in tint.inputs if s.enabled and s.name == name) for name in "AB")
    one.node_tree.links.new(image.outputs["Color"], a)
    b.default_value = (0.5, 0.25, 1.0, 1)
    link(one, next(s for s in tint.outputs if s.enabled), "Base Color")


def _moved(one, image):
    mapping = node(one, "ShaderNodeMapping")
    mapping.inputs["Location"].default_value = (0.1, 0.2, 0)
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(30))
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    one.node_tree.links.new(node(one, "ShaderNodeTexCoord").outputs["UV"], mapping.inputs[0])
    one.node_tree.links.new(mapping.outputs[0], image.inputs[0])


def _second(one, image):
    layer = bpy.data.objects["second"].data.uv_layers.new(name="second")
    layer.uv.foreach_set("vector", [0.25] * 8)
    one.node_tree.links.new(node(one, "ShaderNodeUVMap", uv_map="second").outputs[0], image.inputs[0])


def _roughness(one, image):
    split = node(one, "ShaderNodeSeparateColor")
    one.node_tree.links.new(image.outputs["Color"], split.inputs[0])
    link(one, split.outputs[1], "Roughness")
    link(one, split.outputs[2], "Metallic")


def _normals(one, image):
    bumps = node(one, "ShaderNodeNormalMap")
    bumps.inputs["Strength"].default_value = 0.7
    one.node_tree.links.new(image.outputs["Color"], bumps.inputs["Color"])
    link(one, bumps.outputs[0], "Normal")


def _holes(one, image):
    link(one, image.outputs["Alpha"], "Alpha")


def _packed(_, image):
    packed = bpy.data.images.load(str(FOLDER / "rgb.png"), check_existing=False)
    packed.name = "packed picture"
    packed.pack()
    packed.filepath = "//gone.png"
    image.image = packed


def _lost(_, image):
    lost = bpy.data.images.load(str(FOLDER / "rgb.png"), check_existing=False)
    lost.filepath = "//lost.png"
    image.image = lost


def _away(_, image):
    away = bpy.data.images.load(str(FOLDER / "rgb.png"), check_existing=False)
    away.filepath = "//../away.png"
    image.image = away


def occluded():
    """Materials that hide light from crevices, as Blender's glTF importer puts it."""
    anew()
    shade = picture("shade", [[(0, 0.5, 1), (0.25, 1, 1)], [(0.5, 0, 0), (1, 0.5, 0)]], is_data=True)
    output = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
    output.interface.new_socket("Occlusion", socket_type="NodeSocketFloat")
    for k, name in enumerate(("crevices", "faint crevices", "turned crevices", "no crevices")):
        one = material(name)
        put(name, grid(name, one), at(2 * k))
        links, split = one.node_tree.links, node(one, "ShaderNodeSeparateColor")
        socket = node(one, "ShaderNodeGroup", node_tree=output).inputs["Occlusion"]
        links.new(node(one, "ShaderNodeTexImage", image=shade).outputs["Color"], split.inputs[0])
        red = split.outputs["Red"]
        if name == "faint crevices":
            fade = node(one, "ShaderNodeMix", data_type="RGBA")
            fade.inputs[0].default_value, fade.inputs[6].default_value = 0.4, (1, 1, 1, 1)
            links.new(red, fade.inputs[7])
            red = fade.outputs[2]
        if name == "turned crevices":
            turned = node(one, "ShaderNodeMath", operation="SUBTRACT")
            turned.inputs[0].default_value = 1.0
            links.new(red, turned.inputs[1])
            red = turned.outputs[0]
        if name != "no crevices":
            links.new(red, socket)
    save("occluded.blend")
    for name in ("turned crevices", "no crevices"):  # of which glTF has none
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.ops.export_scene.gltf(filepath=str(FOLDER / "occluded.glb"), export_draco_mesh_compression_enable=True)


def linked():
    """A file that links one beside it and one outside of its folder."""
    (FOLDER / "in").mkdir()
    for place in ("in/library.blend", "outside.blend"):
        anew()
        put("linked" if place.startswith("in") else "foreign", mesh())
        save(place)
    anew()
    put("own", mesh())
    for place, name in (("in/library.blend", "linked"), ("outside.blend", "foreign")):
        with bpy.data.libraries.load(str(FOLDER / place), link=True) as (_, wanted):
            wanted.objects = [name]
        bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "in/links.blend"), check_existing=False, relative_remap=True)


def bad():
    """Nothing to see; too much to see; a later Blender's."""
    anew()
    put("lamp", bpy.data.lights.new("lamp", "POINT"))
    save("empty.blend")
    anew()
    heavy = put("heavy", mesh("cube", [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], FACES))
    heavy.modifiers.new("Too Much", "SUBSURF").render_levels = 11
    save("heavy.blend")
    anew()
    many = put("many", grid("many"))
    for axis in range(3):
        array = many.modifiers.new("Array", "ARRAY")
        array.count, array.relative_offset_displace = 300, (float(axis == 0), float(axis == 1), float(axis == 2))
    save("many.blend")
    anew()
    tree = bpy.data.node_groups.new("flood", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.is_modifier = True
    large, end = tree.nodes.new("GeometryNodeMeshGrid"), tree.nodes.new("NodeGroupOutput")
    large.inputs["Vertices X"].default_value = large.inputs["Vertices Y"].default_value = 4_000
    tree.links.new(large.outputs["Mesh"], end.inputs[0])
    flood = put("flood", mesh()).modifiers.new("flood", "NODES")
    flood.show_viewport, flood.node_group = False, tree
    save("flood.blend")
    anew()
    put("corner", mesh())
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "later.blend"), check_existing=False, compress=False)


for make in (exchange, sides, evaluated, posed, pointed, painted, occluded, linked, bad):
    make()
print(json.dumps(sorted(file.name for file in FOLDER.iterdir())), flush=True)
sys.stdout.flush()
os._exit(0)  # Blender 4.5 hangs in its own way out
