"""Lists the names in a .blend file that a recipe can use: its objects, their parts and collections, and whether the scene is
lit.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path

import bpy
import numpy as np

from ..rendering.compositing import fault
from .evaluated import LEFT_OUT, STRANDS, has_seen_triangles, listed, part_of, strands
from .opening import is_within, open_file
from .playing import go_to
from .reading import evaluate, prepare
from .scene_file import reveal
from .weight import check_weight

PICTURES = ("FILE", "SEQUENCE", "TILED", "MOVIE")


def contents(told):
    """Answer the request of `viewsphere.assets.scene_file`. It names `file`, its `root`, ascending `frames` besides the
    first, patterns of objects that are `shown` although the file hides them, and the `most` triangles allowed.
    """
    unit, warnings = open_file(told["file"], "blend", told["root"])
    scene = bpy.context.scene
    patterns = told["shown"]
    groups = [one for one in bpy.data.objects if any(fnmatchcase(one.name, pattern) for pattern in patterns)]
    reveal(scene, [one.name for one in groups])
    seeing, after = _Seeing(), None
    objects, faults = _all(scene, groups), fault(scene)
    prepare(scene)
    for frame in sorted({scene.frame_start, *told["frames"]}):
        go_to(scene, frame, after)
        check_weight(scene, None, told["most"])
        seeing.frame = after = frame
        evaluate(scene, seeing)
    return {
        "unit": unit,
        "objects": [_object(one, seeing) for one in objects],
        "showing": [[frame, sorted(names)] for frame, names in seeing.showing.items()],
        "first": scene.frame_start,
        "is_lit": seeing.lamps > 0 or _shines(scene.world) or any(map(_shines, bpy.data.materials)),
        "warnings": [*warnings, *seeing.warnings(), *_pictures(told["root"]), *faults],
    }


def places(told):
    """Position and rotation of the objects of these `names` at each of the ascending `frames`, in the file's units."""
    unit, _ = open_file(told["file"], "blend", told["root"])
    scene, after, found = bpy.context.scene, None, []
    objects = [bpy.data.objects[name] for name in told["names"]]
    for one in objects:
        one.hide_viewport = False  # Blender evaluates no object that is hidden in viewports
    for frame in told["frames"]:
        go_to(scene, frame, after)
        graph, after = bpy.context.evaluated_depsgraph_get(), frame
        found.append([_standing(one.evaluated_get(graph).matrix_world) for one in objects])
    return {"unit": unit, "places": found}


def _standing(matrix):
    place, turn, _ = matrix.decompose()
    return list(place), list(turn)


class _Seeing:
    """Collects what a render would show: each object's part names, its first pose, and which objects show at each `frame`."""

    def __init__(self):
        self.parts, self.matrices, self.lamps, self._left_out = {}, {}, 0, {}
        self.frame, self.showing = None, {}
        self._displacing = set()

    def take(self, depsgraph):
        showing = self.showing.setdefault(self.frame, set())
        for one in depsgraph.objects:
            self.matrices.setdefault(one.name, one.matrix_world.copy())
        for instance in depsgraph.object_instances:
            item = instance.object
            owner = instance.parent if instance.is_instance else item
            if not instance.show_self:
                continue
            if strands(item):
                self._left_out.setdefault(STRANDS, []).append(item.name)
            self._displacing |= {slot.material.name for slot in item.material_slots if displaces(slot.material)}
            if item.type == "LIGHT":
                self.lamps += 1
            elif item.type in LEFT_OUT:
                self._left_out.setdefault(LEFT_OUT[item.type], []).append(item.name)
            elif has_seen_triangles(instance, item) and _has_area(item, instance.matrix_world):
                self.parts.setdefault(owner.name, {})[part_of(item, owner)] = None
                showing.add(owner.name)

    def warnings(self):
        """Warnings about rendered things that have no triangles, and so no labels."""
        said = [
            f"{what} is rendered, but no label knows of it: {listed(names)}; convert it to a mesh"
            for what, names in self._left_out.items()
        ]
        if self._displacing:
            said.append(
                f"displacement by materials is rendered, but no label knows of it: {listed(self._displacing)}; use the "
                "modifier Displace, or set them to bump only"
            )
        return said


def displaces(material):
    """Return whether a material moves the surface that it is on."""
    if material is None or material.node_tree is None or material.displacement_method not in ("DISPLACEMENT", "BOTH"):
        return False
    outputs = (node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    return any(node.is_active_output and node.inputs["Displacement"].is_linked for node in outputs)


def _has_area(item, matrix):
    """Return whether the item, placed by this matrix, has a triangle whose area is not zero."""
    mesh = item.to_mesh() if item.type == "META" else item.data
    try:
        if mesh is None or not len(mesh.loop_triangles):
            return False
        places = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", places)
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        linear = np.array(matrix)[:3, :3]
        a, b, c = np.moveaxis((places.reshape(-1, 3).astype(float) @ linear.T)[corners.reshape(-1, 3)], 1, 0)
        return bool(np.abs(np.cross(b - a, c - a)).max() > 0)
    finally:
        if item.type == "META":
            item.to_mesh_clear()


def _all(scene, groups):
    """Each object of the scene once, by its name."""
    found = {one.name: one for one in (*scene.objects, *groups)}
    return [found[name] for name in sorted(found)]


def _object(one, seeing):
    place, turn = _standing(seeing.matrices.get(one.name, one.matrix_world))
    return {
        "name": one.name,
        "kind": one.type,
        "parent": one.parent.name if one.parent else None,
        "collections": sorted(_collections(one) - {bpy.context.scene.collection.name}),
        "properties": {key: value for key, value in one.items() if isinstance(value, (str, int, float, bool))},
        "place": place,
        "turn": turn,
        "parts": list(seeing.parts.get(one.name, ())),
    }


def _collections(one):
    """Names of the collections that hold the object or that it instances, and of all collections that contain these."""
    found = {collection.name for collection in one.users_collection}
    if one.instance_collection is not None:
        found.add(one.instance_collection.name)
    return found | {outer.name for outer in bpy.data.collections if found & {c.name for c in outer.children_recursive}}


def _shines(owner):
    """Return whether a world or a material gives light, as far as this can be seen without rendering."""
    if owner is None or (isinstance(owner, bpy.types.Material) and not owner.users):
        return False
    tree = owner.node_tree if getattr(owner, "use_nodes", True) else None
    if tree is None:
        return isinstance(owner, bpy.types.World) and any(owner.color)
    kinds = {"BACKGROUND": "Strength", "EMISSION": "Strength", "BSDF_PRINCIPLED": "Emission Strength"}
    return any(
        node.inputs[kinds[node.type]].is_linked or (node.inputs[kinds[node.type]].default_value > 0 and _is_coloured(node))
        for node in tree.nodes
        if node.type in kinds and node.outputs[0].is_linked
    )


def _is_coloured(node):
    socket = node.inputs["Emission Color" if node.type == "BSDF_PRINCIPLED" else "Color"]
    return socket.is_linked or any(socket.default_value[:3])


def _pictures(root):
    """Warnings about pictures that cannot be read, which Blender shows as magenta."""
    lost = {"does not exist": [], "is outside the scene's folder, not read; set confined: false to allow": []}
    missing, outside = lost
    for image in bpy.data.images:
        if image.source not in PICTURES or image.packed_file or not image.users or not image.filepath:
            continue
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        if root is not None and not is_within(path, root):
            lost[outside].append(image.name)
        elif image.source == "FILE" and not path.is_file():
            lost[missing].append(image.name)
    return [f"picture {listed(names)} {what}" for what, names in lost.items() if names]
