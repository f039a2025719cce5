"""A shot as a .blend file to open in Blender: the request to the worker's `save` (`viewsphere.blender.worker.scene.saving`)."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.assets.animation.deforming import Load
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.srgb import encoded
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.lens import is_rendered
from viewsphere.engines.shared.blender.requests import members_of
from viewsphere.engines.shared.blender.staging import STAGE_SECONDS, Arrangement, build_stage, camera_request
from viewsphere.geometry.camera import orbit_angles
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import Sample
from viewsphere.model.scene import Finish
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.rendering.background import display_background
from viewsphere.rendering.effects import steps_of
from viewsphere.rendering.view import EXPOSURE
from viewsphere.rendering.white import NEUTRAL_K

NEAREST, FARTHEST = 1e-3, 1e5
"""The camera's clipping range, in distances to its target: with a larger one, surfaces would flicker in Blender's windows."""

SAME = 1e-6
"""Targets that differ by less, in camera distances, count as the same target."""

MOST_OFF = 1e-4
"""Largest error of the camera that needs no note, in distances to its target: it is invisible."""

TEXT = """\
{name}, which viewsphere made from the data set {data}.

Render any frame of the timeline to see that picture: its marker says which frame of the data set it is, and which side the
camera sees. The camera hangs on the object `viewing sphere`, which stands where `target` is: the sphere's rotation about X is
90 degrees less the elevation, that about Z the azimuth, its scale the distance; the camera's own rotation about Z is the tilt.

The pass index of an object is its number in the data set's instance maps; its custom properties say what it is.
"""


def save(shot: Shot, samples: Sequence[Sample], load: Load, file: Path, data: str) -> tuple[str, ...]:
    """Write a shot's scene, with the cameras of these samples, which are those of its frames, in order.

    The pictures have one size and shape of pixels, and all or none of them show the sky. A shot of another engine is written as
    Cycles would render it. Changing backgrounds are stored next to the file, in a folder with its name. `data` is the data
    set's name. Returns a line for each thing that the file could not store. Raises UserError if Blender cannot be used,
    ModelError if Blender dies twice.
    """
    script: tuple[str, ...] = ()
    kept = shot.engine_options if shot.engine == "cycles" else {"python": shot.engine_options.get("python")}
    if kept.get("script") is not None:
        kept, script = {**kept, "script": None}, ("what engine.script changes is not in the file",)
    own = shot.model_copy(update={"engine": "cycles", "engine_options": {**kept, "device": "cpu"}})
    stage = build_stage(own, load).arrangement(0)
    finishes = [shot.finish(instant) for instant in range(len(shot.instants))]
    request = _request(shot, samples, finishes, file.stem, data)
    off = stage.keeper.insist(partial(_ask, stage, request, finishes, samples[0].camera, file), file.name)
    return script + tuple(_lacking(samples, finishes, off / max(pose["distance"] for pose in request["poses"])))


def _is_clear(shot: Shot) -> bool:
    """Return whether a shot's pictures have no background at all."""
    return picture_of(shot.channels) == "rgba"


def shows_sky(shot: Shot, finish: Finish) -> bool:
    """Return whether a picture of a shot shows the sky behind all things."""
    return not _is_clear(shot) and finish.background.color is None and finish.background.image is None


def _ask(stage: Arrangement, request: dict[str, Any], finishes: Sequence[Finish], camera: Camera, file: Path) -> float:
    """Request Blender to write the file; return the largest error of its cameras, in the file's units."""
    process = stage.keeper.process_for(stage)
    background, sequence = None, ""
    if request["is_open"] and not request["transparent"] and not request["is_users"]:
        behind = [finish.background for finish in finishes]
        sequence = file.stem if any(b != behind[0] for b in behind) else ""
        folder = file.with_suffix("") if sequence else process.folder
        folder.mkdir(exist_ok=True)
        background = str(folder.absolute() / "0001.png")
        for number, one in enumerate(behind if sequence else behind[:1], 1):
            display = display_background(one, camera.width, camera.height)
            assert display is not None
            pixels = np.round(encoded(display) * 255).astype(np.uint8).reshape(camera.height, camera.width, 3)
            (folder / f"{number:04d}.png").write_bytes(encode_png(pixels))
    saved = process.folder / "saved.blend"  # Blender may be forbidden to write anywhere else
    answer = process.ask("save", STAGE_SECONDS, **request, file=str(saved), background=background, sequence=sequence)
    shutil.move(saved, file)
    return answer["off"]


def _request(shot: Shot, samples: Sequence[Sample], finishes: Sequence[Finish], name: str, data: str) -> dict[str, Any]:
    """The worker's request, without the background pictures."""
    views = [finish.view for finish in finishes]
    temperatures = {view.temperature_k for view in views} - {NEUTRAL_K}
    return {
        "name": name,
        "text": TEXT.format(name=name, data=data),
        "poses": _poses_request(samples, FileFrame.from_blend(shot.scene.blend)),
        "objects": _objects_request(samples),
        "members": members_of(shot),
        "properties": {"data set": data, "frames": [sample.index for sample in samples]},
        "is_users": shot.scene.blend is not None,
        "is_open": not shows_sky(shot, finishes[0]),
        "transparent": _is_clear(shot),
        "transform": views[0].transform,
        "exposures": [math.log2(EXPOSURE) + view.exposure for view in views],
        "temperature_k": views[0].temperature_k if temperatures else None,
    }


def _poses_request(samples: Sequence[Sample], frame: FileFrame) -> list[dict[str, Any]]:
    """The rig's pose at each sample, as an orbit around a point on the camera's axis, even for 6 DoF poses."""
    poses: list[dict[str, Any]] = []
    nearest, farthest = (f(sample.pose.distance for sample in samples) for f in (min, max))
    still = np.full(3, np.inf)
    for sample in samples:
        distance = sample.pose.distance
        target = sample.camera.center + distance * sample.camera.R[2]
        still = still if np.abs(target - still).max() <= SAME * distance else target
        clipped = {"near": NEAREST * nearest, "far": FARTHEST * farthest}
        camera = frame.camera(camera_request(sample.camera) | clipped)
        azimuth, elevation, tilt = np.degrees(orbit_angles(camera["R"])).tolist()
        poses.append(
            {
                "name": f"frame {sample.index} {sample.pose.category}".strip(),
                "target": frame.point(still),
                "distance": distance / frame.unit,
                "azimuth": azimuth,
                "elevation": elevation,
                "tilt": tilt,
                "camera": camera,
            }
        )
    return poses


def _objects_request(samples: Sequence[Sample]) -> dict[str, dict[str, Any]]:
    """Custom properties by object id; pose categories by frame of the timeline."""
    request: dict[str, dict[str, Any]] = {}
    for number, sample in enumerate(samples, 1):
        for o in sample.objects:
            known = {"id": o.id, "category": o.category, "supercategory": o.supercategory, "model": o.key}
            one = request.setdefault(str(o.id), {**known, "pose categories": {}})
            one["pose categories"][str(number)] = o.pose_category
    return request


def _lacking(samples: Sequence[Sample], finishes: Sequence[Finish], off: float) -> Iterator[str]:
    """Lines about lens and picture properties that the .blend file lacks; `off` is the camera's error in distances."""
    if off > MOST_OFF:
        yield f"the camera is off by up to {off:.1g} of its distance: Blender's numbers are single, the origin far"
    if not all(is_rendered(sample.camera, is_traced=True) for sample in samples):
        yield "Blender's camera has no such distortion or skew: a pinhole of the same focal lengths and centre takes its place"
    if any(any(steps_of(f.effects)) or f.smoother.kind != "none" for f in finishes):
        yield "scene.effects and scene.smoother are not in the file: viewsphere does them to the finished picture"
    views = [finish.view.model_copy(update={"exposure": 0.0}) for finish in finishes]
    if any(view != views[0] or view.tint for view in views):
        yield "a view transform, temperature or tint that changes is not in the file: the first frame's is"
