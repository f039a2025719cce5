"""COLLADA 1.4 and 1.5 (https://www.khronos.org/files/collada_spec_1_4.pdf): the scene at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from viewsphere.assets.appearance.alpha import with_alpha_modes
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.readers.dae.material import DaeMaterials, is_double_sided
from viewsphere.assets.readers.dae.mesh import DaeFaces, numbers_of, read_mesh
from viewsphere.assets.readers.shared.instances import check_instances
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.assets.readers.shared.transform import moved
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.model.model_spec import Axis

AXES: dict[str, tuple[Axis, Axis]] = {"X_UP": ("+x", "+z"), "Y_UP": ("+y", "+z"), "Z_UP": ("+z", "-y")}


def read_dae(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as one mesh with the scene's transforms applied; each face element of each instance is a part.

    Vertex colours are read as sRGB. Without normals, edges are smooth up to a crease. Raises ModelError.
    """
    data = folder.read_model()
    root = parse_xml(folder, data)
    if root.tag != "COLLADA":
        raise folder.error(f"expected a COLLADA file, found XML of <{root.tag[:40]}>")
    check_instances(folder, _dae_references(root))
    materials = DaeMaterials(folder, root)
    pieces = list(_Scene(folder, root, materials).pieces())
    kept = with_alpha_modes(folder, pieces, materials.kept or [Material()], materials.stated)
    return assemble(folder, pieces, kept, _facts(folder, root))


def _facts(folder: ModelFolder, root: Any) -> FileFacts:
    up, forward = AXES.get((root.findtext("asset/up_axis") or "").strip(), AXES["Y_UP"])
    unit = root.find("asset/unit")
    return FileFacts(folder.model, "dae", up, forward, _positive("" if unit is None else str(unit.get("meter"))))


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return 1.0
    return value if math.isfinite(value) and value > 0 else 1.0


@dataclass(eq=False)
class _Scene:
    folder: ModelFolder
    root: Any
    materials: DaeMaterials
    total: int = 0
    _elements: dict[tuple[str, str], Any] = field(default_factory=dict[tuple[str, str], Any])
    _meshes: dict[str, list[DaeFaces]] = field(default_factory=dict[str, list[DaeFaces]])
    _names: dict[str, int] = field(default_factory=dict[str, int])

    def __post_init__(self) -> None:
        for element in self.root.iter():
            if element.tag in ("node", "geometry", "controller", "visual_scene"):
                self._elements.setdefault((element.tag, str(element.get("id"))), element)

    def pieces(self) -> Iterator[Primitive]:
        """Yield all faces of the scene at the poses of its nodes; for a file without a scene, each geometry once."""
        instance = self.root.find("scene/instance_visual_scene")
        scene = None if instance is None else self._target("visual_scene", instance)
        if scene is None:
            scene = self.root.find("library_visual_scenes/visual_scene")
        if scene is None:
            self.folder.warn("has no scene; each of its geometries stands at the origin")
            for geometry in self.root.iter("geometry"):
                yield from self._placed(str(geometry.get("id")), {}, np.eye(4))
            return
        for node in scene.iterfind("node"):
            yield from self._node(node, np.eye(4))

    def _target(self, tag: str, instance: Any, attribute: str = "url") -> Any:
        return self._elements.get((tag, str(instance.get(attribute, "")).removeprefix("#")))

    def _node(self, node: Any, parent: Float) -> Iterator[Primitive]:
        matrix = parent @ _matrix(self.folder, node)
        for child in node:
            if child.tag == "node":
                yield from self._node(child, matrix)
            elif child.tag == "instance_node":
                other = self._target("node", child)
                if other is None:
                    self.folder.warn(f"node {str(child.get('url'))[:80]!r} does not exist; it is left out")
                else:
                    yield from self._node(other, matrix)
            elif child.tag == "instance_geometry":
                yield from self._placed(str(child.get("url", "")).removeprefix("#"), self._bound(child), matrix)
            elif child.tag == "instance_controller":
                yield from self._controlled(child, matrix)

    def _controlled(self, instance: Any, matrix: Float) -> Iterator[Primitive]:
        """The geometry that a skin or morph starts from, in its bind pose."""
        controller = self._target("controller", instance)
        bound = self._bound(instance)
        while controller is not None:
            inner = next((child for child in controller if child.tag in ("skin", "morph")), None)
            if inner is None:
                return
            shape = numbers_of(self.folder, inner.find("bind_shape_matrix"), np.float64)
            matrix = matrix @ (shape.reshape(4, 4) if shape.size == 16 else np.eye(4))
            source = str(inner.get("source", "")).removeprefix("#")
            if ("geometry", source) in self._elements:
                self.folder.warn("its skins and morphs are left in the pose in which they were bound")
                yield from self._placed(source, bound, matrix)
                return
            controller = self._target("controller", inner, "source")

    def _bound(self, instance: Any) -> dict[str, Any]:
        """The `<instance_material>` of each symbol."""
        return {str(e.get("symbol")): e for e in instance.iterfind("bind_material/technique_common/instance_material")}

    def _placed(self, geometry: str, bound: Mapping[str, Any], matrix: Float) -> Iterator[Primitive]:
        element = self._elements.get(("geometry", geometry))
        sides = None if element is None else is_double_sided(element)
        for faces in self._faces(geometry):
            self.total += len(faces.triangles)
            self.folder.check("MAX_TRIANGLES", self.total, "triangles, all instances counted,")
            piece = self.materials.dressed(faces, self._unique(geometry), bound.get(faces.symbol), sides)
            yield moved(piece if piece.normals is not None else creased(piece), matrix)

    def _faces(self, name: str) -> Sequence[DaeFaces]:
        if name not in self._meshes:
            geometry = self._elements.get(("geometry", name))
            mesh = None if geometry is None else geometry.find("mesh")
            if mesh is None and geometry is not None:
                mesh = geometry.find("convex_mesh")
            if mesh is None:
                why = "does not exist" if geometry is None else "is no mesh"
                self.folder.warn(f"geometry {name[:80]!r} {why}; it is left out")
            self._meshes[name] = [] if mesh is None else list(read_mesh(self.folder, mesh))
        return self._meshes[name]

    def _unique(self, name: str) -> str:
        number = self._names[name] = self._names.get(name, -1) + 1
        return f"{name}_{number}" if number else name


def _matrix(folder: ModelFolder, node: Any) -> Float:
    """The product (4, 4) of a node's transforms, in order."""
    matrix = np.eye(4)
    for element in node:
        if element.tag in SIZES:
            values = numbers_of(folder, element, np.float64)
            if values.size != SIZES[element.tag]:
                raise folder.error(f"<{element.tag}> needs {SIZES[element.tag]} numbers, found {values.size}")
            matrix = matrix @ _transform(element.tag, values)
        elif element.tag == "skew":
            folder.warn("<skew> of a node is left out")
    return matrix


SIZES = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4, "lookat": 9}
"""Transforms of a node, and the count of numbers in each."""


def _transform(tag: str, values: Float) -> Float:
    if tag == "matrix":
        return values.reshape(4, 4)
    matrix = np.eye(4)
    if tag == "translate":
        matrix[:3, 3] = values
    elif tag == "scale":
        matrix[:3, :3] = np.diag(values)
    elif tag == "rotate":
        matrix[:3, :3] = _rotation(values[:3], math.radians(values[3]))
    else:
        matrix[:3] = _looking(*values.reshape(3, 3))
    return matrix


def _rotation(axis: Float, angle: float) -> Float:
    length = math.sqrt(float((axis * axis).sum()))
    if not length:
        return np.eye(3)
    x, y, z = axis / length
    c, s = math.cos(angle), math.sin(angle)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    outer = np.array([[x * x, x * y, x * z], [x * y, y * y, y * z], [x * z, y * z, z * z]])
    return c * np.eye(3) + s * cross + (1 - c) * outer


def _looking(eye: Float, interest: Float, up: Float) -> Float:
    """The pose (3, 4) of an object at `eye` that looks towards `interest` along its own -z."""
    back = eye - interest
    back = back / (math.sqrt(float((back * back).sum())) or 1.0)
    side = np.cross(up, back)
    side = side / (math.sqrt(float((side * side).sum())) or 1.0)
    return np.column_stack([side, np.cross(back, side), back, eye])


def _dae_references(root: Element) -> dict[str, list[str]]:
    """For each node of a COLLADA file, its child nodes and the nodes that it instantiates; the parent of the scenes is `""`."""
    # Nodes are identified by number, because files with duplicate ids are common.
    scenes, library = "", "library"
    references: dict[str, list[str]] = {scenes: [], library: []}
    by_url: dict[str, str] = {}
    waiting = [(root, library)]
    while waiting:
        element, owner = waiting.pop()
        if element.tag == "instance_node":
            references[owner].append(element.get("url", ""))
        elif element.tag == "visual_scene":
            owner = scenes
        elif element.tag == "node":
            name = f"node {len(references)}"
            by_url.setdefault(f"#{element.get('id')}", name)
            references[name] = []
            references[owner].append(name)
            owner = name
        waiting += ((child, owner) for child in reversed(element))
    return {name: [by_url.get(other, other) for other in inner] for name, inner in references.items()}
