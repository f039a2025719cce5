"""The cost of motion, as ratios inside one run: CPU time over all threads, the least of several turns, kernels warm.

Car: the reference scene's, driven in a curve while the camera orbits. Town: the zoo's neighbourhood with 20 moving zoo cars,
seen by a stereo pair that drives above the road. Turns of what is compared alternate, so that a load that slows the machine
slows both. A sample's times are those in a shot: views are kept from sample to sample, as a run keeps them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import reference_recipe

from viewsphere import Recipe, plan
from viewsphere.engines import Stage
from viewsphere.labels import observe
from viewsphere.model.model_spec import Size
from viewsphere.model.sample import Float
from viewsphere.model.shot import Shot
from viewsphere.run.shots.stages import Stages, render_sample
from viewsphere.truth.shot_views import ShotViews

PLAIN = ("depth", "instances", "normals")
VECTORS = ("flow", "flow_backward", "disparity", "scene_flow")
STATES = ("flow_state", "flow_backward_state", "disparity_state")
CARS = 20
LANE = 1.75  # metres from the road's middle to that of a lane
APART = 7.0
POINTS = 100_000
TURNS = 3
FRAMES = 12  # of a sequence whose channels are timed
TRACKED = 100


def car_recipe(folder: Path, frames: int, **more: Any) -> Recipe:
    """The reference scene in motion."""
    still = reference_recipe(1, 4, folder).model_dump(exclude_unset=True)
    motion = {"kind": "constant", "velocity": [0.5, -1.0, 0.0], "spin_deg": [0, 0, 20]}
    models = [{**still["models"][0], "motion": motion}]
    orbit = {"kind": "orbit", "elevation": 20, "distance": 9.0, "turns": frames / 400}
    moving = {"models": models, "viewpoints": orbit, "time": {"frames": frames, "fps": 25}, "shot_frames": frames}
    return Recipe(**{**still, **moving, **more})


def town_recipe(frames: int, **more: Any) -> Recipe:
    """A street on which 20 cars drive."""
    spots = [[(-LANE, LANE)[i % 2], (i + 1) // 2 * (APART, -APART)[i % 2], 0] for i in range(1, CARS)]
    drive = {"kind": "path", "lane": "any", "speed": [6, 12], "offset": [0, 120], "heading": "level"}
    return Recipe(
        name="town",
        models=[{"source": "zoo:car", "count": CARS, "motion": drive}],
        viewpoints={"kind": "drive", "lane": "right", "speed": 6, "height": 6, "offset": 40, "look": [0, 20, 0]},
        rig={"kind": "stereo", "baseline": 0.2},
        splits={"by": "pose", "train": 1},
        camera={"size": [640, 480], "fov_deg": 60},
        scene={"place": "zoo:neighbourhood", "company": {"layout": spots, "motion": drive}},
        engine={"name": "raster", "antialias": 4},
        time={"frames": frames, "fps": 25},
        **{"shot_frames": frames, "channels": ["rgb", "depth"], "formats": [], **more},
    )


@dataclass(eq=False)
class Clock:
    """The least CPU milliseconds, by what was done and to which frame."""

    times: dict[str, dict[int, float]] = field(default_factory=dict[str, "dict[int, float]"])

    def __call__(self, name: str, frame: int, work: Callable[[], Any]) -> Any:
        begun = time.process_time()
        result = work()
        took = 1e3 * (time.process_time() - begun)
        kept = self.times.setdefault(name, {})
        kept[frame] = min(took, kept.get(frame, took))
        return result

    def __getitem__(self, name: str) -> float:
        """The mean over frames."""
        return float(np.mean(list(self.times[name].values())))


@dataclass(frozen=True, eq=False)
class World:
    """A shot, and the stage that renders it."""

    shot: Shot
    stages: Stages
    stage: Stage

    @staticmethod
    def from_recipe(recipe: Recipe, stages: Stages) -> World:
        """That of a recipe's first sequence."""
        shot = next(plan(recipe).shots(stages.box))
        return World(shot, stages, stages.stage(shot))

    @property
    def views(self) -> ShotViews:
        """New ones, which keep nothing yet."""
        return ShotViews(self.shot, self.stage.at)

    @property
    def boxes(self) -> tuple[list[Float], list[Size | None]]:
        """Boxes and sizes of the objects."""
        models = [thing.model for thing in self.shot.objects]
        return list(map(self.stages.box, models)), list(map(self.stages.real_size, models))

    def watched(self, names: Sequence[str]) -> World:
        """The same, with other channels."""
        shot = self.shot.model_copy(update={"channels": tuple(names)})
        return World(shot, self.stages, self.stage.for_shot(shot))

    def standing(self, names: Sequence[str]) -> World:
        """Still pictures by the same cameras, of the world as it is half way."""
        instant = len(self.shot.instants) // 2
        still = {"things": self.shot.things_at(instant), "sequence": "", "channels": tuple(names)}
        shot = self.shot.model_copy(update=still)
        return World(shot, self.stages, Stages().stage(shot))

    @property
    def measured(self) -> Iterator[tuple[int, int, int]]:
        """Samples with an instant before and one after: number, instant, sensor."""
        return (one for one in self.shot.samples if 0 < one[1] < len(self.shot.instants) - 1)


def time_channels(clock: Clock, label: str, world: World, names: Sequence[str]) -> None:
    """Raster and channels of a shot's samples; what moves geometry is not counted."""
    views = world.views
    for number, instant, sensor in world.measured:
        for neighbour in (instant - 1, instant, instant + 1):
            views.labelled(neighbour)
        clock(label, number, partial(_channels, views, instant, sensor, names))


def _channels(views: ShotViews, instant: int, sensor: int, names: Sequence[str]) -> None:
    view = views.view(instant, sensor)
    observe(view.geometry, view.camera, view.visibility, names, views.neighbours(instant, sensor))


def channels(world: World) -> list[Row]:
    """Vectors, and each state, beside the plain channels: what they add to a sample that has the others."""
    clock, both = Clock(), (*PLAIN, *VECTORS)
    named = {"plain": PLAIN, "vectors": both, **{name: (*both, name) for name in STATES}, "states": (*both, *STATES)}
    for _ in range(TURNS):
        for label, names in named.items():
            time_channels(clock, label, world, names)
    plain, vectors = clock["plain"], clock["vectors"]
    rows = [Row("plain: raster, depth, instances, normals", plain, 1.0), _row("the four vectors", vectors - plain, plain, 1.0)]
    rows += [_row(name, clock[name] - vectors, plain, 2.0) for name in STATES]
    return [*rows, _row("all three states", clock["states"] - vectors, plain)]


def time_pictures(clock: Clock, label: str, world: World) -> None:
    """Whole samples of a shot, but for their files."""
    views, (boxes, sizes) = world.views, world.boxes
    for one in world.shot.samples:
        sample = partial(render_sample, views, one, world.stage, boxes, sizes)
        if one in set(world.measured):
            clock(label, one[0], sample)
        else:
            sample()


def pictures(world: World) -> list[Row]:
    """A moving stereo pair beside two still pictures."""
    clock, names = Clock(), ("rgb", "depth")
    moving = (*names, "flow")
    worlds = {
        "still": world.standing(names),
        "moving, with flow": world.watched(moving),
        "moving, with flow and its state": world.watched((*moving, "flow_state")),
        "and disparity and its state": world.watched((*moving, "flow_state", "disparity", "disparity_state")),
    }
    for _ in range(TURNS):
        for label, one in worlds.items():
            time_pictures(clock, label, one)
    most = (None, 1.3, 2.0, None)
    return [_row(name, 2 * clock[name], 2 * clock["still"], bar) for name, bar in zip(worlds, most, strict=True)]


def tracks(world: World, most: float, in_rasters: bool) -> list[Row]:
    """Points followed through a sequence, picked at its first instant: a frame's share."""
    clock = Clock()
    for _ in range(TURNS):
        views = world.views
        for number, instant, sensor in world.shot.samples:
            if sensor:
                continue
            view = views.view(instant, sensor)
            clock("raster", number, lambda view=view: view.visibility)
            clock("tracks", number, partial(_channels, views, instant, sensor, ["tracks"]))
    raster, frame = clock["raster"], clock["tracks"]
    row = _row(f"{POINTS:,} tracks, a frame of {TRACKED}", frame, raster, most if in_rasters else None)
    return [Row("raster", raster, 1.0), row]


@dataclass(frozen=True)
class Row:
    """A line of a table: CPU milliseconds, and how many times the first line's, at most `most`."""

    name: str
    took: float
    times: float
    most: float | None = None

    def __str__(self) -> str:
        bar = "" if self.most is None else f"{self.most:.1f}"
        return f"| {self.name} | {self.took:.2f} | {self.times:.2f} | {bar} |"


def _row(name: str, took: float, unit: float, most: float | None = None) -> Row:
    return Row(name, took, took / unit, most)


def table(title: str, rows: Sequence[Row]) -> None:
    print(f"\n{title}\n\n| | CPU ms | ratio | at most |\n|---|---:|---:|---:|")
    print("\n".join(map(str, rows)), flush=True)


def motion(folder: Path) -> None:
    """Print all tables; the reference scene's files are in `folder`."""
    followed = {"channels": ["tracks"], "tracks": {"count": POINTS, "on": "objects", "at": [0]}}
    stages = Stages()
    pair = {"rig": {"kind": "stereo", "baseline": 0.2}, "channels": list(PLAIN)}
    table("Car, channels", channels(World.from_recipe(car_recipe(folder, FRAMES, **pair), stages)))
    table("Car, tracks", tracks(World.from_recipe(car_recipe(folder, TRACKED, **followed), stages), 20.0, False))
    town = World.from_recipe(town_recipe(FRAMES), stages)
    print(f"\nTown: {len(town.stage.at(0).triangles):,} triangles")
    table("Town, channels", channels(town))
    table("Town, a stereo pair", pictures(town))
    table("Town, tracks", tracks(World.from_recipe(town_recipe(TRACKED, **followed), stages), 3.0, True))
