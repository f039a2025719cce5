"""Scenes as meshes: a GLB file (glTF 2.0, y up) for each arrangement of objects, with what each object is.

    <index of its first frame>.glb   a node for each object, `extras`: id, category, category_id, supercategory, class, model
    frames.csv                       the scene of each frame

Frames of one arrangement share a file; of a sequence it is that of the first frame. What is no object, scenery and ground, is
left out, and so are objects whose place or model is not known, which imported data sets may have.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import xxhash

from viewsphere.assets.glb import Placed, scene_glb_bytes
from viewsphere.formats import Remark
from viewsphere.formats._contents import check_files
from viewsphere.model.classes import thing_class
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Dataset

HOLDS = ("scenes as meshes", "poses")
READ_BY = ("Blender", "trimesh", "any glTF viewer")
ANNOTATES = False  # what is hidden is part of a scene, too
CHANNELS = ()
CREDITS = False
TABLE = "frames.csv"
FOLDER_SIZE = 10_000
MESHES = 64
"""Models that are kept in memory."""


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[Sample], None]]:
    """Write scenes as their first frames come, and the table."""
    scenes = _Scenes(dataset)
    with (folder / TABLE).open("w", encoding="utf-8", newline="") as table:
        table.write(_HEAD)

        def add(sample: Sample) -> None:
            name, is_new = scenes.of(sample)
            if is_new:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(scenes.content(sample))
            table.write(_row(sample, name))

        yield add


def verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Scenes and rows that are not as they would be exported now."""
    scenes, rows, names = _Scenes(dataset), [_HEAD], [TABLE]
    for sample in dataset:
        name, is_new = scenes.of(sample)
        rows.append(_row(sample, name))
        if is_new:
            names.append(name)
            if (folder / name).is_file() and (folder / name).read_bytes() != scenes.content(sample):
                yield sample.index, f"{name}: expected the objects of its frame, found others: export again"
    yield from check_files(dataset, folder, (), (), names)
    if (folder / TABLE).is_file() and (folder / TABLE).read_bytes() != "".join(rows).encode():
        yield None, f"{TABLE}: expected the scenes of the frames, found others: export again"


_HEAD = "frame,scene\n"


def _row(sample: Sample, name: str) -> str:
    return f"{sample.index},{name}\n"


@dataclass(eq=False)
class _Scenes:
    """The files of scenes, by what is in them."""

    dataset: Dataset
    _files: dict[object, str] = field(default_factory=dict[object, str])

    def __post_init__(self) -> None:
        self._mesh = lru_cache(maxsize=MESHES)(self.dataset.mesh)

    def of(self, sample: Sample) -> tuple[str, bool]:
        """The file of a sample's scene, empty where it has none, and whether it is the first one there."""
        known = _known(sample)
        if not known:
            return "", False
        scene: object = sample.sequence
        if not scene:
            poses = xxhash.xxh3_128(b"".join(o.world_from_object.tobytes() for o in known)).digest()
            scene = (poses, *((o.id, o.key) for o in known))
        is_new = scene not in self._files
        if is_new:
            number = self.dataset.plan.folder_of(sample.index, FOLDER_SIZE)
            inside = "" if number is None else f"{number:04d}/"
            self._files[scene] = f"{inside}{sample.index:08d}.glb"
        return self._files[scene], is_new

    def content(self, sample: Sample) -> bytes:
        """The bytes of a sample's scene."""
        return scene_glb_bytes([self._placed(o) for o in _known(sample)])

    def _placed(self, o: ObjectAnnotation) -> Placed:
        extras = {
            "id": o.id,
            "category": o.category,
            "category_id": o.category_id,
            "supercategory": o.supercategory,
            "class": thing_class(o.category_id),
            "model": o.key,
        }
        return Placed(f"{o.id:03d} {o.category}", self._mesh(o.key), o.world_from_object, extras)


def _known(sample: Sample) -> list[ObjectAnnotation]:
    """The objects whose places and models are known."""
    return [o for o in sample.objects if o.is_placed and o.model and o.source is None]
