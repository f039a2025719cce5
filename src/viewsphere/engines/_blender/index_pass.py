"""Cycles' own pass of object indices: an independent picture of which object each pixel sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.deforming import Load
from viewsphere.engines._blender.file_frame import FileFrame
from viewsphere.engines._blender.staging import FRAME_SECONDS, STAGE_SECONDS, build_stage, camera_request
from viewsphere.errors import BlenderError, UserError
from viewsphere.model.shot import Shot

SHARP = {"pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
"""Settings of Cycles by which it looks through the middles of pixels alone."""


def indices(shot: Shot, instant: int, sensor: int, load: Load) -> NDArray[np.int32] | None:
    """Ids of the objects that Cycles sees through the middles of a sensor's pixels at an instant, (H, W) int32, 0 for none;
    None for a lens that Blender has not.

    Raises UserError where Blender cannot be used, or cannot build the scene.
    """
    camera = shot.camera(instant, sensor)
    if camera.distortion is not None or camera.intrinsics.skew:
        return None
    python = shot.engine_options.get("python") if shot.engine == "cycles" else None
    options = {"python": python, "samples": 1, "bounces": 0, "denoise": "off", "settings": SHARP}
    stage = build_stage(shot.model_copy(update={"engine": "cycles", "engine_options": options}), load).arrangement(instant)
    process = stage.keeper.process_for(stage)
    members = {name: thing.id for thing in shot.objects for name in (thing.model.parts and thing.model.parts.only) or ()}
    view = FileFrame.of(shot.scene.blend).camera(camera_request(camera))
    out = process.folder / "seen.npy"
    try:
        process.ask("number", STAGE_SECONDS, members=members, alpha=shot.label_alpha)
        process.ask("render", FRAME_SECONDS, camera=view, out=str(out), transparent=True, border=None, passes=["index"])
        return np.rint(np.load(out.with_suffix(".index.npy"))[..., 0]).astype(np.int32)
    except BlenderError as error:
        raise UserError(str(error)) from error
    finally:
        stage.keeper.drop()  # the numbers are not those of the file
