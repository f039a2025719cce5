"""The conversion of data sets of cameras, optionally with a mesh of their scene, into a recipe that renders them again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.errors import StoreError
from viewsphere.files import open_file
from viewsphere.model.listed import ListedObject, ListedShot, Pose
from viewsphere.model.model_spec import Axis
from viewsphere.model.scene import IDENTITY
from viewsphere.store.paths import file_inside
from viewsphere.store.source_cameras import SourceCameras, SourceModel

MESH = "mesh"
"""The key of a data set's own mesh."""

ENDINGS = (".ply", ".obj", ".glb", ".stl", ".off")
BEST = ("meshed-poisson.ply", "meshed-delaunay.ply")
"""Names of COLMAP's own meshes, which are preferred."""

HEAD_BYTES = 10_000
"""Greatest length of a PLY file's header."""


def pose_of(matrix: ArrayLike) -> Pose:
    """A motion (4, 4) or (3, 4) in the form used by shots."""
    a, b, c = ((x, y, z, w) for x, y, z, w in np.asarray(matrix, np.float64)[:3].tolist())
    return a, b, c, IDENTITY[3]


def cameras_again(
    path: Path, shots: tuple[ListedShot, ...], root: Path, folders: Iterable[str], format_: str, up: Axis
) -> SourceCameras:
    """The cameras of a data set around the first mesh in these folders of `root`; the mesh, if any, is in the cameras' world.
    Raises StoreError without cameras, and for a mesh behind a link that leads out of the folder.
    """
    if not shots:
        raise StoreError(f"{path}: expected pictures with cameras; found none")
    meshes = tuple(_meshes(root, folders))
    name, notes = path.resolve().stem, list[str]()
    if not meshes:
        return SourceCameras(name, shots, {}, (format_,), up=up)
    mesh = SourceModel(meshes[0], "mesh")
    if len(meshes) > 1:
        notes.append(
            f"of {len(meshes)} meshes in the folder this is the first; the others: {', '.join(m.name for m in meshes[1:5])}"
        )
    there = (ListedObject(model=MESH, world_from_object=IDENTITY, scenery=True),)
    shown = tuple(shot.model_copy(update={"objects": there}) for shot in shots)
    return SourceCameras(name, shown, {MESH: mesh}, (format_,), up=up, notes=tuple(notes))


def _meshes(root: Path, folders: Iterable[str]) -> Iterator[Path]:
    for name in dict.fromkeys(folders):
        folder = file_inside(root, name) if name else root
        files = [file for file in sorted(folder.iterdir()) if file.suffix.lower() in ENDINGS] if folder.is_dir() else []
        for file in sorted(files, key=lambda file: (BEST.index(file.name) if file.name in BEST else len(BEST), file.name)):
            inside = file_inside(root, file.relative_to(root).as_posix())
            if inside.is_file() and (file.suffix.lower() != ".ply" or _has_faces(inside)):
                yield inside


def _has_faces(ply: Path) -> bool:
    """Return whether a PLY file is a mesh rather than a cloud of points."""
    with open_file(ply) as file:
        head, _, rest = file.read(HEAD_BYTES).partition(b"end_header")
    words = [line.split() for line in head.splitlines()]
    return bool(rest) and any(line[:2] == [b"element", b"face"] and line[2:] not in ([], [b"0"]) for line in words)
