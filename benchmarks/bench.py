"""The benchmark behind every speed claim: ratios inside one run, CPU time over all threads, medians over frames.

Reference scene (bench_scene.py): a zoo car cut to about 75,000 triangles with 1,024 x 1,024 textures (base colour,
occlusion-roughness-metallic, normals) on every material, the ground, an environment with a sun, 640x480; files: RGB PNG,
instance PNG, float32 depth and normals, annotations. `--scaling` measures how cost grows instead and draws
docs/images/scaling.svg. `--labels` measures each label (bench_labels.py), `--motion` sequences (bench_motion.py), `--bounces`
light between surfaces (bench_bounces.py), `--town` a drive through a town (bench_town.py), `--physics` what falls until it lies
still (bench_physics.py), `--training` how fast frames reach a training loop (bench_training.py, with PyTorch),
`--exports` 25 formats at once (bench_exports.py), `--rivals` other renderers (bench_rivals.py), `--cycles` and `--endurance`
the Cycles engine (bench_cycles.py).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from bench_opengl import NoOpenGL, opengl
from bench_parts import timed
from bench_scene import reference_recipe, write_reference

from viewsphere import generate, plan, plugins
from viewsphere.assets.mesh import Mesh
from viewsphere.engines import Stage
from viewsphere.engines.raster import staging
from viewsphere.engines.raster.shading import painting
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import annotated, context_of, observe
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import SHOT_FRAMES
from viewsphere.plugins.engine import EngineSpec
from viewsphere.run.shots.stages import Stages
from viewsphere.run.workers.allocator import keep_freed_memory
from viewsphere.store import Store
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, rasterize

ROOT = Path(__file__).parent.parent
PARTS_OF_COLOUR = (
    (painting, "edge_samples", "colour: finding edges, their samples"),
    (painting, "_shade_some", "colour: shading"),
    (painting, "layers", "colour: layers"),
    (painting, "sky_behind", "colour: sky"),
    (staging, "finished", "colour: view, sRGB"),
)
EMBREE = "Embree, one ray a pixel"
STAGES = ("truth: raster", "truth: channels", "colour", "annotations", "files")
Rival = tuple[str, Callable[[Camera], Any]]
"""A name for the table, and the function that draws a frame."""


class Clock:
    """Collects the CPU milliseconds of this process, all threads, by stage."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}

    def __call__(self, name: str, work: Callable[[], Any]) -> Any:
        begun = time.process_time()
        result = work()
        self.times.setdefault(name, []).append(1e3 * (time.process_time() - begun))
        return result

    def median(self, name: str) -> float:
        return float(np.median(self.times[name]))


def processor() -> str:
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def embree(geometry: Geometry) -> Rival:
    """One ray a pixel with camera-space z = 1, so that hit distance is z-depth; building the rays is part of the price."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices[geometry.triangles].astype(np.float32))

    def cast(camera: Camera) -> Any:
        x = ((np.arange(camera.width) + 0.5 - camera.K[0, 2]) / camera.K[0, 0]).astype(np.float32)
        y = ((np.arange(camera.height) + 0.5 - camera.K[1, 2]) / camera.K[1, 1]).astype(np.float32)
        r = camera.R.astype(np.float32)
        directions = (x[None, :, None] * r[0] + (y[:, None, None] * r[1] + r[2])).reshape(-1, 3)
        origins = np.tile(camera.center.astype(np.float32), (len(directions), 1))
        return scene.run(origins, directions, output=True)

    return EMBREE, cast


def open3d(geometry: Geometry) -> Rival:
    """The same rays through Open3D, which hands them to Embree in its own way."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(geometry.vertices.astype(np.float32), geometry.triangles.astype(np.uint32))

    def cast(camera: Camera) -> Any:
        extrinsics = np.eye(4)
        extrinsics[:3, :3], extrinsics[:3, 3] = camera.R, camera.t
        rays = scene.create_rays_pinhole(
            intrinsic_matrix=open3d.core.Tensor(camera.K),
            extrinsic_matrix=open3d.core.Tensor(extrinsics),
            width_px=camera.width,
            height_px=camera.height,
        )
        return scene.cast_rays(rays)

    return "Open3D, one ray a pixel", cast


def measure(frames: int, antialias: int, folder: Path) -> tuple[Clock, int]:
    """Times of the reference frame, stage by stage, and the number of its triangles."""
    clock = Clock()
    stages = Stages()
    shot = next(plan(reference_recipe(frames, antialias, folder), shot_frames=frames).shots(stages.box))
    mesh = stages.model(shot.things[0].model)
    engine = plugins.load(EngineSpec, "raster")
    store = Store(folder / f"store{antialias}")
    (store.root / "store" / "writing").mkdir(parents=True)
    warm_up = engine.stage(shot, lambda spec: mesh)  # compiles, or reads the cache
    one_shot(Clock(), shot, range(2), warm_up, mesh, store)
    stage = clock("stage: baked already", lambda: baked(engine, shot, mesh))
    rivals = installed_rivals(stage.at(0))
    instants = range(len(shot.instants))
    for first in instants[::SHOT_FRAMES]:
        instants_of_run = instants[first : first + SHOT_FRAMES]
        one_shot(clock, shot, instants_of_run, stage, mesh, store)
        for name, draw in rivals:
            rival_shot(clock, name, draw, [shot.camera(instant) for instant in instants_of_run])
    frames_parts = zip(*(clock.times[name] for name in STAGES), strict=True)
    clock.times["whole frame"] = [sum(parts) for parts in frames_parts]
    return clock, len(stage.at(0).triangles)


def baked(engine: EngineSpec, shot: Shot, mesh: Mesh) -> Stage:
    """The shot's stage, with its first geometry built."""
    stage = engine.stage(shot, lambda spec: mesh)
    stage.at(0)
    return stage


def installed_rivals(geometry: Geometry) -> list[Rival]:
    """The rivals that are installed and work here, each with its own copy of this geometry."""
    rivals: list[Rival] = []
    for rival in (embree, open3d, opengl):
        with suppress(ImportError, NoOpenGL):
            rivals.append(rival(geometry))
    return rivals


def rival_shot(clock: Clock, name: str, draw: Callable[[Camera], Any], cameras: Sequence[Camera]) -> None:
    """Time the same frames by a rival, right after ours: a load that slows the machine for seconds then slows both."""
    draw(cameras[0])  # brings the rival's scene into the caches, where ours is
    for camera in cameras:
        clock(name, lambda camera=camera: draw(camera))


def drawn(stage: Stage, instant: int, camera: Camera) -> tuple[Geometry, Visibility]:
    """The geometry of an instant, and the visibility for a camera."""
    geometry = stage.at(instant)
    return geometry, rasterize(geometry, camera)


def one_frame(clock: Clock, shot: Shot, instant: int, stage: Stage, mesh: Mesh) -> Sample:
    """Time one frame stage by stage, without writing its files."""
    boxes = [Box3d.between(*mesh.bounds).corners]
    now, camera = shot.instants[instant], shot.camera(instant)
    geometry, visibility = clock("truth: raster", lambda: drawn(stage, instant, camera))
    names = ["depth", "instances", "normals"]
    observed = clock("truth: channels", lambda: observe(geometry, camera, visibility, names))
    observed["rgb"] = clock("colour", lambda: stage.paint(instant, 0, visibility, ("rgb",))["rgb"])
    known = (shot, instant, camera, geometry, visibility, boxes, ["model.obj"])
    objects = clock("annotations", lambda: annotated(context_of(*known)))
    return Sample(now.index, "train", camera, now.viewpoint, objects, observed, {})


def one_shot(clock: Clock, shot: Shot, instants: Sequence[int], stage: Stage, mesh: Mesh, store: Store) -> None:
    """Time the frames of a shot as large as a run's, stage by stage; the shot's own files count in equal shares."""
    inside: list[float] = []
    files: list[float] = []

    def samples() -> Iterator[Sample]:
        for instant in instants:
            begun = time.process_time()
            parts: dict[str, float] = {}
            with timed(PARTS_OF_COLOUR, parts):
                sample = one_frame(clock, shot, instant, stage, mesh)
            for name, value in parts.items():
                clock.times.setdefault(name, []).append(value)
            made = time.process_time()
            yield sample
            files.append(time.process_time() - made)
            inside.append(time.process_time() - begun)

    begun = time.process_time()
    store.write_shot(f"{id(clock)}-{instants[0]}", samples(), shot=shot)
    share = (time.process_time() - begun - sum(inside)) / len(instants)
    clock.times.setdefault("files", []).extend(1e3 * (own + share) for own in files)


def rates(folder: Path, frames: int, turns: int = 3) -> dict[int, float]:
    """Frames a second on the wall clock with one and with two warm workers: from the extra time that three times as many
    frames take, each time being the least of several turns.
    """
    seconds: dict[tuple[int, int], float] = {}
    for turn in range(turns):
        for workers, part in ((1, 1), (2, 1), (1, 3), (2, 3)):
            begun = time.monotonic()
            generate(reference_recipe(part * frames, 4, folder), folder / f"run{workers}x{part}x{turn}", workers=workers)
            took = time.monotonic() - begun
            seconds[workers, part] = min(seconds.get((workers, part), took), took)
    return {workers: 2 * frames / (seconds[workers, 3] - seconds[workers, 1]) for workers in (1, 2)}


def table(rows: dict[str, float], embree: float | None) -> list[str]:
    lines = ["| stage | CPU ms | of Embree |", "|---|---:|---:|"]
    for name, value in rows.items():
        lines.append(f"| {name} | {value:.2f} | {'' if embree is None else f'{value / embree:.2f}'} |")
    return lines


def slow(args: argparse.Namespace) -> None:
    """Measure the Cycles engine."""
    from bench_cycles import cycles, endurance

    if args.cycles:
        cycles(args.cycles, args.threads)
    if args.endurance:
        endurance(args.endurance)


def in_folder(args: argparse.Namespace, folder: Path) -> None:
    """Measure what writes files, in an empty folder."""
    if args.exports:
        from bench_exports import exports

        exports(args.frames, folder)
        return
    write_reference(folder)
    if args.motion:
        from bench_motion import motion

        motion(folder)
    elif args.bounces:
        from bench_bounces import light

        light(folder)
    else:
        from bench_training import training

        training(folder)


def in_memory(args: argparse.Namespace) -> None:
    """Measure what needs no files."""
    if args.town:
        from bench_town import town

        town(args.frames, embree)
    elif args.physics:
        from bench_physics import main as physics

        physics()
    else:
        from bench_labels import report

        report(max(1, args.frames // 12), embree)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--frames", type=int, default=48)
    options.add_argument("--workers", action="store_true", help="measure frames a second with one and two workers, too")
    options.add_argument("--scaling", action="store_true", help="measure how cost grows, and draw it")
    options.add_argument("--motion", action="store_true", help="measure what flow, states, tracks and moving pictures cost")
    options.add_argument("--bounces", action="store_true", help="measure what light between surfaces costs")
    options.add_argument("--town", action="store_true", help="measure a drive through a town by stages, and its memory")
    options.add_argument("--physics", action="store_true", help="measure what falls until it lies still")
    options.add_argument("--labels", action="store_true", help="measure what each label costs, with 1 and 20 objects")
    options.add_argument("--exports", action="store_true", help="measure 25 formats in one pass, and what they encode")
    options.add_argument("--training", action="store_true", help="measure reading and rendering for a training loop")
    options.add_argument("--cycles", type=int, metavar="FRAMES", help="measure the Cycles engine beside BlenderProc's way")
    options.add_argument("--threads", type=int, default=0, help="of BlenderProc's Blender, beside --cycles; 0: all cores")
    options.add_argument("--endurance", type=int, metavar="FRAMES", help="tell the memory of one Blender over so many frames")
    options.add_argument("--rivals", nargs="*", metavar="NAME", help="measure other renderers, each installed on its own")
    options.add_argument("--json", type=Path, help="write the figures here too")
    args = options.parse_args()
    keep_freed_memory()  # workers set the same
    print(f"{processor()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    if args.scaling:
        from bench_scaling import scaling

        scaling(ROOT / "docs" / "images")
        return
    if args.labels or args.town or args.physics:
        in_memory(args)
        return
    if args.motion or args.bounces or args.exports or args.training:
        with tempfile.TemporaryDirectory() as name:
            in_folder(args, Path(name))
        return
    if args.cycles or args.endurance:
        slow(args)
        return
    if args.rivals is not None:
        from bench_rivals import rivals

        figures = rivals(args.rivals, max(1, args.frames // 4), processor())
    else:
        figures = stages_of_a_frame(args)
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1))


def stages_of_a_frame(args: argparse.Namespace) -> dict[str, Any]:
    """The times of the reference frame's stages, printed and returned."""
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_reference(folder)
        for antialias in (1, 4):
            clock, triangles = measure(args.frames, antialias, folder)
            rows = {name: clock.median(name) for name in clock.times}
            rows["truth"] = rows["truth: raster"] + rows["truth: channels"]
            print(f"\n{triangles:,} triangles, {'4x edge anti-aliasing' if antialias == 4 else 'no anti-aliasing'}")
            print("\n".join(table(rows, rows.get(EMBREE))))
            figures[f"antialias {antialias}"] = rows
        if args.workers:
            one, two = rates(folder, 4 * args.frames).values()
            print(f"\n{one:.1f} frames/s with one worker, {two:.1f} with two: {two / one:.2f} times")
            figures["frames a second"] = one, two
    return figures


if __name__ == "__main__":
    main()
