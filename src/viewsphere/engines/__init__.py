"""Engines paint the pictures of shots; these are the protocols that an engine implements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray
    from pydantic import JsonValue

    from viewsphere.assets.deforming import Load
    from viewsphere.model.shot import Shot
    from viewsphere.truth.geometry import Geometry
    from viewsphere.truth.visibility import Visibility


class Stage(Protocol):
    """What an engine built for a shot and keeps warm while time and camera move; instants and sensors count from 0."""

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant."""
        ...

    def color(self, instant: int, sensor: int, visibility: Visibility, transparent: bool) -> NDArray[np.uint8]:
        """The picture of a sensor at an instant, (H, W, 3) uint8 sRGB; `visibility` is truth's buffer of `at(instant)`.

        With `transparent`, (H, W, 4) with straight alpha and no background: black where nothing is seen. Laid over
        a plain background, this picture equals the one painted with that background.
        """
        ...

    def of(self, shot: Shot) -> Self:
        """A stage for another shot of an equal `stage_key`, which reuses everything built for things that stand still."""
        ...


class Engine(Protocol):
    """A module that paints pictures: `check` its options, `stage` a shot. Only with `OPENS_SCENES = True` it is given shots
    whose scene is a .blend file (`scene.blend`); with `CATCHES_SHADOWS = False` none whose ground is a shadow catcher.
    """

    def check(self, options: Mapping[str, JsonValue]) -> None:
        """Raise UserError for an option that is not known, or out of range; asked before anything is rendered."""
        ...

    def stage(self, shot: Shot, load: Load) -> Stage:
        """Build what all frames of the shot share; `load` gives a model's normalised mesh."""
        ...
