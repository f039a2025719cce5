"""Reads model files through Blender into plain arrays and expressions, for `viewsphere.assets.readers.blender.reading`.

To evaluate a frame, Blender renders it with a render engine that paints nothing and collects the evaluated objects.
Modifiers, particles and visibility then have their render settings, not their viewport settings.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from .evaluated import Gathering, listed, part_of
from .opening import choose, open_file
from .pictures import Pictures
from .playing import clips, go_to, timeline
from .scene_file import reveal
from .weight import check_weight

PREFIX = "keypoint:"
"""Prefix of the name of an object that marks a point; the rest is the point's name."""

POINT_PROPERTY = "keypoint"
"""The custom property that makes an object a point: the point's name, or true to use the object's name."""


PROPERTY = "viewsphere"
"""The custom property with an object's annotation; `width` and `closed` beside it describe a lane."""

LANE = "lane"
LINES = ("CURVE", "MESH")


def read(told):
    """Open `told["file"]`, of a `told["kind"]`, and write its arrays at a frame to `told["folder"]`.

    `inside` selects a part of a .blend file: `["Object", name]`, `["Collection", name]`, or nothing for the whole file.
    `shown` names objects that count although renders do not show them. Files that the model names must be below `root`;
    None: anywhere. `most` is the largest number of triangles allowed. `frame` None is the first frame. `after` is the frame
    of the previous answer if the file is still open, else None.
    Raises ValueError with one line for unreadable files.
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
    points = _Points(wanted)
    marks = _Marks(wanted)
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
    """A warning if a file has several animations and none was chosen."""
    names = clips()
    if told["kind"] == "blend" or told.get("frame") is None or told.get("clip") is not None or len(names) < 2:
        return []
    return [f"has {len(names)} animations, of which the first is played: choose one by clip: {listed(names)}"]


def evaluate(scene, *takers):
    """Pass the rendered scene to `takers`: the `take` of each is called with the depsgraph."""
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
    """Set up a render of a few pixels by a separate camera, without compositing or sequencing."""
    render = scene.render
    render.resolution_x = render.resolution_y = 8
    render.resolution_percentage = 100
    render.use_border = render.use_multiview = render.use_freestyle = render.use_motion_blur = False
    render.use_compositing = render.use_sequencer = False
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)


class _Marks:
    """Collects the objects that have the property or a lane's name. `found` lists them in the order of their names."""

    def __init__(self, wanted):
        self.found, self._wanted = [], wanted

    def take(self, depsgraph):
        """Collect all requested objects of a depsgraph that have the property or a lane's name."""
        there = sorted(depsgraph.objects, key=lambda one: one.name)
        below = {}
        for one in there:
            if one.parent is not None:
                below.setdefault(one.parent.name, []).append(one)
        for one in there:
            is_wanted = self._wanted is None or one.original.as_pointer() in self._wanted
            if is_wanted and (one.get(PROPERTY) is not None or one.name.lower().startswith(LANE)):
                self.found.append(_told(one, below.get(one.name, [])))


def _told(one, children):
    points, edges, has_faces = _lines(one)
    return {
        "name": one.name,
        "said": {name: _plain(one[name]) for name in (PROPERTY, "width", "closed") if name in one},
        "part": part_of(one, one) if has_faces else "",
        "points": points,
        "edges": edges,
        "children": [[c.name, list(c.matrix_world.translation)] for c in children if c.type == "EMPTY"],
        "is_group": bool(children),
    }


def _lines(one):
    """Points in the world, the edges between them, and whether there are faces; with faces the first two are empty."""
    if one.type not in LINES:
        return [], [], False
    mesh = one.to_mesh()
    try:
        if mesh is None or len(mesh.polygons):
            return [], [], mesh is not None
        points = [list(one.matrix_world @ vertex.co) for vertex in mesh.vertices]
        return points, [list(edge.vertices) for edge in mesh.edges], False
    finally:
        one.to_mesh_clear()


def _plain(value):
    return value if isinstance(value, (bool, int, float, str)) else str(value)


class _Points:
    """Collects the points of rendered objects: `found` has the name, the position and the parent's number of each point."""

    def __init__(self, wanted):
        self.found, self._wanted = [], wanted

    def take(self, depsgraph):
        """Collect all points of a depsgraph: requested objects, in the order of their names, else bones."""
        there = sorted(depsgraph.objects, key=lambda one: one.name)
        said = {one.name: name for one in there if self._is_wanted(one) and (name := _said(one))}
        self._tell([(one, said[one.name], one.matrix_world.translation) for one in there if one.name in said])
        if not said:
            for rig in self._rigs(there):
                bones = [bone for bone in rig.pose.bones if bone.bone.use_deform]
                self._tell([(bone, bone.name, rig.matrix_world @ bone.head) for bone in bones])

    def _is_wanted(self, one):
        return self._wanted is None or one.original.as_pointer() in self._wanted

    def _rigs(self, there):
        """Armatures that bend requested objects."""
        bent = [one for one in there if self._is_wanted(one) and one.type != "ARMATURE"]
        used = {m.object.name for one in bent for m in one.modifiers if m.type == "ARMATURE" and m.object is not None}
        return [one for one in there if one.type == "ARMATURE" and one.name in used]

    def _tell(self, owners):
        numbers = {one.name: len(self.found) + i for i, (one, _, _) in enumerate(owners)}
        for one, name, place in owners:
            above = one.parent
            while above is not None and above.name not in numbers:
                above = above.parent
            number = None if above is None else numbers[above.name]
            self.found.append({"name": name, "place": list(place), "above": number})


def _said(one):
    """The name of the point that an object marks; empty for other objects."""
    said = one.get(POINT_PROPERTY)
    if said and not isinstance(said, str):
        return one.name.removeprefix(PREFIX)
    return said or (one.name.removeprefix(PREFIX) if one.name.startswith(PREFIX) else "")
