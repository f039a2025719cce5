"""Property groups of a 3MF model file: base materials, colours, and texture coordinates with their pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from viewsphere.assets.mesh import Material, Texture, Wrap
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int, Primitive, compact
from viewsphere.assets.readers.shared.smoothing import split
from viewsphere.assets.readers.threemf.object import NOTHING, Object, Triangles
from viewsphere.codecs.srgb import linear

TILES: dict[str, Wrap] = {"wrap": "repeat", "mirror": "mirror", "clamp": "clamp", "none": "clamp"}


class Resources:
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
    return TILES.get(style or "wrap", "repeat")


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
