"""Objects that say what they are to those who are put among them: their names, properties, lines and children."""

from .evaluated import part_of

PROPERTY = "viewsphere"
"""The custom property that says what an object is; `width` and `closed` beside it are a lane's."""

LANE = "lane"
LINES = ("CURVE", "MESH")


class Marks:
    """Collects the objects that have the property, or are lanes by their names: `found` tells them, in the order of names."""

    def __init__(self, wanted):
        self.found, self._wanted = [], wanted

    def take(self, depsgraph):
        """Collect all such objects of a depsgraph that are asked for."""
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
    """Points in the world, edges between them, and whether there are faces, which leave the first two empty."""
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
