"""The cost of all formats of trainers, poses and 3D vision in one pass over frames of five objects, and the encoders' share.

CPU milliseconds a frame in one process. *Reading* is what every export needs once: records, and pixels of all channels. The
formats' own rows are what they make of a frame: JSON, polygons, PNG, HDF5, points; an encoding that several share counts once.
The rest links files, puts common files together and lists the digests of all.
"""

from __future__ import annotations

import resource
import time
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from viewsphere import Dataset, Recipe, export, generate
from viewsphere.run.exports.preparing import Target

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
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._inner = [0.0]

    @contextmanager
    def timed(self, name: str) -> Generator[None]:
        begun = time.process_time()
        self._inner.append(0.0)
        try:
            yield
        finally:
            took = time.process_time() - begun
            self.seconds[name] += took - self._inner.pop()
            self._inner[-1] += took


@contextmanager
def clocks(times: Times) -> Generator[None]:
    """Measure the times of reading, making and linking in exports during this block."""
    read, link, preparer = Dataset.samples_of, Dataset.link, Target.preparer

    def timed_read(self: Dataset, *args: Any) -> Iterator[Any]:
        samples = read(self, *args)
        while True:
            with times.timed("reading"):
                sample = next(samples, None)
                for name in sample.channels if sample is not None else ():
                    getattr(sample, name)
            if sample is None:
                return
            yield sample

    def timed_link(self: Dataset, *args: Any) -> Any:
        with times.timed("links"):
            return link(self, *args)

    def timed_preparer(self: Target) -> Any:
        prepare = preparer(self)

        def timed(sample: Any) -> Any:
            with times.timed(self.entry.name):
                return prepare(sample)

        return timed

    with (
        patch.object(Dataset, "samples_of", timed_read),
        patch.object(Dataset, "link", timed_link),
        patch.object(Target, "preparer", timed_preparer),
    ):
        yield


def exports(frames: int, folder: Path) -> None:
    """Print the table for so many frames; all is made in this empty folder."""
    generate(recipe(frames), folder / "out", workers=2)
    times = Times()
    with clocks(times), times.timed("common files and digests"):
        export(folder / "out", FORMATS, output=folder / "all")
    made, whole = sum(times.seconds[name] for name in FORMATS), sum(times.seconds.values())
    print(f"\n{frames} frames, {len(FORMATS)} formats\n\n| | CPU ms a frame |\n|---|---:|")
    for name, took in sorted(times.seconds.items(), key=lambda row: -row[1]):
        print(f"| {name} | {1000 * took / frames:.2f} |")
    print(f"| all | {1000 * whole / frames:.2f} |")
    once = made + times.seconds["reading"]
    print(f"\nall / (made + read once): {whole / once:.3f}; all / made: {whole / made:.3f}")
    print(f"most memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
