"""The growth of a frame's cost with triangles, pixels, objects and textures: CPU time of truth and colour, drawn as a chart."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import texture_set

from viewsphere import plugins
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.labels import observe
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Ground, Scene, Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.plugins.engine import EngineSpec
from viewsphere.truth.raster.visibility import rasterize

TRIANGLES = (1_000, 10_000, 100_000, 1_000_000, 5_000_000)
SIDES = (128, 256, 512, 1024, 2048, 4096)
OBJECTS = (1, 3, 10, 30, 100, 200)
MATERIALS = (0, 1, 2, 4, 8, 16)
FRAMES = 5
TURNS = 3


def rows_of(triangles: int) -> int:
    """Rows of a ball of about so many triangles: a ball of n rows has 4 n^2."""
    return max(round(np.sqrt(triangles / 4)), 3)


def ball(triangles: int, materials: int = 1, size: int = 1024) -> Mesh:
    """A ball of radius 0.5 m of about so many triangles; every material, by latitude, has its own three textures."""
    rows = rows_of(triangles)
    columns = 2 * rows
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)[:, None]
    longitude = np.linspace(0, 2 * np.pi, columns + 1)[None, :]
    level = np.cos(latitude) * np.ones_like(longitude)
    normals = np.stack([level * np.cos(longitude), level * np.sin(longitude), np.sin(latitude) + 0 * level], axis=-1)
    uv = np.stack([longitude / 2 + 0 * latitude, latitude + 0 * longitude], axis=-1)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    above = first + columns + 1
    corners = np.concatenate([np.stack([first, first + 1, above + 1], 1), np.stack([first, above + 1, above], 1)])
    band = np.tile(np.repeat(np.arange(rows) * max(materials, 1) // rows, columns), 2)
    images: list[Image] = []
    made = [Material("plain", (0.6, 0.3, 0.2, 1.0), roughness=0.4)] if not materials else []
    kinds = texture_set(size)
    for i in range(materials):
        images += [replace(image, pixels=np.roll(image.pixels, 64 * i, axis=1)) for image in kinds]
        base, surface, normal = (Texture(3 * i + k) for k in range(3))
        made.append(Material(str(i), base_color_texture=base, metallic_roughness_texture=surface, normal_texture=normal))
    return Mesh(
        vertices=(normals.reshape(-1, 3) / 2).astype(np.float32),
        triangles=corners.astype(np.int32),
        normals=normals.reshape(-1, 3).astype(np.float32),
        triangle_material=band.astype(np.int32),
        triangle_part=np.zeros(len(corners), np.int32),
        materials=tuple(made),
        uv0=uv.reshape(-1, 2).astype(np.float32),
        images=tuple(images),
    )


def frame_cost(mesh: Mesh, side: tuple[int, int] = (640, 480), copies: int = 1) -> dict[str, float]:
    """CPU milliseconds by name: the stage once, truth and colour a frame; pixels without objects show ground and sky.

    Give a new mesh each time: a mesh that was staged before is staged faster, as parts of its stage are cached.
    """
    spec = ModelSpec(key="ball", source="ball", category="ball", category_id=1)
    across = int(np.ceil(np.sqrt(copies)))
    places = [(1.2 * (i % across - (across - 1) / 2), 1.2 * (i // across - (across - 1) / 2)) for i in range(copies)]
    rows = [((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, 0.5), (0, 0, 0, 1)) for x, y in places]
    width, height = side
    distance = 1.0 + 1.6 * across
    poses = [Viewpoint(index=i, azimuth_deg=20 + 70 * i, elevation_deg=25, distance=distance) for i in range(FRAMES)]
    shot = Shot(
        key="scaling",
        things=tuple(Thing(id=i, model=spec, motion=Motion.still(w)) for i, w in enumerate(rows, 1)),
        rig=Rig.single(Intrinsics(width=width, height=height, fx=1.2 * width, fy=1.2 * width, cx=width / 2, cy=height / 2)),
        scene=Scene(sun=Sun(), ground=Ground()),
        instants=tuple(looking(p, (0.0, 0.0, 0.5), index=p.index) for p in poses),
        channels=("rgb", "depth", "instances", "normals"),
    )
    engine = plugins.load(EngineSpec, "raster")
    begun = time.process_time()
    stage = engine.stage(shot, lambda spec: mesh)
    geometry = stage.at(0)
    times: dict[str, list[float]] = {"stage": [1e3 * (time.process_time() - begun)], "truth": [], "colour": []}
    for instant in range(len(shot.instants)):
        camera = shot.camera(instant)
        begun = time.process_time()
        visibility = rasterize(geometry, camera)
        observe(geometry, camera, visibility, ["depth", "instances", "normals"])
        middle = time.process_time()
        stage.paint(instant, 0, visibility, ("rgb",))
        times["truth"].append(1e3 * (middle - begun))
        times["colour"].append(1e3 * (time.process_time() - middle))
    return {name: float(np.median(values)) for name, values in times.items()}


def series() -> Iterator[tuple[str, list[tuple[float, Callable[[], dict[str, float]]]]]]:
    """For each series its name, and pairs of a value and a function that measures the cost there with a new mesh."""
    exact = [4 * rows_of(n) ** 2 for n in TRIANGLES]
    yield "triangles", [(n, lambda n=n: frame_cost(ball(n))) for n in exact]
    yield "pixels", [(n * n, lambda n=n: frame_cost(ball(75_000), (n, n))) for n in SIDES]
    yield "objects of 5,000 triangles", [(n, lambda n=n: frame_cost(ball(5_000), copies=n)) for n in OBJECTS]
    yield "sets of three textures", [(n, lambda n=n: frame_cost(ball(75_000, n))) for n in MATERIALS]


def least(run: Callable[[], dict[str, float]]) -> dict[str, float]:
    """The least costs of several turns: other work on the machine can only add to them."""
    turns = []
    for _ in range(TURNS):
        turns.append(run())
        gc.collect()
    return {name: min(turn[name] for turn in turns) for name in turns[0]}


def scaling(folder: Path) -> None:
    """Measure, print tables and write `scaling.svg`."""
    frame_cost(ball(1_000))  # compiles, or reads the cache
    results: list[tuple[str, list[float], list[dict[str, float]]]] = []
    for name, runs in series():
        costs = []
        print(f"\n| {name} | stage, CPU ms | truth | colour |\n|---:|---:|---:|---:|")
        for value, run in runs:
            costs.append(least(run))
            print(f"| {value:,} | {costs[-1]['stage']:.0f} | {costs[-1]['truth']:.1f} | {costs[-1]['colour']:.1f} |")
        results.append((name, [value for value, _ in runs], costs))
    draw(results, folder / "scaling.svg")


def draw(results: list[tuple[str, list[float], list[dict[str, float]]]], file: Path) -> None:
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "viewsphere"
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    for axis, (name, values, costs) in zip(axes.flat, results, strict=True):
        scale = "symlog" if 0 in values else "log"
        for kind, mark in (("truth", "o-"), ("colour", "s-"), ("stage", "^:")):
            axis.plot(values, [c[kind] for c in costs], mark, label=f"{kind}, a {'shot' if kind == 'stage' else 'frame'}")
        axis.set(xscale=scale, yscale="log", xlabel=name, ylabel="CPU ms")
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    metadata: dict[str, Any] = {"Date": None}
    figure.savefig(file, metadata=metadata)
    plt.close(figure)
