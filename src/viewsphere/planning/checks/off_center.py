"""Pictures in which what the camera looks at is not in the middle: the camera is moved aside, and looks where it looked."""

from __future__ import annotations

import numpy as np

from viewsphere.model.instant import Instant
from viewsphere.model.shot import Shot
from viewsphere.planning.samplers import SamplingContext
from viewsphere.recipe.finish import JitterEntry


def off_center(context: SamplingContext, subject: str, shot: Shot) -> Shot:
    """The shot with its cameras moved in their pictures' planes, as its recipe's jitter says: what they look at keeps its
    distance along the camera's axis, and so its size. Cameras without a viewpoint of their own stay.
    """
    if context.recipe.scene.jitter.off_center == JitterEntry().off_center:
        return shot
    instants = tuple(_moved(context, subject, shot, i) for i in range(len(shot.instants)))
    return shot.model_copy(update={"instants": instants})


def _moved(context: SamplingContext, subject: str, shot: Shot, i: int) -> Instant:
    now, lens = shot.instants[i], shot.camera(i).intrinsics
    view = now.viewpoint
    if view is None:
        return now
    right, down = context.scenes.jitter(subject, context.jitter_name(view.index)).off_center
    pose = np.array(now.world_from_rig)
    x, y = -right * lens.width * view.distance / lens.fx, -down * lens.height * view.distance / lens.fy
    by = x * pose[:3, 0] + y * pose[:3, 1]
    pose[:3, 3] += by
    target = tuple((np.array(view.target or now.focus) + by).tolist())
    rows = tuple(map(tuple, pose.tolist()))
    return now.model_copy(
        update={"world_from_rig": rows, "focus": target, "viewpoint": view.model_copy(update={"target": target})}
    )
