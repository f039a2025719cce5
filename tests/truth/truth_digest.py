"""Digests of truth over random scenes, and what they took; `scripts/numba_releases` compares them from numba to numba.

python truth_digest.py    # one line of JSON
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import time

import numpy as np
from numba.core import event

import viewsphere as vs
from truth_scenes import LENSES, cube, lens, orbit_camera, placed, random_soup, silhouette, sphere
from viewsphere.kernels.build import IS_STOCK, NUMBA
from viewsphere.labels import LidarScan, channel_labels, observe, requires
from viewsphere.truth.raster.visibility import rasterize

LABELS = [name for name, label in channel_labels().items() if not label.needs]
"""Those that still pictures of one sensor have."""
ALL = [name for name, label in channel_labels().items() if name != "tracks" and not requires(label.needs, LidarScan)]
"""Those of cameras; a recipe with tracks keeps tracks anyway."""
SEEDS = range(3)
VOXELS = {"size": [80, 48, 80], "cell": 0.06}
"""A grid as large as usual, of 27 times fewer cells: half a million would take longer than all other labels."""
RECIPES = (
    {
        "models": [{"source": "zoo:car", "count": 2}],
        "viewpoints": {"azimuth": 20, "elevation": 8, "distance": 9},
        "scene": {"place": {"source": "zoo:neighbourhood", "labels": "own"}, "company": 1},
    },
    {
        "models": [{"source": "zoo:tree", "count": 2}],
        "viewpoints": {"azimuth": 90, "elevation": [10, 90], "distance": 9, "tilt": 10},
        "camera": {"distortion": {"model": "brown_conrady", "coefficients": [-0.21, 0.06, 0.001, -0.002, -0.004]}},
        "scene": {"company": 1, "ground": "on"},
    },
    {
        "models": [{"source": "zoo:car", "motion": {"kind": "constant", "velocity": [1, -2, 0], "spin_deg": [0, 0, 20]}}],
        "viewpoints": {"kind": "orbit", "azimuth": [20, 60], "elevation": 12, "distance": 8, "shake": {"degrees": 1}},
        "time": {"frames": 3, "fps": 5},
        "rig": {"kind": "stereo", "baseline": 0.2},
        "tracks": {"grid": 8, "at": [0, 2]},
        "scene": {"ground": "on"},
        "channels": ALL,
    },
    {
        "models": [{"source": "zoo:tree", "motion": {"kind": "oscillate", "rotation_deg": [3, 2, 0], "period": 2}}],
        "viewpoints": {"azimuth": 0, "elevation": 20, "distance": 9},
        "camera": {"distortion": {"model": "fisheye", "coefficients": [0.02, -0.01, 0.003, 0]}},
        "time": {"frames": 2},
        "tracks": {"count": 500, "at": "each"},
        "channels": [name for name in ALL if not name.startswith("disparity")],
    },
)
"""Cars on a street, behind what stands there; leaves that are cut out of pictures, seen through a lens; a car that drives
before a pair of cameras; leaves in the wind, seen through a fisheye.
"""


def visibility_digest() -> str:
    """Of the visibility buffers and all channels of soups of triangles, seen through each lens from in and outside."""
    seen = hashlib.sha256()
    for seed in SEEDS:
        for name in LENSES:
            rng = np.random.default_rng(seed)
            soups = random_soup(rng, 200), random_soup(rng, 200, spread=1.0), sphere(3, 0.8), cube(0.7)
            geometry = placed(*soups, ground=seed % 2 == 0, scenery=1)
            fov = math.radians(rng.uniform(20, 100) if name != "fisheye" else rng.uniform(100, 250))
            intrinsics = lens(120, 90, fov, LENSES[name], skew=rng.uniform(-2, 2))
            camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), 10 ** rng.uniform(-1, 1), tilt=rng.uniform(-1, 1))
            whole, alone = rasterize(geometry, camera), rasterize(geometry, camera, subdivision=2, object_id=2)
            arrays = [whole.triangle, whole.inverse_depth, alone.triangle, alone.inverse_depth]
            arrays.append(silhouette(geometry, camera, 1, (-120, -90, 240, 180)))
            add(seen, [arrays, observe(geometry, camera, whole, LABELS, options={"voxels": VOXELS})])
    return seen.hexdigest()


def sample_digest() -> str:
    """Of all channels and annotations of recipes' frames."""
    seen = hashlib.sha256()
    for recipe in RECIPES:
        camera = {"size": [320, 240], "fov_deg": 50, **recipe.get("camera", {})}
        whole = {"channels": LABELS, "labels": {"voxels": VOXELS}, "splits": {"by": "frame"}, **recipe, "camera": camera}
        for sample in vs.render(vs.Recipe.model_validate(whole)):
            add(seen, [dict(sample.channels), sample.objects, [each.polygons for each in sample.objects]])
    return seen.hexdigest()


def add(seen, value) -> None:
    """Add a value's kind and all of its bits to a digest."""
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        seen.update(repr((value.dtype.str, value.shape)).encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, dict):
        add(seen, [part for name in sorted(value) for part in (name, value[name])])
    elif isinstance(value, list | tuple):
        seen.update(b"[%d" % len(value))
        for part in value:
            add(seen, part)
    else:
        seen.update(repr(value).encode())


class Compiling(event.Listener):
    """The CPU seconds of numba's compiler."""

    def __init__(self) -> None:
        self.seconds, self.depth = 0.0, 0

    def on_start(self, event) -> None:
        self.seconds -= 0 if self.depth else time.process_time()
        self.depth += 1

    def on_end(self, event) -> None:
        self.depth -= 1
        self.seconds += 0 if self.depth else time.process_time()


def measured() -> dict[str, object]:
    """The digests, and the CPU seconds of compiling and of the rest."""
    begun, compiling = time.process_time(), Compiling()
    with event.install_listener("numba:compile", compiling):
        found = {"visibility": visibility_digest(), "samples": sample_digest()}
    drawing = time.process_time() - begun - compiling.seconds
    return {"numba": NUMBA, "stock": IS_STOCK, "compiling": compiling.seconds, "drawing": drawing, **found}


if __name__ == "__main__":
    print(json.dumps(measured()))
