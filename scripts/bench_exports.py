"""What all formats of trainers, poses and 3D vision cost in one pass over frames of five objects, and what they encode of it.

CPU milliseconds a frame in one process. *Reading* is what every export needs once: records, and pixels of all channels. The
formats' own rows are what they make of a frame: JSON, polygons, PNG, HDF5, points; an encoding that several share counts once.
The rest links files, puts common files together and lists the digests of all.
"""

from __future__ import annotations

import resource
import time
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from viewsphere import Dataset, Recipe, generate
from viewsphere.recipe.formats import FormatEntry, read_formats
from viewsphere.run.preparing import targets
from viewsphere.store.checksums import write_checksums

TRAINERS = ("yolo", "voc", "coco", "coco_panoptic", "cityscapes", "mot", "imagefolder", "csv")
POSES = (
    "bop",
    "kitti",
    "nuscenes",
    "nocs",
    "omni3d",
    "falling_things",
    "pascal3d",
    "objectnet3d",
    "render_for_cnn",
    "nyc3dcars",
)
GEOMETRY = ("hdf5", "colmap", "nerfstudio", "tum", "opencv", "pointcloud", "gltf")
FORMATS = (*TRAINERS, *POSES, *GEOMETRY)
CHANNELS = ("rgb", "depth", "instances", "normals", "semantic", "panoptic", "nocs", "flow", "flow_backward")


def recipe(frames: int) -> Recipe:
    """Sequences of 20 instants with five moving cars."""
    motion = {"kind": "constant", "velocity": [0.3, -0.5, 0], "spin_deg": [0, 0, 15]}
    return Recipe.model_validate(
        {
            "name": "exports",
            "models": [{"source": "zoo:car", "category": "car", "count": 5, "scale": {"length": 1.8}, "motion": motion}],
            "scenes": {"count": max(1, frames // 20), "objects": 5},
            "viewpoints": {"kind": "orbit", "azimuth": [20, 30], "elevation": 30, "distance": 9},
            "time": {"frames": min(20, frames), "fps": 10},
            "camera": {"size": [640, 480], "fov_deg": 45},
            "channels": list(CHANNELS),
            "annotations": ["amodal", "occluders", "keypoints", "truncation_level", "occlusion_level"],
            "formats": [],
            "splits": {"by": "sequence"},
        }
    )


class Times:
    """CPU seconds by name; what is timed within another is not counted there."""

    def __init__(self) -> None:
        self.of: defaultdict[str, float] = defaultdict(float)
        self._inner = [0.0]

    @contextmanager
    def timed(self, name: str) -> Generator[None]:
        begun = time.process_time()
        self._inner.append(0.0)
        try:
            yield
        finally:
            took = time.process_time() - begun
            self.of[name] += took - self._inner.pop()
            self._inner[-1] += took


def timed_links(times: Times) -> None:
    """Time what `Dataset.link` takes by itself."""
    plain = Dataset.link

    def link(self: Dataset, *args: Any) -> Any:
        with times.timed("links"):
            return plain(self, *args)

    Dataset.link = link  # pyright: ignore[reportAttributeAccessIssue]


def exported(dataset: Dataset, entries: tuple[FormatEntry, ...], folder: Path, times: Times) -> None:
    """What `viewsphere.run.exporting.write` does, in its order, with a clock at each of its steps."""
    places = [(entry, folder / entry.name) for entry in entries]
    for _, place in places:
        place.mkdir(parents=True)
    found = targets(dataset, places)
    with ExitStack() as finish:
        finish.enter_context(times.timed("common files"))
        adds = {target.entry.name: finish.enter_context(target.writer(lambda _: None)) for target in found}
        preparers = {target.entry.name: target.preparer() for target in found}
        for sample in _read(dataset, times):
            for name, prepare in preparers.items():
                with times.timed(name):
                    part = prepare(sample)
                adds[name](part)
    with times.timed("digests"):
        for entry, place in places:
            write_checksums(place, entry.whole().options, None, None, len(dataset))


def _read(dataset: Dataset, times: Times) -> Iterator[Any]:
    samples = iter(dataset)
    while True:
        with times.timed("reading"):
            sample = next(samples, None)
            for name in sample.channels if sample is not None else ():
                getattr(sample, name)
        if sample is None:
            return
        yield sample


def exports(frames: int, folder: Path) -> None:
    """Print the table for so many frames; all is made in this empty folder."""
    generate(recipe(frames), folder / "out", workers=2)
    entries = read_formats(FORMATS)
    dataset, times = Dataset(folder / "out"), Times()
    timed_links(times)
    begun = time.process_time()
    exported(dataset, entries, folder / "all", times)
    whole, count = time.process_time() - begun, len(dataset)
    encoding = sum(times.of[entry.name] for entry in entries)
    print(f"\n{count} frames, {len(entries)} formats\n\n| | CPU ms a frame |\n|---|---:|")
    for name, took in sorted(times.of.items(), key=lambda row: -row[1]):
        print(f"| {name} | {1000 * took / count:.2f} |")
    print(f"| all | {1000 * whole / count:.2f} |")
    once = encoding + times.of["reading"]
    print(f"\nall / (encoding + reading once): {whole / once:.3f}; all / encoding: {whole / encoding:.3f}")
    print(f"most memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
