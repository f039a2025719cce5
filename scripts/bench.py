"""The benchmark behind every speed claim: ratios inside one run, CPU time over all threads, medians over frames.

Reference scene: a zoo car subdivided to at least 75,000 triangles on a ground plane, sun shadow, sky, 640x480,
4x edge anti-aliasing; files: RGB PNG, instance PNG, float32 depth and normals TIFF, annotations.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere import Recipe, generate, plan, plugins
from viewsphere.annotate import annotate
from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.box import box_vertices
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Frame, Shot
from viewsphere.run.stages import Stages
from viewsphere.sampling.viewpoints import camera_for
from viewsphere.store import Store
from viewsphere.truth.channels import observe
from viewsphere.truth.visibility import rasterize

ROOT = Path(__file__).parent.parent
TRIANGLES = 75_000
VERTEX_FIELDS = ("vertices", "normals", "uv0", "uv1", "colors")


def reference_recipe(frames: int, antialias: int) -> Recipe:
    return Recipe(
        name="bench",
        models=[{"source": "zoo:car", "category": "car", "count": 1, "scale": {"length": 4.3}}],
        viewpoints={
            "azimuth": [360 * i / frames for i in range(frames)],
            "elevation": [20],
            "distance": 9.0,
        },
        camera={"size": [640, 480], "fov_deg": 40},
        scene={"ground": True},
        engine={"name": "raster", "antialias": antialias},
        channels=["rgb", "depth", "instances", "normals"],
        formats=[],
    )


def subdivide(mesh: Mesh) -> Mesh:
    """Halve the longest edges, of both triangles that share them, until there are about enough triangles.

    Vertices are numbered in order of use, as in any file.
    """
    while len(mesh.triangles) < TRIANGLES:
        edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        ends = mesh.vertices[edges]
        lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        lacking = TRIANGLES - len(mesh.triangles)
        longest = np.sort(lengths)[-min(max(lacking, 1), len(lengths) // 4)]
        pairs, inverse = np.unique(edges[lengths >= longest], axis=0, return_inverse=True)
        middles = np.full(len(edges), -1)
        middles[lengths >= longest] = len(mesh.vertices) + inverse.reshape(-1)
        triangles, source = split_triangles(mesh.triangles, middles.reshape(-1, 3))
        mesh = replace(
            mesh,
            triangles=triangles,
            triangle_material=mesh.triangle_material[source],
            triangle_part=mesh.triangle_part[source],
            **{name: with_means(getattr(mesh, name), pairs) for name in VERTEX_FIELDS},
        )
    used, first, inverse = np.unique(mesh.triangles, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order).astype(np.int32)
    fields = {name: getattr(mesh, name) for name in VERTEX_FIELDS}
    moved = {name: None if values is None else values[used[order]] for name, values in fields.items()}
    return replace(mesh, triangles=rank[inverse].reshape(-1, 3), **moved)


def split_triangles(triangles: Any, middles: Any) -> tuple[Any, Any]:
    """Triangles cut at the middles (T, 3) of their edges 01, 12, 20 (-1: not cut), and the triangle each came from."""
    corners, sources = [], []
    for t, (corner, middle) in enumerate(zip(triangles.tolist(), middles.tolist(), strict=True)):
        ring = [v for pair in zip(corner, middle, strict=True) for v in pair if v >= 0]
        start = ring.index(next((m for m in middle if m >= 0), ring[0]))
        fan = ring[start:] + ring[:start]
        pieces = [(fan[0], fan[k], fan[k + 1]) for k in range(1, len(fan) - 1)]
        corners += pieces
        sources += [t] * len(pieces)
    return np.array(corners, np.int32), np.array(sources)


def with_means(values: Any, pairs: Any) -> Any:
    """Per-vertex values and, behind them, the means of these pairs of vertices."""
    return None if values is None else np.concatenate([values, values[pairs].mean(axis=1, dtype=np.float32)])


class Clock:
    """CPU milliseconds of this process, all threads, by stage."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}

    def __call__(self, name: str, work: Callable[[], Any]) -> Any:
        begun = time.process_time()
        result = work()
        self.times.setdefault(name, []).append(1e3 * (time.process_time() - begun))
        return result

    def median(self, name: str) -> float:
        return float(np.median(self.times[name]))


def embree_scene(geometry: Any) -> Any:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices[geometry.triangles].astype(np.float32))
    return scene


def embree_frame(scene: Any, camera: Any) -> Any:
    """One ray a pixel with camera-space z = 1, so that hit distance is z-depth; building the rays is part of the price."""
    x = ((np.arange(camera.width) + 0.5 - camera.K[0, 2]) / camera.K[0, 0]).astype(np.float32)
    y = ((np.arange(camera.height) + 0.5 - camera.K[1, 2]) / camera.K[1, 1]).astype(np.float32)
    r = camera.R.astype(np.float32)
    directions = (x[None, :, None] * r[0] + (y[:, None, None] * r[1] + r[2])).reshape(-1, 3)
    origins = np.tile(camera.center.astype(np.float32), (len(directions), 1))
    return scene.run(origins, directions, output=True)


def measure(frames: int, antialias: int, folder: Path) -> Clock:
    clock = Clock()
    planned = clock("plan (273,600 frames)", lambda: plan(Recipe.load(ROOT / "recipes" / "car_poses.yaml")))
    clock("plan, all of its shots", lambda: sum(1 for _ in planned.shots()))
    shot = next(iter(plan(reference_recipe(frames, antialias), shot_frames=frames).shots()))
    mesh = subdivide(Stages().model(shot.placements[0].model))
    engine: plugins.Engine = plugins.load("engines", "raster")
    store = Store(folder)
    (folder / "store" / "writing").mkdir(parents=True)
    warm_up = engine.stage(shot, lambda spec: mesh)  # compiles, or reads the cache
    one_frame(Clock(), shot, shot.frames[0], warm_up, mesh, store, None)
    stage = clock("stage (once a shot)", lambda: engine.stage(shot, lambda spec: mesh))
    try:
        scene = embree_scene(stage.geometry)
    except ImportError:
        scene = None
    for frame in shot.frames:
        one_frame(clock, shot, frame, stage, mesh, store, scene)
    print(f"scene: {len(mesh.triangles):,} triangles + ground, 640x480, antialias {antialias}")
    return clock


def one_frame(clock: Clock, shot: Shot, frame: Frame, stage: plugins.Stage, mesh: Mesh, store: Store, scene: Any) -> None:
    """One frame stage by stage, and Embree's rays for the same one."""
    boxes = [box_vertices(*mesh.bounds)]
    camera = camera_for(shot.intrinsics, frame.pose, boxes[0].mean(axis=0))
    begun = time.process_time()
    visibility = clock("truth: raster", lambda: rasterize(stage.geometry, camera))
    names = ["depth", "instances", "normals"]
    observed = clock("truth: channels", lambda: observe(stage.geometry, camera, visibility, names))
    observed["rgb"] = clock("colour", lambda: stage.color(camera, frame, visibility))
    objects = clock("annotations", lambda: annotate(shot, frame, camera, stage.geometry, visibility, boxes, ["model.obj"]))
    sample = Sample(frame.index, "train", camera, frame.pose, objects, observed, {})
    clock("files", lambda: store.write_shot(f"{id(clock)}-{frame.index}", [sample]))
    clock.times.setdefault("whole frame", []).append(1e3 * (time.process_time() - begun))
    if scene is not None:
        clock("Embree, one ray a pixel", lambda: embree_frame(scene, camera))


def throughput(folder: Path, frames: int, workers: int) -> float:
    """Frames a second on the wall clock of a whole run with files, start of the workers included."""
    begun = time.monotonic()
    generate(reference_recipe(frames, 4), folder, workers=workers)
    return frames / (time.monotonic() - begun)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--frames", type=int, default=36)
    options.add_argument("--antialias", type=int, default=4, choices=(1, 4))
    options.add_argument("--json", type=Path, help="write the figures here too")
    args = options.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    with tempfile.TemporaryDirectory() as folder:
        clock = measure(args.frames, args.antialias, Path(folder))
        rates = {n: throughput(Path(folder) / f"run{n}", 8 * args.frames, n) for n in (1, 2)}
    rows = {name: clock.median(name) for name in clock.times}
    for name, value in rows.items():
        print(f"{name:28}{value:10.2f} CPU ms")
    if "Embree, one ray a pixel" in rows:
        embree = rows["Embree, one ray a pixel"]
        rows["truth / Embree"] = (rows["truth: raster"] + rows["truth: channels"]) / embree
        rows["whole frame / Embree"] = rows["whole frame"] / embree
        print(f"{'truth / Embree':28}{rows['truth / Embree']:10.2f} x")
        print(f"{'whole frame / Embree':28}{rows['whole frame / Embree']:10.2f} x")
    for n, rate in rates.items():
        print(f"{f'{n} worker(s), whole run':28}{rate:10.1f} frames/s")
    if args.json:
        args.json.write_text(json.dumps({**rows, **{f"frames/s, {n} workers": r for n, r in rates.items()}}, indent=1))


if __name__ == "__main__":
    main()
