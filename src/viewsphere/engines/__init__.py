"""Engines paint the pictures of shots: one module an engine, with a `viewsphere.plugins.engine.EngineSpec`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, Self

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from viewsphere.model.shot import Shot
    from viewsphere.truth.raster.geometry import Geometry
    from viewsphere.truth.raster.visibility import Visibility


class Stage(Protocol):
    """The scene that an engine builds for a shot and reuses while time and camera move; instants and sensors count from 0."""

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant."""
        ...

    def paint(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """The named passes (`model.channel.PASSES`) of a sensor at an instant, of those that the engine's spec lists;
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
