"""The cost of light between surfaces: a furnished room of boxes, and the reference car, with and without bounces.

CPU milliseconds over all threads, kernels warm; frames at 640 x 480 with 4x edge anti-aliasing, the median of alternating
turns. The first stage bakes all; another light casts no new probes' rays; frames of either differ in a look-up a pixel.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import reference_recipe

from viewsphere import Recipe, plan
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines import raster
from viewsphere.engines.raster.staging import RasterStage
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.instant import Instant
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Scene, Sky, Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import rasterize

TURNS = 7
WHITE, RED, GREEN, WOOD, BLUE = (0.75, 0.74, 0.72), (0.65, 0.12, 0.08), (0.15, 0.5, 0.15), (0.45, 0.28, 0.15), (0.2, 0.25, 0.5)
ROOM = (
    ((-0.2, -0.2, -0.2), (6.2, 4.2, 0), (0.5, 0.4, 0.3)),
    ((-0.2, -0.2, 2.8), (6.2, 4.2, 3), WHITE),
    ((-0.2, -0.2, 0), (0, 4.2, 2.8), RED),
    ((6, -0.2, 0), (6.2, 4.2, 2.8), WHITE),
    ((0, 4, 0), (6, 4.2, 2.8), GREEN),
    ((0, -0.2, 0), (1, 0, 2.8), WHITE),
    ((2.8, -0.2, 0), (6, 0, 2.8), WHITE),
    ((1, -0.2, 0), (2.8, 0, 0.9), WHITE),
    ((1, -0.2, 2.1), (2.8, 0, 2.8), WHITE),
    ((0.02, 2.2, 0), (0.6, 3.6, 2), WOOD),
    ((2.4, 2.9, 0), (4.1, 3.7, 0.42), BLUE),
    ((2.4, 3.55, 0.42), (4.1, 3.75, 0.85), BLUE),
    ((1.6, 1.4, 0.7), (2.8, 2.1, 0.74), WOOD),
    *(((x, y, 0), (x + 0.06, y + 0.06, 0.7), WOOD) for x in (1.6, 2.74) for y in (1.4, 2.04)),
)
"""Boxes, lowest and highest corner, and their colours: 6 x 4 x 2.8 m, a window towards -Y."""
THING = (((2.85, 0.85, 0), (3.15, 1.15, 0.3), (0.7, 0.7, 0.7)),)


@lru_cache
def boxes(solids: tuple[Any, ...], roughness: float = 0.8) -> Mesh:
    """Boxes with flat faces, each of its own colour, the first one of this roughness."""
    faces = np.array([face for a, b, c, d in Box3d.numbered_faces().values() for face in ((a, b, c), (a, c, d))])
    corners = np.concatenate([Box3d.between(low, high).corners[faces] for low, high, _ in solids]).astype(np.float32)
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Mesh(
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
        normals=np.repeat(normal, 3, axis=0).astype(np.float32),
        triangle_material=np.repeat(np.arange(len(solids), dtype=np.int32), len(faces)),
        triangle_part=np.zeros(len(corners), np.int32),
        materials=tuple(
            Material("paint", (*color, 1.0), roughness=0.8 if i else roughness) for i, (_, _, color) in enumerate(solids)
        ),
    )


def room_shot(how: str, azimuth_deg: float, roughness: float) -> tuple[Shot, dict[str, Mesh]]:
    """A small box in the room, seen from beside the window."""
    meshes = {"thing": boxes(THING), "room": boxes(ROOM, roughness)}
    spec = {key: ModelSpec(key=key, source=key, category="thing", category_id=i) for i, key in enumerate(meshes)}
    things = Thing(id=1, model=spec["thing"]), Thing(id=0, model=spec["room"], scenery=True)
    eye, target = np.array([3.9, 0.4, 1.6]), np.array([1.0, 3.0, 0.9])
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(ahead, right), ahead], axis=1), eye
    focal = 320 / math.tan(math.radians(37.5))
    lens = Intrinsics(width=640, height=480, fx=focal, fy=focal, cx=320, cy=240)
    x, y, z, w = (tuple(row) for row in pose.tolist())
    instant = Instant(index=0, world_from_rig=(x, y, z, w), focus=(3.0, 1.0, 0.0))
    scene = Scene(sun=Sun(azimuth=azimuth_deg, elevation=38, strength=40), sky=Sky(strength=3.0))
    more = {"channels": ("rgb",), "engine_options": {"bounces": how}}
    return Shot(key="room", things=things, rig=Rig.single(lens), instants=(instant,), scene=scene, **more), meshes


def staged(how: str, azimuth_deg: float = 18.0, roughness: float = 0.8) -> RasterStage:
    shot, meshes = room_shot(how, azimuth_deg, roughness)
    return raster.stage(shot, lambda spec, step=None: meshes[spec.key])


def car_stage(folder: Path, how: str) -> RasterStage:
    """The reference car on its ground."""
    still, stages = reference_recipe(1, 4, folder).model_dump(exclude_unset=True), Stages()
    recipe = Recipe(**{**still, "engine": {"name": "raster", "bounces": how}})
    stage = stages.stage(next(plan(recipe).shots(stages.box)))
    assert isinstance(stage, RasterStage)
    return stage


def spent(work: Callable[[], Any]) -> float:
    """CPU milliseconds of this process."""
    begun = time.process_time()
    work()
    return 1e3 * (time.process_time() - begun)


def baked(stage: RasterStage) -> float:
    stage.at(0)
    return spent(lambda: stage.baked(0))


def frames(stages: dict[str, RasterStage]) -> dict[str, float]:
    """Medians of a frame's colour, by stage, in turn."""
    seen = {name: rasterize(stage.at(0), stage.shot.camera(0)) for name, stage in stages.items()}
    times: dict[str, list[float]] = {name: [] for name in stages}
    for turn in range(TURNS + 1):
        for name, stage in stages.items():
            took = spent(lambda stage=stage, name=name: stage.paint(0, 0, seen[name], ("rgb",)))
            if turn:
                times[name].append(took)
    return {name: float(np.median(took)) for name, took in times.items()}


def light(folder: Path) -> None:
    """Print the table."""
    baked(car_stage(folder, "on"))  # compiles; the room then takes the place of what is kept
    rooms = {how: staged(how) for how in ("off", "on")}
    bakes = {how: baked(stage) for how, stage in rooms.items()}
    moved = baked(staged("on", 30.0))
    print("| | bounces off | on | ratio |\n|---|---:|---:|---:|")
    print(f"| room: stage, ms | {bakes['off']:.0f} | {bakes['on']:.0f} | |")
    print(f"| room: stage with the sun elsewhere, ms | | {moved:.0f} | |")
    room = frames(rooms)
    print(f"| room: frame, ms | {room['off']:.1f} | {room['on']:.1f} | {room['on'] / room['off']:.2f} |")
    room = frames({how: staged(how, roughness=0.2) for how in ("off", "on")})
    print(f"| room: frame, the floor polished, ms | {room['off']:.1f} | {room['on']:.1f} | {room['on'] / room['off']:.2f} |")
    cars = {how: car_stage(folder, how) for how in ("off", "on")}
    bakes = {how: baked(stage) for how, stage in cars.items()}
    print(f"| car: stage, ms | {bakes['off']:.0f} | {bakes['on']:.0f} | |")
    car = frames(cars)
    print(f"| car: frame, ms | {car['off']:.1f} | {car['on']:.1f} | {car['on'] / car['off']:.2f} |")
