"""Engines paint the pictures of shots: one module per engine, with a `viewsphere.plugins.engine.EngineSpec`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, Self

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from viewsphere.model.shot import Shot
    from viewsphere.truth.raster.geometry import Geometry
    from viewsphere.truth.raster.visibility import Visibility


class Stage(Protocol):
    """The scene that an engine builds for a shot and reuses while time passes and the camera moves; instants and sensors count
    from 0.
    """

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant."""
        ...

    def paint(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """The named passes (`model.channel.PASSES`) of a sensor at an instant, limited to those that the engine's spec lists;
        `visibility` is truth's buffer of `at(instant)`.

        `rgb` is (H, W, 3) uint8 sRGB; `rgba` is (H, W, 4) with straight alpha and no background: black if nothing is visible.
        Laid over a plain background, `rgba` equals the `rgb` with that background. All others are float32, (H, W, 3) or (H, W).
        Like labels, they are for the middle of the exposure and a pinhole, and they are without the finish. `residual` includes
        the sky if the picture does.
        """
        ...

    def for_shot(self, shot: Shot) -> Self:
        """A stage for another shot with an equal `stage_key`, which reuses everything built for still things."""
        ...
