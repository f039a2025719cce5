"""3MF (https://3mf.io/spec): the objects of the build, with colours and textures of the materials extension.

Components and build items may be in other model files of the archive (the production extension's `path`).
"""

from __future__ import annotations

import io
import posixpath
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import unquote

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.readers.shared.instances import check_instances
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.assets.readers.shared.transform import moved
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.assets.readers.threemf.object import Object, Part, objects_of
from viewsphere.assets.readers.threemf.resources import Resources
from viewsphere.errors import ModelError

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
    _resources: dict[str, Resources] = field(default_factory=dict[str, Resources])
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
                key[0], Resources(self.folder, self.model(key[0]), self.materials, self.picture)
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
