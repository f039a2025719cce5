"""The Cycles engine beside the same Blender driven as BlenderProc drives it: CPU seconds a frame, over all threads.

The reference car (bench_scene.py) on a ground, and over a picture; 640x480, equal samples, both denoised, the same camera, sun
and sky. Our figures are those of whole frames with labels, in this process and in Blender's; BlenderProc's are those of
Blender alone, with object indices (bench_blenderproc.py). Work done once a scene is reported separately.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import write_reference

from viewsphere import Recipe, plan, plugins
from viewsphere.blender.interpreter import find_blender
from viewsphere.engines.shared.blender.staging import CyclesStage
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import annotated, context_of, observe
from viewsphere.model.shot import Shot
from viewsphere.plugins.engine import EngineSpec
from viewsphere.rendering.sky.sky import sky_pictures
from viewsphere.rendering.sky.sun import sun_light
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import rasterize

HERE = Path(__file__).parent
EQUAL = {"samples": 16, "bounces": 3}
DIFFUSE = {"glossy_bounces": 0, "transmission_bounces": 0, "volume_bounces": 0}
"""BlenderProc's setting: paths end after a glossy reflection or transmission. Our default lets them go on."""
ENGINES: dict[str, dict[str, Any]] = {
    "equal": {"name": "cycles", **EQUAL},
    "equal, its bounces": {"name": "cycles", **EQUAL, "settings": DIFFUSE},
    "draft": {"name": "cycles", "quality": "draft"},
    "raster": {"name": "raster"},
}
LABELS = ["depth", "instances", "normals"]
Size = tuple[int, int]
PER_SHOT = 25
"""Frames of each shot in the measurement of memory."""


@dataclass(frozen=True)
class Costs:
    """CPU seconds of a scene's first frame, and of each later one's colour and labels."""

    first: float
    color: list[float]
    labels: list[float]

    @property
    def frame(self) -> float:
        return float(np.median(np.add(self.color, self.labels)))


def recipe_of(folder: Path, engine: dict[str, Any], has_ground: bool, frames: int, size: Size = (640, 480)) -> Recipe:
    """A recipe of the car, seen from all around."""
    photo = {} if has_ground else {"background": {"image": str(folder / "photo.png")}}
    return Recipe(
        name="bench",
        models=[{"source": str(folder / "car.glb"), "category": "car", "scale": {"length": 4.3}}],
        viewpoints={"azimuth": [360 * i / frames for i in range(frames)], "elevation": [20], "distance": 9.0},
        camera={"size": size, "fov_deg": 40},
        scene={"ground": has_ground, **photo},
        engine=engine,
        channels=["rgb", *LABELS],
        formats=[],
    )


def write_scene(folder: Path) -> None:
    """Write the car, and a background picture."""
    write_reference(folder)
    save(folder / "photo.png", np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8))


def cpu_of(pid: int) -> float:
    """CPU seconds of a process, all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ours(shot: Shot, stages: Stages, pictures: Path | None = None) -> Costs:
    """Costs of a shot's frames, rendered by the engine that the shot names."""
    mesh = stages.model(shot.things[0].model)
    engine = plugins.load(EngineSpec, shot.engine)

    def spent() -> float:
        """CPU seconds so far, in this process and in Blender."""
        there = cpu_of(stage.keeper.process_for(stage.arrangement(0)).pid) if isinstance(stage, CyclesStage) else 0.0
        return time.process_time() + there

    stage = engine.stage(shot, stages.model)
    spent()
    boxes = [Box3d.between(*mesh.bounds).corners]
    color: list[float] = []
    labels: list[float] = []
    for number, instant, sensor in shot.samples:
        camera = shot.camera(instant, sensor)
        before = time.process_time()
        geometry = stage.at(instant)
        visibility = rasterize(geometry, camera)
        observe(geometry, camera, visibility, LABELS)
        annotated(context_of(shot, instant, camera, geometry, visibility, boxes, ["model.obj"]))
        labels.append(time.process_time() - before)
        before = spent()
        picture = stage.paint(instant, sensor, visibility, ("rgb",))["rgb"]
        color.append(spent() - before)
        if pictures is not None:
            save(pictures / f"{number}.png", picture)
    return Costs(color[0] + labels[0], color[1:], labels[1:])


def save(path: Path, picture: Any) -> None:
    from PIL import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path)


def told(shot: Shot, stages: Stages, folder: Path, threads: int) -> dict[str, Any]:
    """The scene for bench_blenderproc.py: the same model, lights and cameras."""
    thing, scene = shot.things[0], shot.scene
    mesh = stages.model(thing.model)
    cameras = [shot.camera(instant) for instant in range(len(shot.instants))]
    sun = sun_light(scene.sky, scene.sun)
    assert sun is not None
    write_exr(folder / "world.exr", sky_pictures(scene.sky, scene.sun, scene.lights, scene.ground is not None).lighting)
    lowest = float((mesh.vertices @ np.array(thing.world_from_object)[:3, :3].T)[:, 2].min())
    z = lowest + thing.world_from_object[2][3]
    ground = None if scene.ground is None else {"size": 2000.0, "z": z, "color": list(scene.ground.color)}
    return {
        "model": str(folder / "model.glb"),
        "matrix": thing.world_from_object,
        "ground": ground,
        "transparent": scene.ground is None,
        "sun": {"energy": max(sun.irradiance), "angle": np.deg2rad(sun.angle_deg), "direction": list(sun.direction)},
        "sky": str(folder / "world.exr"),
        "camera": {"width": 640, "height": 480, "fx": cameras[0].intrinsics.fx},
        "poses": [{"R": c.R.tolist(), "center": c.center.tolist()} for c in cameras],
        "samples": EQUAL["samples"],
        "threads": threads,
    }


def write_exr(path: Path, pixels: Any) -> None:
    import OpenEXR

    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.ascontiguousarray(pixels, np.float32)}) as file:
        file.write(str(path))


def theirs(shot: Shot, stages: Stages, python: Path, folder: Path, threads: int) -> Costs:
    from viewsphere.assets.exporting.export import export_glb

    folder.mkdir(parents=True, exist_ok=True)
    export_glb(stages.model(shot.things[0].model), folder / "model.glb")
    (folder / "told.json").write_text(json.dumps(told(shot, stages, folder, threads)))
    with (folder / "log").open("wb") as log:
        subprocess.run([python, HERE / "bench_blenderproc.py", folder], check=True, stdout=log, stderr=log)
    frames = np.diff(json.loads((folder / "cpu.json").read_text())).tolist()
    return Costs(frames[0], frames[1:], [0.0] * len(frames[1:]))


def compare(frames: int, threads: int, folder: Path) -> dict[str, dict[str, Costs]]:
    """Every engine's costs on both scenes; its pictures are left in a folder of its name."""
    stages, python = Stages(), find_blender()
    found: dict[str, dict[str, Costs]] = {}
    for scene, has_ground in (("ground", True), ("picture", False)):
        shots = {
            name: next(iter(plan(recipe_of(folder, engine, has_ground, frames), shot_frames=frames).shots(stages.box)))
            for name, engine in ENGINES.items()
        }
        costs = {name: ours(shot, stages, folder / f"{scene} {name}") for name, shot in shots.items()}
        costs["BlenderProc's way"] = theirs(shots["equal"], stages, python, folder / f"{scene} theirs", threads)
        found[scene] = costs
    return found


def table(found: dict[str, dict[str, Costs]]) -> list[str]:
    """Lines of a table, one for each engine and scene."""
    lines = [
        "| scene | engine | CPU s a frame | of BlenderProc's | labels, ms | first frame |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for scene, costs in found.items():
        theirs = costs["BlenderProc's way"].frame
        for name, cost in costs.items():
            labels = 1e3 * float(np.median(cost.labels))
            lines.append(
                f"| {scene} | {name} | {cost.frame:.2f} | {cost.frame / theirs:.2f} | {labels:.1f} | {cost.first:.2f} |"
            )
    return lines


def memory(frames: int, folder: Path) -> list[float]:
    """Megabytes that one Blender holds after each of many frames, of two shots in turn."""
    engine = {"name": "cycles", "quality": "draft", "samples": 1, "denoise": "off", "replace_after": 0}
    stages = Stages()
    found: list[float] = []
    for i in range(frames // PER_SHOT):
        recipe = recipe_of(folder, engine, i % 2 == 0, PER_SHOT, (160, 120))
        shot = next(iter(plan(recipe, shot_frames=PER_SHOT).shots(stages.box)))
        stage = stages.stage(shot)
        assert isinstance(stage, CyclesStage)
        for _ in stages.render(shot):
            found.append(stage.keeper.process_for(stage.arrangement(0)).ask("memory")["rss_mb"])
    return found


def cycles(frames: int, threads: int) -> None:
    """Print the comparison; `threads` of BlenderProc's Blender, 0 for all cores, as it is documented."""
    with tempfile.TemporaryDirectory() as name:
        write_scene(Path(name))
        print("\n".join(table(compare(frames, threads, Path(name)))))


def endurance(frames: int) -> None:
    """Print Blender's memory over many frames."""
    with tempfile.TemporaryDirectory() as name:
        write_scene(Path(name))
        held = memory(frames, Path(name))
    tenth = max(1, len(held) // 10)
    print("MB:", ", ".join(f"{np.median(held[i : i + tenth]):.0f}" for i in range(0, len(held), tenth)))
