"""Engines paint the pictures of shots; these are the protocols that an engine implements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, Self

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from numpy.typing import NDArray
    from pydantic import JsonValue

    from viewsphere.assets.deforming import Load
    from viewsphere.model.shot import Shot
    from viewsphere.truth.raster.geometry import Geometry
    from viewsphere.truth.raster.visibility import Visibility


class Stage(Protocol):
    """What an engine built for a shot and keeps warm while time and camera move; instants and sensors count from 0."""

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant."""
        ...

    def paint(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """The named passes (`model.channel.PASSES`) of a sensor at an instant, of those that the engine's `PAINTS` lists;
        `visibility` is truth's buffer of `at(instant)`.

        `rgb` is (H, W, 3) uint8 sRGB; `rgba` (H, W, 4) with straight alpha and no background: black where nothing is seen.
        Laid over a plain background, it equals the `rgb` with that background. All others are float32, (H, W, 3) or (H, W), of
        the shutter's centre and a pinhole as labels are, and without the finish. Where the picture shows the sky, `residual`
        does, too.
        """
        ...

    def of(self, shot: Shot) -> Self:
        """A stage for another shot of an equal `stage_key`, which reuses everything built for things that stand still."""
        ...


class Engine(Protocol):
    """A module that paints pictures: `check` its options, `stage` a shot. Only with `OPENS_SCENES = True` it is given shots
    whose scene is a .blend file (`scene.blend`); with `CATCHES_SHADOWS = False` none whose ground is a shadow catcher. `PAINTS`
    lists the passes that it paints; without it these are the pictures, `rgb` and `rgba`.
    """

    def check(self, options: Mapping[str, JsonValue]) -> None:
        """Raise UserError for an option that is not known, or out of range; asked before anything is rendered."""
        ...

    def stage(self, shot: Shot, load: Load) -> Stage:
        """Build what all frames of the shot share; `load` gives a model's normalised mesh."""
        ...
