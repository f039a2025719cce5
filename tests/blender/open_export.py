"""Opens an exported .blend as anybody would, with bpy and nothing of viewsphere, renders frames of it and says what is in it.

open_export.py FILE FOLDER {"index": [frames], "picture": [frames], "samples": n}
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy


def main(file: str, folder: str, wanted: dict) -> None:
    bpy.ops.wm.open_mainfile(filepath=file)
    scene = bpy.context.scene
    for number in wanted.get("picture", []):
        if "samples" in wanted:
            scene.cycles.samples = wanted["samples"]
        scene.frame_set(number)
        scene.render.filepath = str(Path(folder, f"picture{number}.png"))
        bpy.ops.render.render(write_still=True)
    said = content(scene)
    if wanted.get("index"):
        show_index(scene)
        for number in wanted["index"]:
            scene.frame_set(number)
            scene.render.filepath = str(Path(folder, f"index{number}.exr"))
            bpy.ops.render.render(write_still=True)
    Path(folder, "said.json").write_text(json.dumps(said))  # Blender may have the last word on the terminal


def show_index(scene) -> None:
    """One look through the middle of each pixel; the compositor shows the numbers of the objects."""
    scene.view_layers[0].use_pass_object_index = True
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces, cycles.use_denoising = 1, 0, False
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    if hasattr(scene, "compositing_node_group"):  # Blender 5
        tree = scene.compositing_node_group = bpy.data.node_groups.new("numbers", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        out = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        out = tree.nodes.new("CompositorNodeComposite")
    seen = tree.nodes.new("CompositorNodeRLayers").outputs
    tree.links.new(seen["Object Index" if "Object Index" in seen else "IndexOB"], out.inputs[0])


def content(scene) -> dict:
    """What a user finds."""
    camera = scene.camera
    cameras = []
    for number in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(number)
        cameras.append([list(row) for row in camera.matrix_world])
    return {
        "range": [scene.frame_start, scene.frame_end],
        "markers": {str(m.frame): m.name for m in scene.timeline_markers},
        "cameras": cameras,
        "lens": [camera.data.lens, camera.data.sensor_width, camera.data.shift_x, camera.data.shift_y],
        "size": [scene.render.resolution_x, scene.render.resolution_y],
        "chain": [camera.name, camera.parent.name, camera.parent.parent.name],
        "interpolations": sorted({p.interpolation for action in bpy.data.actions for p in keys(action)}),
        "objects": {o.name: {"index": o.pass_index, **properties(o)} for o in scene.objects if o.type == "MESH"},
        "lights": [o.data.type for o in scene.objects if o.type == "LIGHT"],
        "collections": {c.name: sorted(o.name for o in c.objects) for c in scene.collection.children},
        "world": scene.world is not None,
        "unpacked": sorted(i.name for i in bpy.data.images if i.source == "FILE" and not i.packed_files),
        "paths": sorted({i.filepath for i in bpy.data.images} | {scene.render.filepath}),
        "properties": properties(scene),
        "text": [t.as_string() for t in bpy.data.texts],
    }


def keys(action):
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                for curve in bag.fcurves:
                    yield from curve.keyframe_points


def properties(owner) -> dict:
    return {
        name: value.to_dict() if hasattr(value, "to_dict") else list(value) if hasattr(value, "to_list") else value
        for name, value in owner.items()
        if name != "cycles"
    }


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], json.loads(sys.argv[3]))
