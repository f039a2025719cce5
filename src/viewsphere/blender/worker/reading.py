"""Reads model files through Blender into plain arrays and expressions, for `viewsphere.assets.readers.blender.reading`.

A frame is evaluated by rendering it with a render engine that paints nothing and only collects the evaluated objects: so
modifiers, particles and visibility have their settings for renders, not those for the viewport.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from .evaluated import Gathering, listed
from .marks import Marks
from .opening import choose, open_file
from .pictures import Pictures
from .playing import clips, go_to, timeline
from .points import Points
from .scene_file import reveal
from .weight import check_weight


def read(told):
    """Open `told["file"]`, of a `told["kind"]`, and write its arrays at a frame to `told["folder"]`.

    `inside` selects a part of a .blend file: `["Object", name]` or `["Collection", name]`, or nothing for the whole file;
    `shown` names objects that count although renders do not show them. Files that the model names must lie below `root`,
    None for anywhere; `most` is the largest number of triangles allowed. `frame` None is the first one; `after` is the frame
    of the previous answer if the file is still open, else None.
    Raises ValueError in one line for what cannot be read.
    """
    if told.get("after") is None:
        unit, warnings = open_file(told["file"], told["kind"], told["root"], clip=told.get("clip"), fps=told.get("fps"))
        prepare(bpy.context.scene)
        reveal(bpy.context.scene, told.get("shown", ()))
    else:
        unit, warnings = 1.0, []
    scene = bpy.context.scene
    wanted = choose(scene, told["inside"])
    check_weight(scene, wanted, told["most"])
    frame = scene.frame_start if told.get("frame") is None else told["frame"]
    go_to(scene, frame, told.get("after"))
    pictures = Pictures(told["folder"], told["root"])
    gathering = Gathering(told["folder"], pictures, wanted, told["most"])
    points = Points(wanted)
    marks = Marks(wanted)
    evaluate(scene, gathering, points, marks)
    return {
        "frame": frame,
        "unit": unit,
        "pieces": gathering.pieces,
        "placed": gathering.placed,
        "materials": gathering.materials,
        "images": pictures.told,
        "points": points.found,
        "marks": marks.found,
        "opened": warnings,
        "warnings": gathering.warnings + _choices(told),
        "files": [str(Path(file).resolve()) for file in bpy.utils.blend_paths(absolute=True)],
    }


def _choices(told):
    """A warning where a file has several animations and nobody chose one."""
    names = clips()
    if told["kind"] == "blend" or told.get("frame") is None or told.get("clip") is not None or len(names) < 2:
        return []
    return [f"has {len(names)} animations, of which the first is played: choose one by clip: {listed(names)}"]


def evaluate(scene, *takers):
    """Give the scene as it is rendered to `takers`, whose `take` is called with the depsgraph."""
    failed = []

    class Taker(bpy.types.RenderEngine):
        bl_idname = "VIEWSPHERE_TAKER"
        bl_label = "viewsphere"

        def render(self, depsgraph):
            try:
                for taker in takers:
                    taker.take(depsgraph)
            except Exception as error:
                failed.append(error)

    render = scene.render
    engine, is_composited = render.engine, render.use_compositing
    bpy.utils.register_class(Taker)
    render.engine, render.use_compositing = Taker.bl_idname, False
    try:
        bpy.ops.render.render(layer=bpy.context.view_layer.name)
    finally:
        render.engine, render.use_compositing = engine, is_composited
        bpy.utils.unregister_class(Taker)
    if failed:
        raise failed[0]


def read_timeline(told):
    """The file's first and last frame, rate and animations; the file is opened, but not evaluated."""
    _, warnings = open_file(told["file"], told["kind"], told["root"], clip=told["clip"], fps=told["fps"])
    files = [str(Path(file).resolve()) for file in bpy.utils.blend_paths(absolute=True)]
    return {**timeline(bpy.context.scene), "warnings": warnings, "files": files}


def prepare(scene):
    """Set up a render of a few pixels by a camera of our own, without compositing or sequencing."""
    render = scene.render
    render.resolution_x = render.resolution_y = 8
    render.resolution_percentage = 100
    render.use_border = render.use_multiview = render.use_freestyle = render.use_motion_blur = False
    render.use_compositing = render.use_sequencer = False
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)
