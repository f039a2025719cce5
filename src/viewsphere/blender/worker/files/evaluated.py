"""Blender's evaluated objects as arrays of triangles."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from .nodes import Reader

SOLID = ("MESH", "META")
"""Types of objects that have triangles; text, curves and surfaces become meshes when they are evaluated."""

LEFT_OUT = {"CURVES": "hair", "POINTCLOUD": "points", "VOLUME": "a volume", "GREASEPENCIL": "grease pencil"}
STRANDS = "particle hair"
NAMES_SAID = 5
"""Largest number of names in a message, which is one line."""

OWN_SLASH = "\u2215"
"""Replacement for a slash in an object's name."""


class Gathering:
    """Collects the triangles of all objects that a render would show.

    `pieces` are triangles of one material, with files of arrays: positions, triangles, normals, uv0, uv1 and colors, the
    last three None if absent; `uvs` names the two layers. A piece that an armature bends has `skin`, names of bones, and
    files of each vertex's `bones` and `weights`. `placed` lists the matrix of each placed piece, and its part.
    """

    def __init__(self, folder, pictures, wanted, most):
        self.pieces, self.placed, self.materials, self.warnings = [], [], [], []
        self._folder, self._pictures, self._wanted, self._most = folder, pictures, wanted, most
        self._count = 0
        self._meshes = {}  # of meshes that are placed more than once: numbers of their pieces, and their triangle counts
        self._known = {}  # numbers of materials by their addresses

    def take(self, depsgraph):
        """Collect all objects that a render of this depsgraph would show, in the order of their names."""
        for material in bpy.data.materials:
            self._known[material.as_pointer()] = len(self.materials)
            self.materials.append(Reader(self._pictures).read(material))
        left_out, skipped = {}, []
        for instance in depsgraph.object_instances:
            item = instance.object
            owner = instance.parent if instance.is_instance else item
            if not instance.show_self or (self._wanted is not None and owner.original.as_pointer() not in self._wanted):
                continue
            if strands(item):
                left_out.setdefault(STRANDS, []).append(item.name)
            if item.type in LEFT_OUT:
                left_out.setdefault(LEFT_OUT[item.type], []).append(item.name)
            elif has_seen_triangles(instance, item):
                self._place(instance, item, owner)
            elif item.type in SOLID:
                skipped.append(item.name)
        for what, names in left_out.items():
            self.warnings.append(f"{what} is left out: {listed(names)}; convert it to a mesh")
        if skipped:
            self.warnings.append(f"not seen by cameras, left out: {listed(skipped)}")
        self._sort()

    def _sort(self):
        """Sort the placed pieces by their part, and number pieces by their first use."""
        self.placed.sort(key=lambda placed: placed["part"])
        order = dict.fromkeys(number for placed in self.placed for number in placed["pieces"])
        rank = {number: k for k, number in enumerate(order)}
        self.pieces = [self.pieces[number] for number in order]
        for placed in self.placed:
            placed["pieces"] = [rank[number] for number in placed["pieces"]]

    def _place(self, instance, item, owner):
        pieces, count = self._mesh(item)
        self._count += count
        if self._count > self._most:
            raise ValueError(f"expected at most {self._most:,} triangles, found more as evaluated (in {item.name!r})")
        if pieces:
            matrix = [list(row) for row in instance.matrix_world]
            self.placed.append({"pieces": list(pieces), "part": part_of(item, owner), "matrix": matrix})

    def _mesh(self, item):
        """The numbers of an object's pieces, and their number of triangles."""
        slots = [slot.material for slot in item.material_slots]
        key = None if item.type == "META" else (item.data.as_pointer(), *(m and m.as_pointer() for m in slots))
        if key is not None and key in self._meshes:
            return self._meshes[key]
        mesh = item.to_mesh() if item.type == "META" else item.data
        if mesh is None:
            return [], 0
        try:
            triangles = len(mesh.loop_triangles)
            if self._count + triangles > self._most:
                return [], triangles
            found = self._cut(mesh, slots or list(mesh.materials), _skin_of(item, mesh)), triangles
        finally:
            if item.type == "META":
                item.to_mesh_clear()
        if key is not None:
            self._meshes[key] = found
        return found

    def _cut(self, mesh, slots, skin):
        """The mesh's triangles, one piece a material."""
        count = len(mesh.loop_triangles)
        if count == 0:
            return []
        loops, polygons = np.empty(3 * count, np.int32), np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        mesh.loop_triangles.foreach_get("polygon_index", polygons)
        slot_of = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slot_of)
        slot_of = slot_of.clip(0, max(len(slots) - 1, 0))[polygons]
        arrays = self._arrays(mesh)
        numbers = [self._number(slots[k] if slots else None) for k in range(max(len(slots), 1))]
        corners = loops.reshape(-1, 3)
        return [self._piece(mesh, arrays, corners[slot_of == k].reshape(-1), numbers[k], skin) for k in np.unique(slot_of)]

    def _number(self, material):
        """The number of a material; None without a material."""
        return None if material is None else self._known[material.original.as_pointer()]

    def _arrays(self, mesh):
        """Vertex and normal of each corner, and the vertices' positions."""
        vertices = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", vertices)
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        normals = np.empty(3 * len(mesh.loops), np.float32)
        mesh.corner_normals.foreach_get("vector", normals)
        return vertices.reshape(-1, 3), corners, normals.reshape(-1, 3)

    def _piece(self, mesh, arrays, loops, number, skin):
        """Write the triangles with these corners as a piece's files; equal corners share a vertex."""
        vertices, corners, normals = arrays
        material = self.materials[number] if number is not None else None
        uvs = _layers(mesh, material)
        columns = {"corner": corners[loops, None].view(np.float32), "normals": normals[loops]}
        for k, name in enumerate(uvs):
            columns[f"uv{k}"] = None if name is None else _corner_values(mesh.uv_layers[name].uv, "vector", 2, mesh)[loops]
        columns["colors"] = _colors(mesh, material, corners, loops)
        held = {name: values for name, values in columns.items() if values is not None}
        first, triangles = _welded(np.concatenate(list(held.values()), axis=1))
        told = {name: self._saved(name, held[name][first]) for name in held if name != "corner"}
        told["positions"] = self._saved("positions", vertices[corners[loops[first]]])
        told["triangles"] = self._saved("triangles", triangles.reshape(-1, 3).astype(np.int32))
        if skin is not None:
            names, bones, weights = skin
            own = corners[loops[first]]
            told |= {"skin": names, "bones": self._saved("bones", bones[own]), "weights": self._saved("weights", weights[own])}
        self.pieces.append({"uv0": None, "uv1": None, "colors": None, "skin": None, **told, "uvs": uvs, "material": number})
        return len(self.pieces) - 1

    def _saved(self, name, array):
        file = Path(self._folder, f"piece{len(self.pieces)}.{name}.npy")
        np.save(file, array)
        return str(file)


def has_seen_triangles(instance, item):
    """Return whether the camera can see this instance's triangles: it is shown, has faces, and is no shadow catcher or
    holdout.
    """
    if not instance.show_self or item.type not in SOLID:
        return False
    return item.visible_camera and not item.is_shadow_catcher and not item.is_holdout


def strands(item):
    """Return whether particles are drawn as strands around the item, which are in pictures and in no mesh."""
    return item.type == "MESH" and any(
        modifier.type == "PARTICLE_SYSTEM"
        and modifier.show_render
        and modifier.particle_system.settings.type == "HAIR"
        and modifier.particle_system.settings.render_type == "PATH"
        for modifier in item.original.modifiers
    )


def part_of(item, owner):
    """The name of an object's part: the object's name, or `owner/object` if `owner` instances it. A slash within a name is
    replaced, so that the slash between the two names is unique; `viewsphere.assets.parts.own_part` does the same.
    """
    own = [one.name.replace("/", OWN_SLASH) for one in (owner, item)]
    return own[1] if item.original == owner.original else "/".join(own)


def _layers(mesh, material):
    """Names of the two layers of texture coordinates: the default one, and another that the material names."""
    main = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    named = (_uses(material, "uv") - {"", main}) & set(mesh.uv_layers.keys())
    return [main, min(named, default=None)]


def _uses(told, key):
    """Return every value of this name in an expression."""
    if isinstance(told, dict):
        own = {told[key]} if isinstance(told.get(key), str) else set()
        return own.union(*(_uses(value, key) for value in told.values()))
    return set().union(*(_uses(value, key) for value in told)) if isinstance(told, list) else set()


def _colors(mesh, material, corners, loops):
    """Linear vertex colours (N, 4) of corners if the material uses them or is absent; else None."""
    attributes = mesh.color_attributes
    if material is None:
        names = [attributes[attributes.render_color_index].name] if len(attributes) else []
    else:
        main = attributes[attributes.render_color_index].name if len(attributes) else None
        names = [main if name == "" else name for name in sorted(_asked(material))]
    layer = next((attributes[name] for name in names if name in attributes), None)
    if layer is None or layer.domain not in ("POINT", "CORNER"):
        return None
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    values = values.reshape(-1, 4)
    return values[corners[loops]] if layer.domain == "POINT" else values[loops]


def _asked(told):
    """Names of the colour attributes that a material's colour uses."""
    if isinstance(told, dict):
        own = {told["name"]} if told.get("do") == "attribute" else set()
        return own.union(*(_asked(value) for value in told.values()))
    return set().union(*map(_asked, told)) if isinstance(told, list) else set()


def _corner_values(data, name, width, mesh):
    values = np.empty(width * len(mesh.loops), np.float32)
    data.foreach_get(name, values)
    return values.reshape(-1, width)


def _welded(rows):
    """Indices of the distinct rows of (N, K) float32, and for each row the number of its distinct row. Rows are found by a
    verified hash.
    """
    bits = np.ascontiguousarray(rows).view(np.uint32).astype(np.uint64)
    mixed = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        mixed = (mixed ^ column) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
    if not np.array_equal(bits[first][inverse], bits):
        return np.arange(len(rows)), np.arange(len(rows))
    order = np.argsort(first)  # in the order of the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[inverse]


def listed(names):
    """The first few names, as a message lists them."""
    names = sorted(set(names))
    more = f" and {len(names) - NAMES_SAID} more" if len(names) > NAMES_SAID else ""
    return ", ".join(map(repr, names[:NAMES_SAID])) + more


def _skin_of(item, mesh):
    """The bones that may bend an object: their names, in their armatures' order, and for each vertex of its evaluated mesh
    numbers of bones and weights, (V, K) each. None if no armature bends the object.
    """
    rigs = [m.object for m in item.modifiers if m.type == "ARMATURE" and m.object is not None and m.use_vertex_groups]
    groups = {group.name: group.index for group in item.vertex_groups}
    names = list(dict.fromkeys(b.name for rig in rigs for b in rig.data.bones if b.use_deform and b.name in groups))
    if not names:
        return None
    number = {groups[name]: i for i, name in enumerate(names)}
    own = [[(number[g.group], g.weight) for g in vertex.groups if g.group in number] for vertex in mesh.vertices]
    width = max(map(len, own), default=0)
    bones, weights = np.zeros((len(own), width), np.int32), np.zeros((len(own), width), np.float32)
    for i, pairs in enumerate(own):
        for k, (bone, weight) in enumerate(pairs):
            bones[i, k], weights[i, k] = bone, weight
    return names, bones, weights
