"""A cache of normalised meshes by content: a model is read once, and again when any of its files, settings or readers change.

An entry is two files: `<first>.arrays` lists the files that the model named when it was last read, and `<second>.arrays` holds
the mesh. The first name is the digest of the model's bytes, its settings and the readers; the second adds the bytes of the
files listed. So an entry is never stale, and two folders with equal files share it. Models that are not in the cache are read
in a separate process (`sandbox`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, cast

import numpy as np

from viewsphere.assets.load import check_source, suffix_of
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.mesh_file import read_mesh, unpacked
from viewsphere.assets.normalise import normalise, placed
from viewsphere.assets.parts import selected_parts
from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.primitive import FileFacts, extents
from viewsphere.assets.readers import third_party_sources
from viewsphere.assets.sandbox.client import read_apart
from viewsphere.caches import cache_of
from viewsphere.caches.entries import SUFFIX, publish, read_entry, sweep_once, write_entry
from viewsphere.errors import ModelError
from viewsphere.files import open_file, read_bytes
from viewsphere.limits import limits
from viewsphere.model.annotations.keypoints import At, Keypoints, Pair, Place, left_and_right
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.plugins import checked
from viewsphere.plugins.source import Named, SourceSpec, family_of, source_of
from viewsphere.scratch import scratch_folder, temporary

SETTINGS = ("up", "forward", "unit", "centring", "scale", "real_size", "confined", "clip", "fps", "shown")
PREFIX = "reading-"
BATCH = 32
"""Greatest number of frames of a file that are read at once."""

LIBRARIES = ("numpy", "lxml", "pillow", "charset-normalizer", "DracoPy", "meshopt", "opengl_basisu", "usd-core")
"""Packages that parse model files. A model whose reader lacked one of the optional ones is read again once it is installed."""


def load_normalised(
    spec: ModelSpec,
    folder: Path | None = None,
    step: TimeStep | None = None,
) -> Mesh:
    """The model in object axes and metres: the mesh that `load` gives."""
    return load(spec, folder, step)[0]


def load(
    spec: ModelSpec,
    folder: Path | None = None,
    step: TimeStep | None = None,
) -> tuple[Mesh, FileFacts]:
    """The model in object axes and metres at a time step (None: at rest), and the facts in its file; from the cache if it holds
    them.

    A source of models supplies a mesh, or a file to read in its place. Such meshes are normalised, too, but not cached here and
    not made in another process. `folder` is the cache's, by default `cache_folder()`. A damaged entry is rebuilt; a cache that
    cannot be written is not an error. Every array read back is equal bit for bit. Raises ModelError as the readers do, and if
    reading takes too much time or memory.
    """
    frame = frame_of(spec, step)
    if spec.parts is not None:
        whole, facts = load(spec.whole, folder, None if frame is None else TimeStep(frame=frame))
        return selected_parts(whole, spec, step), facts
    named = source_of(spec.source)
    if named is not None:
        built = _built(spec, named)
        if isinstance(built, Path):
            return load(_in_file(spec, built), folder, step)
        raw, facts = built, _facts(spec, named, built)
        return normalise(raw, facts, spec), placed(raw, facts, spec)
    path, inside = split_source(Path(spec.source))
    folder = folder or cache_folder()
    check_source(path)
    try:
        first = _first_digest(path, inside, spec, frame)
    except OSError:
        first = None  # the reader reports the file's problem
    stored = None if first is None else _stored(folder, first, path)
    if stored is not None:
        return stored
    with _aside(folder) as place:
        (file,), named = read_apart(spec, () if frame is None else (frame,), place)
        mesh, facts = read_mesh(file, path)
        facts = replace(facts, files=_located(path, _names(path, named)))  # as the cache has them
        if first is not None:
            _store(folder, first, path, named, file)
    return mesh, facts


def frame_of(spec: ModelSpec, step: TimeStep | None) -> int | None:
    """The frame of its file for a model at a time step (None: at rest); None if the file is read without an animation frame."""
    return spec.rest if step is None else step.frame


def read_ahead(spec: ModelSpec, frames: Iterable[int], folder: Path | None = None) -> None:
    """Add the missing ones of these frames of an animated model to the cache, opening the file once for many frames.

    Raises ModelError as `load` does; a cache that cannot be written is not an error.
    """
    folder = folder or cache_folder()
    spec = spec if spec.parts is None else spec.whole
    named = source_of(spec.source)
    if named is not None:
        built = _built(spec, named)
        spec = _in_file(spec, built) if isinstance(built, Path) else spec
    path, inside = split_source(Path(spec.source))
    lacking: dict[int, str] = {}
    with suppress(OSError):
        for frame in frames:
            first = _first_digest(path, inside, spec, frame)
            if not _is_stored(folder, first, path):
                lacking[frame] = first
    for batch in _batches(sorted(lacking)):
        with _aside(folder) as place:
            files, named = read_apart(spec, batch, place)
            for frame, file in zip(batch, files, strict=True):
                _store(folder, lacking[frame], path, named, file)


def cached_facts(path: Path, about: str, ask: Callable[[], tuple[Any, Iterable[Path]]]) -> Any:
    """Return the plain data that `ask` computes from a file, from the cache while the file is unchanged. `ask` also returns the
    files that it read, which must be unchanged, too.
    """
    try:
        with open_file(path) as file:
            own = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ask()[0]
    sources = " ".join(hashlib.sha256(read_bytes(source)).hexdigest() for source in third_party_sources(suffix_of(path)))
    name = hashlib.sha256(f"{readers_digest()} {sources} {about} {path.name} {own}".encode()).hexdigest()
    entry = _named(cache_folder(), name)
    held = read_entry(entry)
    with suppress(ValueError, TypeError, KeyError):
        if held is not None and held.about["state"] == _second_digest(own, path, held.about["files"]):
            return held.about["told"]
    told, files = ask()
    names = _names(path, files)
    write_entry(entry, {"told": told, "files": names, "state": _second_digest(own, path, names)}, {})
    return told


def _batches(frames: Sequence[int]) -> Iterable[Sequence[int]]:
    """Batches of frames, small enough to limit disk use, and large enough to make opening the file cheap."""
    return (frames[i : i + BATCH] for i in range(0, len(frames), BATCH)) if len(frames) > 1 else ()


@contextmanager
def _aside(folder: Path) -> Generator[Path]:
    """A temporary folder in the cache, or in the system's temporary folder if the cache cannot be written."""
    with ExitStack() as then:
        then.callback(sweep_once, folder, PREFIX, os.getpid())
        try:
            folder.mkdir(parents=True, exist_ok=True)
            place = then.enter_context(scratch_folder(folder, PREFIX))
        except OSError:
            place = then.enter_context(temporary("reading"))
        yield place


def _in_file(spec: ModelSpec, file: Path) -> ModelSpec:
    """The specification for the file that a source of models supplies, from the specification of the source's model."""
    return spec.model_copy(update={"source": str(file)})


def _built(spec: ModelSpec, named: Named) -> Mesh | Path:
    """The mesh or file that a source supplies; raises PluginError if it supplies something else."""
    try:
        return checked(SourceSpec, named.prefix, "load", named.spec.load(spec), Mesh, Path)
    except OSError as error:
        raise ModelError(f"{spec.source}: expected to write its file into the cache ({error}); set VIEWSPHERE_CACHE") from None


def _facts(spec: ModelSpec, named: Named, mesh: Mesh) -> FileFacts:
    family = family_of(spec.source)
    points = None if family is None else _part_points(mesh, family.keypoints, family.skeleton)
    return FileFacts(Path(spec.source), named.prefix, "+z", "-y", 1.0, size=extents(mesh), keypoints=points)


def cache_folder() -> Path:
    """Return the folder of cached models: `$VIEWSPHERE_CACHE/models`, else a folder in the user's cache folder."""
    return cache_of("models")


def _first_digest(path: Path, inside: tuple[str, ...], spec: ModelSpec, frame: int | None) -> str:
    if not path.is_file() or path.stat().st_size > limits.MAX_FILE_BYTES:
        raise FileNotFoundError(path)
    digest = hashlib.sha256(readers_digest().encode())
    digest.update(f"{frame} {spec.model_dump_json(include=set(SETTINGS))}".encode())
    for source in third_party_sources(suffix_of(path)):
        digest.update(read_bytes(source))
    digest.update(path.suffix.lower().encode() + path.name.encode() + b"\0".join(text.encode() for text in inside))
    with open_file(path) as file:
        digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


@cache
def readers_digest() -> str:
    """Digest of this package's and Blender's worker's sources, and of the versions of the `LIBRARIES`."""
    digest = hashlib.sha256()
    for library in LIBRARIES:
        try:
            digest.update(f"{library} {version(library)};".encode())
        except PackageNotFoundError:
            digest.update(f"{library} unknown;".encode())
    own = Path(__file__).parent
    for source in [*sorted(own.rglob("*.py")), *sorted((own.with_name("blender") / "worker").rglob("*.py"))]:
        digest.update(read_bytes(source))
    return digest.hexdigest()


def _second_digest(first: str, path: Path, names: Iterable[str]) -> str:
    digest = hashlib.sha256(first.encode())
    for name in names:
        digest.update(name.encode(errors="surrogateescape") + b"\0")
        other = path.parent / name
        try:
            if not other.is_file():  # reading a pipe would never end
                raise FileNotFoundError(other)
            with open_file(other) as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
        except (OSError, ValueError):
            digest.update(b"absent")
    return digest.hexdigest()


def _is_stored(folder: Path, first: str, path: Path) -> bool:
    held = read_entry(_named(folder, first))
    with suppress(ValueError, TypeError):
        return held is not None and _named(folder, _second_digest(first, path, held.about)).is_file()
    return False


def _stored(folder: Path, first: str, path: Path) -> tuple[Mesh, FileFacts] | None:
    """The mesh in the cache and its facts, None if they are missing or damaged."""
    try:
        names = read_entry(_named(folder, first))
        held = None if names is None else read_entry(_named(folder, _second_digest(first, path, names.about)))
        if names is None or held is None:
            return None
        mesh, facts = unpacked(held, path)
        return mesh, replace(facts, files=_located(path, names.about))
    except Exception:  # an entry with any problem is rebuilt
        return None


def _named(folder: Path, name: str) -> Path:
    return folder / f"{name}{SUFFIX}"


def _names(path: Path, files: Iterable[Path]) -> list[str]:
    """Paths of files that a model depends on, relative to its own folder."""
    root = os.path.realpath(path.parent)
    return sorted({_from(root, os.path.realpath(file)).replace(os.sep, "/") for file in files})


def _located(path: Path, names: Iterable[str]) -> tuple[Path, ...]:
    """The files of these names beside a model."""
    return tuple(path.parent / name for name in names)


def _from(root: str, file: str) -> str:
    try:
        return os.path.relpath(file, root)
    except ValueError:  # on another drive of Windows
        return file


def _store(folder: Path, first: str, path: Path, files: Iterable[Path], mesh: Path) -> None:
    """Move a mesh's file into the cache; each of the two files appears completely or not at all."""
    names = _names(path, files)
    with suppress(OSError):
        publish(mesh, _named(folder, _second_digest(first, path, names)))
        write_entry(_named(folder, first), names, {})


def _part_points(mesh: Mesh, places: Mapping[str, At], skeleton: Sequence[Pair] = ()) -> Keypoints | None:
    """The points of a mesh, in its axes, for the parts that it has, and the lines between them; None without any."""
    found = {name: place for name, at in places.items() if (place := _place(mesh, at)) is not None}
    if not found:
        return None
    lines = tuple(pair for pair in skeleton if found.keys() >= {*pair})
    return Keypoints(points=found, skeleton=lines, flips=left_and_right(found))


def _place(mesh: Mesh, at: At) -> Place | None:
    part = next((mesh.parts.index(name) for name in at.parts.split("|") if name in mesh.parts), None)
    if part is None:
        return None
    corners = mesh.vertices[mesh.triangles[mesh.triangle_part == part]].astype(np.float64).reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    place = (low + high) / 2 + np.array(at.where) * (high - low) / 2
    if np.count_nonzero(at.where) > 1:
        place = corners[((corners - place) ** 2).sum(axis=1).argmin()]
    return cast("Place", tuple(place.tolist()))
