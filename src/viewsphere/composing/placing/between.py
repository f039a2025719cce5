"""Between the camera and the frame's model, which is partly hidden: for company that is drawn for each frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.composing.placing import Draws, Room, Shape, draws_of, footprint, standing
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Strength
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import Drawn, drawn

TRIES = 200
"""Number of tried spots for one thing; each is a little farther from the model."""


class _Options(Frozen):
    """The options for objects in the line of sight."""

    stand: Literal["floor", "sight"] = Field(
        default="floor", description="floor: on the floor; sight: in the air on the line of sight, for cameras high above"
    )
    aside: Drawn[Strength] = Field(
        default=1.0,
        description="largest offset from the line of sight, as a share of both widths together: at 1 it hides nothing",
    )


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses turned at random, as near to the model as the gap allows, or a little farther; raises RecipeError if there is not
    enough room, or no known camera.
    """
    if room.seen_from is None or not room.taken:
        raise RecipeError(
            f"{room.field}.layout: expected scene.company with draw: per_frame, and viewpoints whose angles are known, for "
            "between; found none: write scene: {company: {count: 1, layout: between, draw: per_frame}}"
        )
    azimuth, elevation = map(math.radians, room.seen_from)
    ahead, across = np.array([math.sin(azimuth), -math.cos(azimuth)]), np.array([math.cos(azimuth), math.sin(azimuth)])
    target, pose = room.taken[0]
    middle = transform(np.array(pose), target.box.mean(axis=0))
    own = room.prints[0]
    depth, width = (float(np.abs(own.axes @ axis) @ own.half) for axis in (ahead, across))
    prints, poses = list(room.prints), list[Matrix4]()
    for slot, (spec, shape) in enumerate(zip(cast, shapes, strict=True)):
        draws = rng(str(slot), spec.key)
        most = drawn(options.aside, draws_of(rng, str(slot), spec.key))
        size = Box3d(shape.box).diagonal[:2]
        half = float(np.linalg.norm(size)) / 2
        for number in range(TRIES):
            side, turn = (2 * draws.random() - 1) * most * (width + half), 360 * draws.random()
            far = depth + room.gap + (float(size.min()) / 2 + half * number / TRIES * 4)
            spot = middle[:2] + far * ahead + side * across
            made = np.array(standing(shape.box, 0.0, 0.0, turn))
            made[:2, 3] = spot - (made[:3, :3] @ shape.box.mean(axis=0))[:2]
            if options.stand == "sight":
                height = float(middle[2]) + far * math.tan(elevation) - float(np.ptp(shape.box[:, 2])) / 2
                made[2, 3] += max(height, 0.0)
            found: Matrix4 = tuple(map(tuple, made.tolist()))  # type: ignore[assignment]
            covered = footprint(shape.box, found)
            if (room.free is None or room.free.contains(covered)) and all(covered.apart(one, room.gap) for one in prints):
                break
        else:
            raise RecipeError(f"{room.field}: expected room for {spec.key} before the model; found none: ask for fewer")
        poses.append(found)
        prints.append(covered)
    return poses


PLACER = PlacerSpec(options=_Options, place=_place)
