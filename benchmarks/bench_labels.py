"""The cost of each label: CPU milliseconds at 640x480 with 1 and with 20 objects, in the order in which frames compute them.

Frames show zoo cars on a floor; each label is timed alone, on a view whose triangles are drawn already, and against one ray of
Embree a pixel in the same run. The triangles themselves, and the channels depth, instances and normals, stand first: a label
that shares work with these shows only what it adds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from viewsphere import Recipe, plan
from viewsphere.labels import (
    ChannelLabel,
    LidarScan,
    ObjectLabel,
    ObjectPoints,
    OwnView,
    Poses,
    RigPoses,
    SampleLabel,
    annotated,
    channel_labels,
    context_of,
    labels,
    object_labels,
    on_request,
    requires,
    sample_labels,
)
from viewsphere.labels.shared.context import LabelContext
from viewsphere.labels.shared.spec import derived
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import Visibility, rasterize
from viewsphere.truth.shot_views import ShotViews

PLAIN = ("depth", "instances", "normals")
RASTER = "truth: raster"
TOGETHER = ("amodal", "nocs", "keypoints", "panoptic")
"""Labels whose joint cost is printed beside the cost of the plain channels."""


def recipe(objects: int) -> Recipe:
    return Recipe.model_validate(
        {
            "models": [{"source": "zoo:car", "category": "car", "count": min(objects, 5), "scale": {"length": 1.8}}],
            "scenes": {"count": 1, "objects": objects, "layout": "scatter", "repeat": True},
            "viewpoints": {"azimuth": [20, 140, 260], "elevation": 30, "distance": 4 if objects == 1 else 12},
            "camera": {"size": [640, 480], "fov_deg": 45},
            "scene": {"ground": True},
            "channels": ["depth", "instances"],
            "annotations": list(asked()),
            "formats": [],
            "splits": {"by": "frame", "train": 1},
        }
    )


def _compares_poses(label: Any) -> bool:
    """Return whether a label reads poses of other instants or sensors."""
    return any(requires(label.needs, kind) for kind in (Poses, RigPoses))


def asked() -> list[str]:
    """Annotations that still pictures of one camera have."""
    return [name for name, label in on_request().items() if not _compares_poses(label)]


def moving_recipe(objects: int) -> Recipe:
    """The same in motion: a stereo pair and a LiDAR of 64 x 1,800 rays that pass by things which slide and turn."""
    said = recipe(objects).model_dump(exclude_unset=True)
    lidar = {"rings": 64, "elevation": [-25, 5], "azimuth_step": 0.2}
    motion = {"kind": "constant", "velocity": [0.3, -0.5, 0], "spin_deg": [0, 0, 15]}
    names = moving_labels()
    return Recipe.model_validate(
        said
        | {
            "models": [said["models"][0] | {"motion": motion}],
            "viewpoints": {"kind": "orbit", "azimuth": [20, 30], "elevation": 30, "distance": said["viewpoints"]["distance"]},
            "time": {"frames": 3, "fps": 10},
            "tracks": {"grid": 16, "at": [0]},
            "rig": {"sensors": {"left": {}, "right": {"position": [0.1, 0, 0]}, "top": {"lidar": lidar}}},
            "channels": ["depth", "instances", *(name for name in names if name in channel_labels() and name != "tracks")],
            "annotations": [name for name in names if name in on_request()],
            "splits": {"by": "sequence", "train": 1},
        }
    )


def moving_labels() -> list[str]:
    """Labels that stills of one camera do not have."""
    return [name for name in labels() if name not in (*still_channels(), *still_labels())]


def still_labels() -> list[str]:
    """Labels of objects and of whole pictures that stills of one camera have."""
    known = (*object_labels(), *sample_labels().values())
    return [label.name for label in known if not _compares_poses(label)]


def measure_moving(objects: int, rounds: int) -> dict[str, float]:
    """Median CPU milliseconds of the labels of motion, rigs and LiDARs, at the middle of three instants."""
    stages, planned = Stages(), plan(moving_recipe(objects))
    shot = planned.shot(0, stages.box)
    stage = stages.stage(shot)
    views = ShotViews(shot, stage.at, lambda thing: stages.model(thing.model))
    boxes = [stages.box(thing.model) for thing in shot.objects]
    found: dict[str, list[float]] = {}
    for round_ in range(rounds + 1):
        for name in moving_labels():
            label = labels()[name]
            sensor = 2 if requires(label.needs, LidarScan) else 0
            views.followed(sensor)
            view, around = views.view(1, sensor), views.neighbours(1, sensor)
            for instant in (0, 2):
                _ = views.view(instant, sensor).visibility
            seen = context_of(
                shot, 1, view.camera, view.geometry, view.visibility, boxes, ["model.obj"] * len(boxes), None, around
            )
            _ = seen.instances, seen.corners
            ms = clocked(lambda label=label, seen=seen: of_any(label, seen))
            if round_:
                found.setdefault(name, []).append(ms)
    return {name: float(np.median(times)) for name, times in found.items()}


def of_any(label: Any, seen: LabelContext) -> None:
    if isinstance(label, ChannelLabel):
        label.compute(seen)
    elif isinstance(label, ObjectLabel):
        for i, placement in enumerate(seen.placements):
            if placement:
                label.compute(seen, i)
    else:
        label.compute(seen, ())


def still_channels() -> list[str]:
    """Channels that still pictures of one camera have."""
    known = channel_labels().items()
    return [n for n, label in known if all(isinstance(need, (OwnView, ObjectPoints)) for need in label.needs)]


def measure(objects: int, rounds: int, embree: Callable[[Any], Any]) -> tuple[dict[str, float], int]:
    """Median CPU milliseconds by label, and the number of triangles."""
    stages, planned = Stages(), plan(recipe(objects))
    shot = planned.shot(0, stages.box)
    stage = stages.stage(shot)
    views = ShotViews(shot, stage.at, lambda thing: stages.model(thing.model))
    boxes = [stages.box(thing.model) for thing in shot.objects]
    metadata = [lambda thing=thing: stages.metadata(thing.model) for thing in shot.objects]
    found: dict[str, list[float]] = {}
    rival = None
    for round_ in range(rounds + 1):
        for instant in range(len(shot.instants)):
            view = views.view(instant, 0)
            around = views.neighbours(instant, 0)

            def context(view: Any = view, around: Any = around, instant: int = instant) -> LabelContext:
                files = ["model.obj"] * len(boxes)
                seen = context_of(
                    shot, instant, view.camera, view.geometry, view.visibility, boxes, files, None, around, metadata
                )
                for placement in seen.placements:
                    if placement:
                        _ = placement.facts.diameter, placement.facts.keypoints
                return seen

            rival = rival or embree(view.geometry)
            times = frame(context, view, rival)
            if round_:
                for name, ms in times.items():
                    found.setdefault(name, []).append(ms)
    return {name: float(np.median(times)) for name, times in found.items()}, len(stage.at(0).triangles)


def frame(context: Callable[[], LabelContext], view: Any, cast: Any) -> dict[str, float]:
    """CPU milliseconds of one frame's labels by name."""
    times = {"Embree": clocked(lambda: cast[1](view.camera))}
    times[RASTER] = clocked(lambda: rasterize(view.geometry, view.camera))
    for name in still_channels():
        label, seen = channel_labels()[name], context()
        _ = seen.instances, seen.corners
        times[name] = clocked(lambda label=label, seen=seen: label.compute(seen))
    times["instances"] = clocked(lambda: fresh_instances(view))
    objects = annotated(context())
    for name in still_labels():
        label, seen = labels()[name], context()
        _ = seen.instances, seen.projected
        of = of_objects if isinstance(label, ObjectLabel) else of_picture
        times[name] = clocked(lambda of=of, label=label, seen=seen: of(label, seen, objects))
    return times


def fresh_instances(view: Any) -> Any:
    return Visibility(view.visibility.triangle, view.visibility.inverse_depth).instances(view.geometry)


def of_objects(label: ObjectLabel, seen: LabelContext, objects: Any) -> None:
    for o in objects:
        if label.compute is derived:
            label.restore(None, seen.placement(o.id - 1), o)
        else:
            label.compute(seen, o.id - 1)


def of_picture(label: SampleLabel, seen: LabelContext, objects: Any) -> None:
    label.compute(seen, objects)


def clocked(work: Callable[[], Any]) -> float:
    begun = time.process_time()
    work()
    return 1e3 * (time.process_time() - begun)


def report(rounds: int, embree: Callable[[Any], Any]) -> None:
    """Print the table."""
    (one, few), (many, triangles) = (measure(objects, rounds, embree) for objects in (1, 20))
    print(f"CPU ms a frame, 640x480: 1 object ({few:,} triangles), 20 objects ({triangles:,} triangles); in units of Embree\n")
    print(f"{'label':<22}{'1 object':>10}{'20 objects':>12}{'Embree 1':>10}{'Embree 20':>11}")
    few_moving, many_moving = (measure_moving(objects, rounds) for objects in (1, 20))
    one, many = one | few_moving, many | many_moving
    for name in one:
        units = one[name] / one["Embree"], many[name] / many["Embree"]
        print(f"{name:<22}{one[name]:>10.2f}{many[name]:>12.2f}{units[0]:>10.2f}{units[1]:>11.2f}")
    plain = many[RASTER] + sum(many[name] for name in PLAIN)
    together = sum(many[name] for name in TOGETHER)
    print(
        f"\n{' + '.join(TOGETHER)} of 20 objects: {together:.1f} ms, {together / plain:.2f} of {RASTER} + {' + '.join(PLAIN)}"
    )
