"""3MF (https://3mf.io/spec): the objects of the build, with colours and textures of the materials extension.

Components and build items may be in other model files of the archive (the production extension's `path`).
"""

from __future__ import annotations

import io
import posixpath
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import unquote

import numpy as np

from viewsphere.assets.mesh import Material, Mesh, Texture, Wrap
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Int, Primitive, assemble, compact
from viewsphere.assets.readers.shared.instances import check_instances
from viewsphere.assets.readers.shared.smoothing import creased, split
from viewsphere.assets.readers.shared.transform import moved
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.assets.readers.threemf.object import NOTHING, Object, Part, Triangles, objects_of
from viewsphere.codecs.srgb import linear
from viewsphere.errors import ModelError

_TILES: dict[str, Wrap] = {"wrap": "repeat", "mirror": "mirror", "clamp": "clamp", "none": "clamp"}

UNITS = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
}  # fmt: skip
MODEL_TYPE = "3dmanufacturing/2013/01/3dmodel"
Key = tuple[str, str]
"""An object: the path of its model file in the archive, and its id there."""


def read_3mf(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The build's objects at their poses, with each mesh as a part; edges are smooth up to a crease. Raises ModelError."""
    data = folder.read_model()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
            folder.check("MAX_ARCHIVE_BYTES", size, "bytes in the unpacked archive")
            return _read(_Package(folder, archive))
    except (ModelError, MemoryError):
        raise
    except Exception as error:  # zipfile and its decoders raise errors of many kinds for damaged files
        reason = " ".join(str(error).split())[:120]
        raise folder.error(f"cannot be read as 3MF ({type(error).__name__}: {reason}): truncated or damaged") from None


def _read(package: _Package) -> tuple[Mesh, FileFacts]:
    folder, root = package.folder, package.root
    items = package.items()
    package.check(items)
    pieces = [piece for item in items for piece in package.placed(item, np.eye(4))]
    unit = UNITS.get(str(package.model(root).get("unit", "millimeter")), UNITS["millimeter"])
    return assemble(folder, pieces, package.materials, FileFacts(folder.model, "3mf", "+z", "-y", unit))


@dataclass(eq=False)
class _Package:
    """An open archive; each of its model files is parsed when it is first needed."""

    folder: ModelFolder
    archive: zipfile.ZipFile
    materials: list[Material] = field(default_factory=lambda: [Material(name="default")])
    _roots: dict[str, Any] = field(default_factory=dict[str, Any])
    _objects: dict[str, dict[str, Object]] = field(default_factory=dict[str, "dict[str, Object]"])
    _resources: dict[str, _Resources] = field(default_factory=dict[str, "_Resources"])
    _pieces: dict[Key, list[Primitive]] = field(default_factory=dict[Key, "list[Primitive]"])
    _names: dict[str, int] = field(default_factory=dict[str, int])

    @property
    def root(self) -> str:
        """The path of the model file that holds the build."""
        names = {name.lower(): name for name in self.archive.namelist()}
        for link in self._parsed(names["_rels/.rels"]) if "_rels/.rels" in names else ():
            if str(link.get("Type", "")).endswith(MODEL_TYPE):
                return _clean(str(link.get("Target")))
        models = sorted(name for key, name in names.items() if key.endswith(".model"))
        if not models:
            raise self.folder.error("expected a 3MF archive with a .model file, found none")
        return min(models, key=lambda name: (name.lower() != "3d/3dmodel.model", name))

    def _parsed(self, path: str) -> Any:
        """The root element of a file of the archive, tags and attributes without their namespaces."""
        if path not in self._roots:
            self._roots[path] = parse_xml(self.folder, self._bytes(path), path)
        return self._roots[path]

    def _bytes(self, path: str) -> bytes:
        for name in self.archive.namelist():
            if name.lower() == path.lower():
                return self.archive.read(name)
        raise self.folder.error(f"its archive has no {path[:120]!r}, which it names: damaged")

    def model(self, path: str) -> Any:
        """The `<model>` of a model file."""
        root = self._parsed(path)
        if root.tag != "model":
            raise self.folder.error(f"{path}: expected <model>, found <{root.tag[:40]}>")
        return root

    def items(self) -> list[Part]:
        """The items of the build; if it has none, all objects that are not components, with a warning."""
        path = self.root
        items = [
            Part.from_element(item, path)
            for build in self.model(path)
            if build.tag == "build"
            for item in build
            if item.tag == "item"
        ]
        if items:
            return items
        inner = {part.key for one in self._objects_in(path).values() for part in one.components}
        alone = [Part((path, name), np.eye(4)) for name in self._objects_in(path) if (path, name) not in inner]
        if alone:
            self.folder.warn("its build is empty; each of its objects stands at the origin")
        return alone

    def _objects_in(self, path: str) -> dict[str, Object]:
        if path not in self._objects:
            self._objects[path] = objects_of(self.folder, self.model(path), path)
        return self._objects[path]

    def _object(self, key: Key) -> Object:
        found = self._objects_in(key[0]).get(key[1])
        if found is None:
            raise self.folder.error(f"{key[0]} has no object {key[1][:40]!r}, which its build or a component names")
        return found

    def check(self, items: list[Part]) -> None:
        """Refuse cycles and excessive instances before any mesh is copied."""
        references: dict[str, list[str]] = {"": [_name_of(item.key) for item in items]}
        waiting = [item.key for item in items]
        while waiting:
            key = waiting.pop()
            if _name_of(key) not in references:
                components = self._object(key).components
                references[_name_of(key)] = [_name_of(part.key) for part in components]
                waiting.extend(part.key for part in components)
        check_instances(self.folder, references)

    def placed(self, part: Part, matrix: Float) -> Iterator[Primitive]:
        """The triangles of an object and of its components, under a transform."""
        inner, one = matrix @ part.matrix, self._object(part.key)
        if one.mesh is not None:
            name = self._unique(one.name or f"object {part.key[1]}")
            for piece in self._local(part.key, one):
                yield moved(replace(piece, part=name), inner)
        for component in one.components:
            yield from self.placed(component, inner)

    def _local(self, key: Key, one: Object) -> list[Primitive]:
        if key not in self._pieces:
            resources = self._resources.setdefault(
                key[0], _Resources(self.folder, self.model(key[0]), self.materials, self.picture)
            )
            self._pieces[key] = [creased(piece) for piece in resources.dressed(one)]
        return self._pieces[key]

    def picture(self, path: str) -> int | None:
        """Index of a picture of the archive among the folder's images."""
        return self.folder.image(f"#{path}", path, self._bytes(_clean(path)))

    def _unique(self, name: str) -> str:
        number = self._names[name] = self._names.get(name, 0) + 1
        return name if number == 1 else f"{name}_{number}"


def _name_of(key: Key) -> str:
    return "\0".join(key)


def _clean(path: str) -> str:
    return posixpath.normpath(unquote(path).replace("\\", "/")).lstrip("/")


class _Resources:
    """The properties of one model file; new materials are appended to `materials`, whose first is the default."""

    def __init__(
        self, folder: ModelFolder, model: Any, materials: list[Material], picture: Callable[[str], int | None]
    ) -> None:
        self.folder = folder
        self.materials = materials
        self.picture = picture
        self.elements = {str(e.get("id")): e for e in model.iterfind("resources/*")}

    def dressed(self, one: Object) -> Iterator[Primitive]:
        """An object's triangles with their materials, a piece for each material."""
        mesh = one.mesh
        assert mesh is not None
        named = np.array(mesh.groups, dtype=str)
        named[(mesh.properties == NOTHING).any(axis=1)] = ""
        for group in dict.fromkeys(named.tolist()):
            rows = np.flatnonzero(named == group)
            yield from self._group(group, _piece(mesh, rows), mesh.properties[rows])

    def _group(self, group: str, piece: Primitive, properties: Int) -> Iterator[Primitive]:
        element = self.elements.get(group)
        kind = "" if element is None else element.tag
        if element is None:
            yield self._plain(piece, group, "do not exist")
        elif kind == "basematerials":
            yield from self._by_base(element, piece, properties[:, 0])
        elif kind == "colorgroup":
            colors = np.array([_color(child.get("color")) for child in element.iterfind("color")])
            yield replace(split(piece), colors=self._picked(colors, properties, group))
        elif kind == "texture2dgroup":
            yield self._textured(element, piece, properties, group)
        else:
            yield self._plain(piece, group, f"are {kind[:40]}, not read")

    def _plain(self, piece: Primitive, group: str, why: str) -> Primitive:
        if group:
            self.folder.warn(f"its properties {group[:40]!r} {why}; white there")
        return piece

    def _by_base(self, element: Any, piece: Primitive, index: Int) -> Iterator[Primitive]:
        bases = list(element)
        for number in np.unique(index).tolist():
            if number >= len(bases):
                raise self.folder.error(f"names base material {number} of {len(bases)}: damaged")
            base = bases[number]
            red, green, blue, alpha = _color(base.get("displaycolor")).tolist()
            material = Material(
                name=str(base.get("name") or "")[:80],
                base_color=(red, green, blue, alpha),
                alpha_mode="BLEND" if alpha < 1 else "OPAQUE",
            )
            yield compact(replace(piece, triangles=piece.triangles[index == number], material=self._number(material)))

    def _textured(self, element: Any, piece: Primitive, properties: Int, group: str) -> Primitive:
        picture = self.elements.get(str(element.get("texid")))
        index = None if picture is None else self.picture(str(picture.get("path")))
        if picture is None or index is None:
            self.folder.warn(f"texture {str(element.get('texid'))[:40]!r} cannot be used; white there")
            return piece
        uv = np.array([(child.get("u"), child.get("v")) for child in element], dtype=str).astype(np.float64)
        uv[:, 1] = 1 - uv[:, 1]
        wrap_s, wrap_t = _wrap(picture.get("tilestyleu")), _wrap(picture.get("tilestylev"))
        texture = Texture(index, wrap_s=wrap_s, wrap_t=wrap_t, nearest=picture.get("filter") == "nearest")
        material = Material(name=str(element.get("texid")), base_color_texture=texture)
        return replace(split(piece), uv0=self._picked(uv, properties, group), material=self._number(material))

    def _picked(self, rows: Float, properties: Int, group: str) -> Float:
        """The property of each corner, (3 T, ...)."""
        if properties.size and properties.max() >= len(rows):
            raise self.folder.error(f"names property {properties.max()} of the {len(rows)} in {group[:40]!r}: damaged")
        return rows[properties.reshape(-1)]

    def _number(self, material: Material) -> int:
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)


def _piece(mesh: Triangles, rows: Int) -> Primitive:
    return compact(Primitive(part="", material=0, positions=mesh.vertices, triangles=mesh.corners[rows]))


def _wrap(style: str | None) -> Wrap:
    return _TILES.get(style or "wrap", "repeat")


def _color(text: str | None) -> Float:
    """Linear colour (4,) of #RRGGBB or #RRGGBBAA in sRGB; white for any other text."""
    digits = str(text or "").strip().removeprefix("#")
    try:
        values = np.frombuffer(bytes.fromhex(digits), np.uint8) / 255
    except ValueError:
        values = np.ones(0)
    if len(values) not in (3, 4):
        return np.ones(4)
    return np.append(linear(values[:3]), values[3] if len(values) == 4 else 1.0)
