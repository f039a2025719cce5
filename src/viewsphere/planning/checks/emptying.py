"""Empty pictures: frames in which the models are not there, all else is as it would be with them."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.composing.composition import BoxOf
from viewsphere.model.scene import IDENTITY, Floor
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing


def emptied(shot: Shot, empty: Sequence[bool], box_of: BoxOf) -> Shot:
    """A shot of still pictures without its targets at the instants that are to be `empty`; scenery and ground stay.

    All shots of a recipe come through here, those without an empty picture too: what is painted of a thing may not depend on
    which pictures share its shot.
    """
    things = tuple(_absent(thing, empty) if thing.is_target else thing for thing in shot.things)
    scene = shot.scene
    if scene.ground is not None:
        height = _lowest(shot, box_of) if scene.floor is None else scene.floor.height
        scene = scene.model_copy(update={"floor": Floor(height=height, is_fixed=True)})
    return shot.model_copy(update={"things": things, "scene": scene})


def _lowest(shot: Shot, box_of: BoxOf) -> float:
    """The lowest point of a model alone, in whose axes the world is; what is placed stands on z = 0."""
    first = shot.things[0]
    return float(box_of(first.model, first.step)[:, 2].min()) + 0.0 if first.world_from_object == IDENTITY else 0.0


def _absent(thing: Thing, empty: Sequence[bool]) -> Thing:
    """The thing, which stands still, where it is there."""
    at = thing.motion.poses[0]
    motion = Motion(poses=tuple(None if is_empty else at for is_empty in empty), steps=thing.motion.steps, moves=True)
    return thing.model_copy(update={"motion": motion})
