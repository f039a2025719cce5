"""Scenes as meshes: a GLB file (glTF 2.0, y up) for each arrangement of objects, with their annotations and cameras.

    <index of its first frame>.glb   a node for each object, `extras`: id, category, category_id, supercategory, class, model;
                                     and one for each picture's camera, `extras`: frame, sensor, split, time, width, height,
                                     K, distortion
    frames.csv                       the scene of each frame

Frames of one arrangement share a file. A sequence's file shows its first frame and holds the cameras of all frames. Scenery and
ground are left out, and so are objects without a known place or model, which imported data sets may have.

Lengths are metres. A camera looks along -z of its node, y up, as in glTF, and is called `<frame> <sensor>`; its vertical angle
follows from fy. glTF's cameras have no offset principal point, skew or distortion. These are in `extras` alone: K in pixels
from the image's corner, distortion in OpenCV's order. LiDARs have no cameras. Source:
https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xxhash

from viewsphere.assets.exporting.glb import Looking, Placed, scene_glb_bytes
from viewsphere.files import read_bytes, read_text
from viewsphere.formats import Scope
from viewsphere.formats.shared.cameras import opengl_pose
from viewsphere.formats.shared.writing.export_files import check_files
from viewsphere.formats.shared.writing.refusals import any_camera
from viewsphere.model.annotations.classes import thing_class
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

TABLE = "frames.csv"
FOLDER_SIZE = 10_000
MESHES = 64
"""Number of models to keep in memory."""


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: no picture has a known camera."""
    yield from any_camera(scope)


@contextmanager
def _writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[Sample], None]]:
    """Write the table, and, when all cameras are known, the scenes."""
    with temporary("cameras") as scratch_folder, (folder / TABLE).open("w", encoding="utf-8", newline="") as table:
        scenes = _Scenes(dataset, scratch_folder)
        table.write(_HEAD)

        def add(sample: Sample) -> None:
            table.write(_row(sample, scenes.add(sample)))

        yield add
        for _, name, content in scenes.files():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Yield scenes and rows that differ from the current export."""
    with temporary("cameras") as scratch_folder:
        scenes = _Scenes(dataset, scratch_folder)
        rows = [_HEAD, *(_row(sample, scenes.add(sample)) for sample in dataset)]
        names = [TABLE]
        for frame, name, content in scenes.files():
            names.append(name)
            if (folder / name).is_file() and read_bytes(folder / name) != content:
                yield frame, f"{name}: expected the objects and cameras of its frames, found others: export again"
    yield from check_files(dataset, folder, (), (), names)
    if (folder / TABLE).is_file() and read_bytes(folder / TABLE) != "".join(rows).encode():
        yield None, f"{TABLE}: expected the scenes of the frames, found others: export again"


_HEAD = "frame,scene\n"


def _row(sample: Sample, name: str) -> str:
    return f"{sample.index},{name}\n"


@dataclass(eq=False)
class _Scenes:
    """The files of scenes by their contents, with the number of each scene's first sample, from 0. Cameras wait in a separate
    folder.
    """

    dataset: Dataset
    scratch_folder: Path
    _files: dict[object, tuple[str, int]] = field(default_factory=dict[object, tuple[str, int]])
    _count: int = 0

    def __post_init__(self) -> None:
        self._mesh = lru_cache(maxsize=MESHES)(self.dataset.mesh)

    def add(self, sample: Sample) -> str:
        """Return the file of the next sample's scene; empty for a sample without one."""
        known, place = _known(sample), self._count
        self._count += 1
        if not known:
            return ""
        scene: object = sample.sequence
        if not scene:
            poses = xxhash.xxh3_128(b"".join(o.world_from_object.tobytes() for o in known)).digest()
            scene = (poses, *((o.id, o.key) for o in known))
        number = self.dataset.plan.folder_of(sample.index, FOLDER_SIZE)
        inside = "" if number is None else f"{number:04d}/"
        name, first = self._files.setdefault(scene, (f"{inside}{sample.index:08d}.glb", place))
        if (camera := _looking(sample)) is not None:
            with (self.scratch_folder / str(first)).open("a", encoding="utf-8", newline="") as file:
                file.write(json.dumps(asdict(camera), default=np.ndarray.tolist) + "\n")
        return name

    def files(self) -> Iterator[tuple[int, str, bytes]]:
        """The first frame of each scene, the scene's file, and its contents."""
        for name, first in self._files.values():
            sample, kept = self.dataset[first], self.scratch_folder / str(first)
            lines = read_text(kept).splitlines() if kept.is_file() else []
            cameras = (_read(json.loads(line)) for line in lines)
            yield sample.index, name, scene_glb_bytes([self._placed(o) for o in _known(sample)], cameras)

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
    """The objects with known positions and models."""
    return [o for o in sample.objects if o.is_placed and o.model and o.source is None]


def _looking(sample: Sample) -> Looking | None:
    """A sample's camera; None if it is unknown or a LiDAR."""
    camera = sample.known_camera
    if camera is None or camera.lens.is_scan:
        return None
    lens = camera.intrinsics
    extras = {
        "frame": sample.index,
        "sensor": sample.sensor,
        "split": sample.split,
        "time": sample.time,
        "width": lens.width,
        "height": lens.height,
        "K": lens.K.tolist(),
        "distortion": camera.lens.record,
    }
    yfov, aspect = 2 * math.atan(lens.height / 2 / lens.fy), (lens.width / lens.fx) / (lens.height / lens.fy)
    return Looking(f"{sample.index:08d} {sample.sensor}", opengl_pose(camera), yfov, aspect, extras)


def _read(kept: dict[str, Any]) -> Looking:
    pose = np.array(kept.pop("world_from_camera"))
    return Looking(world_from_camera=pose, **kept)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("scenes as meshes", "poses", "cameras"),
    read_by=("Blender", "trimesh", "any glTF viewer"),
    channels=(),
    keeps_all_objects=True,  # hidden objects are part of a scene, too
    names_credits=False,
    refuses=_refuses,
    writer=_writer,
    verify=_verify,
)
