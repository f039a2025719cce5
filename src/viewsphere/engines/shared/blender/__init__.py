"""The engines `cycles`, `eevee` and `workbench`, except for their names and flags: they differ only in Blender's renderer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from pydantic import JsonValue

    from viewsphere.assets.animation.deforming import Load
    from viewsphere.engines.shared.blender.staging import CyclesStage
    from viewsphere.model.sample import Sample
    from viewsphere.model.scene import Finish
    from viewsphere.model.shot import Shot

PROGRAMS = (Path(__file__).parent, Path(__file__).parents[3] / "blender" / "worker")
"""Source folders that the pictures of all these renderers depend on."""


def check(options: Mapping[str, JsonValue], renderer: str) -> None:
    """Raise UserError for an unknown option (with the nearest name), a value out of range, a missing Blender, or a script that
    is missing or not allowed.
    """
    from viewsphere.blender.interpreter import find_blender
    from viewsphere.engines.shared.blender.options import options_of
    from viewsphere.engines.shared.blender.scripts import check_script

    checked = options_of(renderer, options)
    check_script(checked.script)
    find_blender(checked.python)


def stage(shot: Shot, load: Load) -> CyclesStage:
    """Build the shot's scene in Blender, and its geometry here; the shot's engine selects the renderer.

    Raises UserError for an unknown engine option, a value out of range, or a Blender that cannot be used.
    """
    from viewsphere.engines.shared.blender.staging import build_stage

    return build_stage(shot, load)


def indices(shot: Shot, instant: int, sensor: int, load: Load) -> NDArray[np.int32] | None:
    """Ids of the objects that Cycles sees in each pixel, (H, W) int32; see `staging.indices`."""
    from viewsphere.engines.shared.blender import staging

    return staging.indices(shot, instant, sensor, load)


def save(shot: Shot, samples: Sequence[Sample], load: Load, file: Path, data: str) -> tuple[str, ...]:
    """Write a shot of any engine as a .blend file, with the cameras of its frames' samples; see `saving.save`."""
    from viewsphere.engines.shared.blender import saving

    return saving.save(shot, samples, load, file, data)


def shows_sky(shot: Shot, finish: Finish) -> bool:
    """Return whether a picture of a shot shows the sky behind all things; `save` needs frames that agree in this."""
    from viewsphere.engines.shared.blender import saving

    return saving.shows_sky(shot, finish)
