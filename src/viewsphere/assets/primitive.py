"""Pieces: the triangles that a reader finds in a file, and joining them into one checked Mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.shown import shown_texels
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.scene_annotations import Annotation
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.model_spec import Axis
from viewsphere.model.scene import IDENTITY, Matrix4

FAINTEST = 0.01
"""Alpha below which blended texels do not count as surface for labels: the default of a recipe's `label_alpha`."""


Float = NDArray[np.float64]
Int = NDArray[np.int64]

TEXTURE_FIELDS = tuple(name for name in Material.__dataclass_fields__ if name.endswith("_texture"))
"""Names of Material's texture fields, in order."""

BLOCK = 1 << 16
"""Rows that are computed at once: their arrays stay in a processor's cache, which makes 5 million triangles 4 times as fast."""

FAR = 1e3
"""A model farther from the file's origin than this multiple of its size is stored around its own centre."""


@dataclass(frozen=True)
class FileFacts:
    """The facts that a file, or its format's specification, gives about its axes and its unit.

    `unit` is metres in one unit of the file. The raw mesh's vertices plus `origin` are the file's coordinates. `origin` is zero
    unless the model is so far away that float32 would lose its shape. `size` are the extents along the file's own x, y and z,
    in its unit. `files` are every file that the reader read or searched for. `keypoints` are points that the file names, in its
    coordinates. `marks` are annotated objects. `object_from_file` transforms the file's coordinates to the object's, after
    normalisation.
    """

    path: Path
    format: str
    up: Axis
    forward: Axis
    unit: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    files: tuple[Path, ...] = ()
    keypoints: Keypoints | None = None
    marks: tuple[Annotation, ...] = ()
    object_from_file: Matrix4 = IDENTITY


@dataclass(frozen=True, eq=False)
class Primitive:
    """Some triangles of one part and material; arrays as in Mesh but float64, normals None if unknown. `bone` (T,) is each
    triangle's index in `bones`, from `skin.strongest`; None if no skin bends the piece.
    """

    part: str
    material: int
    positions: Float
    triangles: Int
    normals: Float | None = None
    uv0: Float | None = None
    uv1: Float | None = None
    colors: Float | None = None
    bone: Int | None = None
    bones: tuple[str, ...] = ()


def blocks(count: int) -> Iterator[slice]:
    """Slices of at most `BLOCK` rows that cover `count` rows."""
    return (slice(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK))


def used_numbers(numbers: Int, count: int) -> tuple[Int, Int]:
    """The numbers below `count` that occur, ascending, and each number's position among them: `np.unique` without sorting."""
    is_used = np.zeros(count, np.bool_)
    is_used[numbers] = True
    return np.flatnonzero(is_used), (np.cumsum(is_used) - 1)[numbers]


def compact(piece: Primitive) -> Primitive:
    """The piece without vertices that no triangle uses."""
    used, corners = used_numbers(piece.triangles, len(piece.positions))
    if len(used) == len(piece.positions):
        return piece
    return replace(pick(piece, used), triangles=corners)


def pick(piece: Primitive, vertices: NDArray[np.integer]) -> Primitive:
    """The piece with these of its vertices, in this order; its triangles are unchanged."""

    def selected(array: Float | None) -> Float | None:
        return None if array is None else array[vertices]

    return replace(
        piece,
        positions=piece.positions[vertices],
        normals=selected(piece.normals),
        uv0=selected(piece.uv0),
        uv1=selected(piece.uv1),
        colors=selected(piece.colors),
    )


def assemble(
    folder: ModelFolder, pieces: Sequence[Primitive], materials: Sequence[Material], facts: FileFacts
) -> tuple[Mesh, FileFacts]:
    """Join pieces into one mesh, with its parts in order of first appearance and without unused materials and images.

    Triangles without area are dropped with a warning; a zero or NaN normal becomes the mean of its faces' normals, also with a
    warning. Raises ModelError for NaN and infinite coordinates, and when no triangle is left or there are too many.
    """
    pieces, materials = _without_lost_textures(folder, pieces, materials)
    count = sum(len(piece.triangles) for piece in pieces)
    if count == 0:
        raise folder.nothing_left()
    if folder.left:
        folder.warn(f"not read: {folder.left}")
    folder.check("MAX_TRIANGLES", count, "triangles")
    folder.check("MAX_VERTICES", sum(len(piece.positions) for piece in pieces), "vertices")
    names = list(dict.fromkeys(piece.part for piece in pieces))
    part_of = {name: i for i, name in enumerate(names)}
    starts = np.cumsum([0, *(len(piece.positions) for piece in pieces)])
    positions = np.concatenate([piece.positions for piece in pieces])
    triangles = np.concatenate([piece.triangles + start for piece, start in zip(pieces, starts, strict=False)])
    sizes = [len(piece.triangles) for piece in pieces]
    part = np.repeat([part_of[piece.part] for piece in pieces], sizes)
    material = np.repeat([piece.material for piece in pieces], sizes)
    body_parts, body_part = _joined([(p.bones, p.bone, size) for p, size in zip(pieces, sizes, strict=True)])

    for piece in pieces:
        check_coordinates(folder, piece.positions, piece.triangles, f"part {piece.part!r}: " if piece.part else "")
    positions, origin = _around_origin(positions, triangles)
    taken = np.flatnonzero(_solid_triangles(folder, positions, triangles))
    _check_layers(folder, positions, triangles[taken])
    taken = taken[np.lexsort((material[taken], part[taken]))]
    triangles, part, material = triangles[taken], part[taken], material[taken]

    used, corners = used_numbers(triangles, len(positions))
    triangles = corners.astype(np.int32)
    vertices = positions[used].astype(np.float32)
    part_used, part = used_numbers(part, len(names))
    material_used, material = used_numbers(material, len(materials))
    kept, images = used_images([materials[i] for i in material_used], folder.images)
    mesh = Mesh(
        vertices=vertices,
        triangles=triangles,
        normals=_normals(folder, pieces, vertices, triangles, used),
        triangle_material=material.astype(np.int32),
        triangle_part=part.astype(np.int32),
        materials=kept,
        parts=tuple(names[i] for i in part_used),
        uv0=_join(pieces, "uv0", 2, 0.0, used),
        uv1=_join(pieces, "uv1", 2, 0.0, used),
        colors=_join(pieces, "colors", 4, 1.0, used),
        images=images,
        warnings=tuple(folder.warnings),
        triangle_body_part=None if body_part is None else body_part[taken],
        body_parts=body_parts,
    )
    if _is_unseen(mesh):
        folder.warn("nothing of the model can be seen: all of it is clear (opacity 0); set the opacity of its materials")
        mesh = replace(mesh, warnings=tuple(folder.warnings))
    return mesh, replace(facts, origin=(origin[0], origin[1], origin[2]), size=extents(mesh), files=tuple(folder.files))


def _check_layers(folder: ModelFolder, positions: Float, triangles: Int) -> None:
    """Raise ModelError if so many triangles overlap that rendering the model would take far too long."""
    area = 0.0
    for part in blocks(len(triangles)):
        area += float(np.linalg.norm(face_normals(positions, triangles[part]), axis=1).sum()) / 2
    used = positions[used_numbers(triangles, len(positions))[0]]
    width, length, height = (used.max(axis=0) - used.min(axis=0)).tolist()
    box = 2 * (width * length + length * height + height * width)
    if box > 0:
        folder.check("MAX_LAYERS", int(area / box), "layers of triangles")


def _without_lost_textures(
    folder: ModelFolder, pieces: Sequence[Primitive], materials: Sequence[Material]
) -> tuple[list[Primitive], list[Material]]:
    """The pieces, and materials without textures whose coordinates a piece lacks; a warning names each lost texture."""
    kept, all_materials = list(pieces), list(materials)
    known: dict[tuple[int, tuple[str, ...]], int] = {}
    for i, piece in enumerate(pieces):
        material = materials[piece.material]
        uses: list[tuple[str, Texture | None]] = [(name, getattr(material, name)) for name in TEXTURE_FIELDS]
        lost = tuple(n for n, t in uses if t is not None and (piece.uv0, piece.uv1)[t.texcoord] is None)
        if not lost:
            continue
        if (piece.material, lost) not in known:
            known[piece.material, lost] = len(all_materials)
            all_materials.append(replace(material, **dict.fromkeys(lost)))  # pyright: ignore[reportArgumentType]
            folder.warn(f"material {material.name!r} has textures, but some of its triangles have no coordinates: plain there")
        kept[i] = replace(piece, material=known[piece.material, lost])
    return kept, all_materials


def extents(mesh: Mesh) -> tuple[float, float, float]:
    """Sizes along the mesh's x, y and z."""
    low, high = mesh.bounds
    x, y, z = (float(v) for v in high - low)
    return x, y, z


def _around_origin(positions: Float, triangles: Int) -> tuple[Float, list[float]]:
    used = positions[used_numbers(triangles, len(positions))[0]]
    low, high = used.min(axis=0), used.max(axis=0)
    size = float((high - low).max())
    center = (low + high) / 2
    if size > 0 and float(np.abs(center).max()) > FAR * size:
        return positions - center, [float(x) for x in center]
    return positions, [0.0, 0.0, 0.0]


def _solid_triangles(folder: ModelFolder, positions: Float, triangles: Int) -> NDArray[np.bool_]:
    stored = positions.astype(np.float32).astype(np.float64)
    solid = np.empty(len(triangles), np.bool_)
    for part in blocks(len(triangles)):
        solid[part] = np.any(face_normals(stored, triangles[part]) != 0, axis=1)
    if not np.any(solid):
        raise folder.error("every triangle has zero area; export the model again")
    if not np.all(solid):
        folder.warn(f"{np.count_nonzero(~solid)} triangles without area dropped")
    return solid


def _join(pieces: Sequence[Primitive], name: str, width: int, empty: float, used: Int) -> NDArray[np.float32] | None:
    arrays: list[Float | None] = [getattr(piece, name) for piece in pieces]
    if all(array is None for array in arrays):
        return None
    filled = [np.full((len(p.positions), width), empty) if a is None else a for p, a in zip(pieces, arrays, strict=True)]
    joined = np.concatenate(filled)[used]
    joined[~np.isfinite(joined)] = empty
    return joined.astype(np.float32)


def _normals(
    folder: ModelFolder,
    pieces: Sequence[Primitive],
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
    used: Int,
) -> NDArray[np.float32]:
    given = _join(pieces, "normals", 3, 0.0, used)
    if given is not None:
        lost = np.count_nonzero(~_is_direction(given))
        if lost:
            folder.warn(f"{lost} of {len(given)} normals are missing, NaN or of no length: smooth ones take their place")
    return unit_normals(vertices, triangles, given)


def _is_direction(vectors: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return a mask (N,) of the vectors (N, 3) that are long enough to be directions; False for NaN."""
    return np.linalg.norm(vectors, axis=1) > 1e-12


def unit_normals(
    vertices: NDArray[np.float32], triangles: NDArray[np.int32], given: NDArray[np.float32] | None
) -> NDArray[np.float32]:
    """Unit normals (V, 3): the given ones; where these are zero or missing the area-weighted mean of the faces, or else +Z."""
    normals = np.zeros((len(vertices), 3)) if given is None else given.astype(np.float64)
    lengths = np.linalg.norm(normals, axis=1)
    missing = ~_is_direction(normals)
    if missing.any():
        faces = face_normals(vertices.astype(np.float64), triangles)
        mean = np.zeros_like(normals)
        for axis in range(3):
            weights = np.repeat(faces[:, axis], 3)
            mean[:, axis] = np.bincount(triangles.reshape(-1), weights=weights, minlength=len(vertices))
        normals[missing] = mean[missing]
        lengths = np.linalg.norm(normals, axis=1)
    still = ~(lengths > 0)
    normals[still] = (0.0, 0.0, 1.0)
    lengths[still] = 1.0
    return (normals / lengths[:, None]).astype(np.float32)


def face_normals(positions: Float, triangles: NDArray[np.integer]) -> Float:
    """Normals (T, 3) on the counter-clockwise side, their length twice the triangle's area."""
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def used_images(materials: Sequence[Material], images: Sequence[Image]) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
    """These materials and only the images they use, renumbered."""
    textures = [getattr(material, name) for material in materials for name in TEXTURE_FIELDS]
    used = sorted({texture.image for texture in textures if texture is not None})
    position = {old: new for new, old in enumerate(used)}

    def renumbered(material: Material) -> Material:
        changes: dict[str, Texture] = {}
        for name in TEXTURE_FIELDS:
            texture: Texture | None = getattr(material, name)
            if texture is not None:
                changes[name] = replace(texture, image=position[texture.image])
        return replace(material, **changes)  # pyright: ignore[reportArgumentType]

    return tuple(renumbered(material) for material in materials), tuple(images[i] for i in used)


def _is_unseen(mesh: Mesh) -> bool:
    """Return whether every triangle is completely transparent by its material, texels or vertex colours."""
    return all(_is_clear(mesh, index) for index in np.unique(mesh.triangle_material).tolist())


def _is_clear(mesh: Mesh, index: int) -> bool:
    material = mesh.materials[index]
    if material.alpha_mode == "OPAQUE" or material.transmission > 0:
        return False
    triangles = mesh.triangles[mesh.triangle_material == index]
    vertices = 1.0 if mesh.colors is None else float(mesh.colors[triangles, 3].max())
    least = material.alpha_cutoff if material.alpha_mode == "MASK" else FAINTEST
    most = material.base_color[3] * vertices
    return most < least or most * _texels(mesh, index) < least


def _texels(mesh: Mesh, index: int) -> float:
    """The highest alpha of the texels that triangles of a material show; for a rotated or mirrored texture, of all texels."""
    texture = mesh.materials[index].base_color_texture
    uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
    if texture is None or uv is None:
        return 1.0
    alpha = mesh.images[texture.image].pixels[..., 3]
    if alpha.min() == 255:
        return 1.0
    if not texture.rotation and min(texture.scale) > 0:
        corners = uv[mesh.triangles[mesh.triangle_material == index]].astype(np.float64)
        alpha = alpha[shown_texels(texture, corners, alpha.shape)]
    return float(alpha.max(initial=0)) / 255.0


def _joined(pieces: Sequence[tuple[tuple[str, ...], Int | None, int]]) -> tuple[tuple[str, ...], NDArray[np.int32] | None]:
    """The names of all bones of some pieces, each once, and the bone number of each triangle, from 1, 0 for none; None if no
    piece has bones. Each piece gives the names of its bones, the bone of each triangle (None: no bones), and its number of
    triangles.
    """
    names = tuple(dict.fromkeys(name for own, _, _ in pieces for name in own))
    if not names:
        return (), None
    number = {name: i for i, name in enumerate(names, 1)}
    parts = [
        np.zeros(count, np.int32) if bone is None else np.array([*(number[name] for name in own), 0], np.int32)[bone]
        for own, bone, count in pieces
    ]
    return names, np.concatenate(parts)
