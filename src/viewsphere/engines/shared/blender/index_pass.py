"""Cycles' own pass of object indices: an independent image of the object visible in each pixel."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import Load
from viewsphere.codecs.npz import load_array
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.requests import members_of
from viewsphere.engines.shared.blender.staging import FRAME_SECONDS, STAGE_SECONDS, Arrangement, build_stage, camera_request
from viewsphere.errors import BlenderError, UserError
from viewsphere.model.shot import Shot

SHARP = {"pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
"""Settings of Cycles that make it sample only the middles of pixels."""


def indices(shot: Shot, instant: int, sensor: int, load: Load) -> NDArray[np.int32] | None:
    """Ids of the objects that Cycles sees through the middles of a sensor's pixels at an instant, (H, W) int32, 0 for none;
    None for a lens that Blender lacks.

    A Blender that dies or hangs is restarted once. Raises ModelError if it dies again, UserError if Blender cannot be used, or
    cannot build the scene.
    """
    camera = shot.camera(instant, sensor)
    if not camera.lens.is_linear or camera.intrinsics.skew:
        return None
    python = shot.engine_options.get("python") if shot.engine == "cycles" else None
    options = {"python": python, "samples": 1, "bounces": 0, "denoise": "off", "settings": SHARP}
    stage = build_stage(shot.model_copy(update={"engine": "cycles", "engine_options": options}), load).arrangement(instant)
    view = FileFrame.from_blend(shot.scene.blend).camera(camera_request(camera))
    try:
        return stage.keeper.insist(partial(_rendered, stage, view), stage.named)
    except BlenderError as error:
        raise UserError(f"{stage.named}: {error.reason}") from error
    finally:
        stage.keeper.forget()  # the numbers are not those of the file


def _rendered(stage: Arrangement, view: dict[str, Any]) -> NDArray[np.int32]:
    """The ids in Blender's pass, for a camera."""
    process = stage.keeper.process_for(stage)
    out = process.folder / "seen.npy"
    process.ask("number", STAGE_SECONDS, members=members_of(stage.shot), alpha=stage.shot.label_alpha)
    process.ask("render", FRAME_SECONDS, camera=view, out=str(out), transparent=True, border=None, passes=["index"])
    return np.rint(load_array(out.with_suffix(".index.npy"))[..., 0]).astype(np.int32)
