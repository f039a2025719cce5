"""PLY and OFF: parsed by trimesh (https://trimesh.org), turned into pieces here.

trimesh's parsers are called directly: its Trimesh class would merge and reorder vertices.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.alpha import with_alpha_modes
from viewsphere.assets.folder import ModelFolder, image_pixels
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.smoothing import creased, split
from viewsphere.assets.srgb import linear
from viewsphere.assets.transform import moved
from viewsphere.errors import ModelError

Rgba = tuple[float, float, float, float]


def read_via_trimesh(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as one mesh with the scene's transforms applied; each geometry of the file is a part.

    Vertex and face colours are taken as sRGB. Without normals, edges are smooth up to a crease.
    """
    kind = folder.model.suffix[1:].lower()
    data = folder.read_model()
    _check_promises(folder, kind, data)
    loaded = _parse(folder, kind, data)
    builder = _Builder(folder, [])
    pieces = builder.scene(loaded) if "geometry" in loaded else builder.placed(loaded, "object", np.eye(4))
    facts = _facts(folder, kind)
    return assemble(folder, pieces, with_alpha_modes(folder, pieces, builder.materials), facts)


class _Resolver:
    """The resolver through which trimesh's parsers read the files that a model names."""

    def __init__(self, folder: ModelFolder) -> None:
        self.folder = folder

    def get(self, key: str) -> bytes:
        if self.folder.image(key, key) is None:
            raise FileNotFoundError(key)
        return self.folder.read(key, "texture")

    def __getitem__(self, key: str) -> bytes:
        return self.get(key)


def _check_promises(folder: ModelFolder, kind: str, data: bytes) -> None:
    """Refuse files that promise more elements than they have bytes for, before anything is allocated."""
    if kind == "ply":
        if not data.startswith(b"ply"):
            raise folder.error("expected a PLY file, which begins with 'ply'")
        counts = [int(n) for n in re.findall(rb"element\s+\w+\s+(\d+)", data[: 1 << 16].partition(b"end_header")[0])]
    elif kind == "off":
        words = re.sub(rb"#.*", b"", data[: 1 << 16]).split()
        counts = [int(word) for word in words[1:4] if word.isdigit()]
    else:
        counts = []
    if any(count > len(data) for count in counts):
        raise folder.error(f"promises {max(counts):,} elements in {len(data):,} bytes: truncated or damaged")


def _unreadable(folder: ModelFolder, kind: str, error: Exception) -> ModelError:
    reason = str(error).split("\n")[0][:120]
    return folder.error(f"cannot be read as {kind.upper()} ({type(error).__name__}: {reason}): damaged?")


def _parse(folder: ModelFolder, kind: str, data: bytes) -> dict[str, Any]:
    """What trimesh's parser returns: the arguments of one mesh, or of a scene of several."""
    from trimesh.exchange.load import mesh_loaders

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = mesh_loaders[kind](io.BytesIO(data), file_type=kind, resolver=_Resolver(folder))
    except (ModelError, MemoryError):
        raise
    except Exception as error:  # trimesh's parsers raise errors of many kinds for damaged files
        raise _unreadable(folder, kind, error) from None
    return cast("dict[str, Any]", loaded)


@dataclass(frozen=True, eq=False)
class _Builder:
    folder: ModelFolder
    materials: list[Material]

    def scene(self, loaded: Mapping[str, Any]) -> list[Primitive]:
        """All geometries where the scene's graph puts them; without a graph each once at the origin."""
        geometry: dict[str, Any] = loaded["geometry"]
        graph: list[dict[str, Any]] = loaded.get("graph") or [
            {"frame_to": name, "geometry": name, "matrix": np.eye(4)} for name in geometry
        ]
        edges = [edge for edge in graph if edge.get("geometry") in geometry]
        total = sum(len(geometry[edge["geometry"]]["faces"]) for edge in edges)
        self.folder.check("MAX_TRIANGLES", total, "triangles, all instances counted,")
        return [
            piece
            for edge in edges
            for piece in self.placed(geometry[edge["geometry"]], str(edge["frame_to"]), np.asarray(edge["matrix"]))
        ]

    def placed(self, geometry: Mapping[str, Any], part: str, matrix: Float) -> list[Primitive]:
        """One geometry's triangles under an affine matrix."""
        vertices, faces = geometry.get("vertices"), geometry.get("faces")
        if vertices is None or faces is None or not len(faces):
            return []
        positions, triangles = _rows(vertices, len(vertices), 3), np.asarray(faces)
        if positions is None or triangles.dtype.kind not in "iu":
            raise self.folder.error("expected three coordinates a vertex and whole numbers in faces: damaged?")
        triangles = triangles.astype(np.int64)
        if triangles.ndim != 2 or triangles.shape[1] not in (3, 4):
            raise self.folder.error("expected triangles or quadrilaterals, found other faces")
        repeats = np.ones(len(triangles), np.int64)
        if triangles.shape[1] == 4:
            repeats *= 2
            triangles = triangles[:, [0, 1, 2, 2, 3, 0]].reshape(-1, 3)
        if triangles.min() < 0 or triangles.max() >= len(positions):
            raise self.folder.error(f"a face names vertex {triangles.max()}, expected 0 to {len(positions) - 1}")
        visual = geometry.get("visual")
        piece = Primitive(
            part=part,
            material=self._material(getattr(visual, "material", None)),
            positions=positions,
            triangles=triangles,
            normals=_rows(geometry.get("vertex_normals"), len(positions), 3),
            uv0=_uv(visual, len(positions)),
            colors=_vertex_colors(geometry.get("vertex_colors"), len(positions)),
        )
        face_colors = geometry.get("face_colors")
        if face_colors is not None and piece.colors is None and len(face_colors) == len(repeats):
            piece = _with_face_colors(piece, np.repeat(np.asarray(face_colors), repeats, axis=0))
        return [moved(piece if piece.normals is not None else creased(piece), matrix)]

    def _material(self, source: Any) -> int:
        """Index of the material made from trimesh's material."""
        image = getattr(source, "baseColorTexture", None) or getattr(source, "image", None)
        texture = self._texture(image)
        color = _unit_color(getattr(source, "baseColorFactor", None), (1.0, 1.0, 1.0, 1.0))
        emissive = _unit_color(getattr(source, "emissiveFactor", None), (0.0, 0.0, 0.0, 1.0))
        rough, metal = getattr(source, "roughnessFactor", None), getattr(source, "metallicFactor", None)
        material = Material(
            name=str(getattr(source, "name", None) or "default"),
            base_color=color,
            base_color_texture=texture,
            metallic=0.0 if metal is None else float(metal),
            roughness=Material().roughness if rough is None else float(rough),
            normal_texture=self._texture(getattr(source, "normalTexture", None)),
            emissive=emissive[:3],
            alpha_mode="BLEND" if color[3] < 1.0 else "OPAQUE",
        )
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)

    def _texture(self, picture: Any) -> Texture | None:
        """The texture of a Pillow image; the folder has decoded the same file when trimesh asked for it."""
        if picture is None:
            return None
        pixels = image_pixels(picture)
        for index, known in enumerate(self.folder.images):
            if np.array_equal(known.pixels, pixels):
                return Texture(index)
        return Texture(self.folder.add_image(Image("texture", pixels)))


def _unit_color(color: Any, default: Rgba) -> Rgba:
    """A colour in [0, 1] from trimesh's colours, which are floats or bytes."""
    if color is None:
        return default
    values = np.asarray(color)
    scaled = values.astype(np.float64) / (255.0 if values.dtype.kind in "iu" else 1.0)
    padded = np.ones(4)
    padded[: min(4, scaled.size)] = scaled.reshape(-1)[:4]
    r, g, b, a = (float(x) for x in np.clip(np.nan_to_num(padded), 0.0, 1.0))
    return (r, g, b, a)


def _rows(values: Any, count: int, width: int) -> Float | None:
    if values is None:
        return None
    array = np.asarray(values)
    return array.astype(np.float64) if array.shape == (count, width) and array.dtype.kind in "iuf" else None


def _uv(visual: Any, count: int) -> Float | None:
    """Texture coordinates with v downwards, as glTF has them."""
    uv = _rows(getattr(visual, "uv", None), count, 2)
    return None if uv is None else np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])


def _vertex_colors(values: Any, count: int) -> Float | None:
    """Linear colours (V, 4) from sRGB bytes or floats, with or without alpha."""
    if values is None:
        return None
    array = np.asarray(values)
    if array.shape not in {(count, 3), (count, 4)} or array.dtype.kind not in "iuf":
        return None
    unit = np.clip(array.astype(np.float64) / (255.0 if array.dtype.kind in "iu" else 1.0), 0.0, 1.0)
    alpha = unit[:, 3] if array.shape[1] == 4 else np.ones(count)
    return np.column_stack([linear(unit[:, :3]), alpha])


def _with_face_colors(piece: Primitive, colors: NDArray[Any]) -> Primitive:
    """The piece with unshared vertices, each coloured by its face."""
    alone = split(piece)
    return replace(alone, colors=_vertex_colors(np.repeat(colors, 3, axis=0), len(alone.positions)))


def _facts(folder: ModelFolder, kind: str) -> FileFacts:
    return FileFacts(folder.model, kind, "+z", "-y", 1.0)
