"""The inputs of labels in addition to the view of the picture's own camera at its instant: `needs=(Next(1), Partner())`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from viewsphere.model.scene import Finish
    from viewsphere.model.sensors.camera import Intrinsics
    from viewsphere.model.sensors.rig import Sensor
    from viewsphere.model.shot import Shot
    from viewsphere.recipe.recipe import Recipe
    from viewsphere.truth.lidar.sweeping import Turning
    from viewsphere.truth.shot_views import Followed, Moment, NeighbourViews, Painted
    from viewsphere.truth.surface_points.points import SurfacePoints
    from viewsphere.truth.view import View

T = TypeVar("T")


@dataclass(frozen=True)
class Need(ABC, Generic[T]):
    """An input of a label. `LabelContext.get` returns it to labels that list it in their `needs`."""

    SECTION: ClassVar[str] = ""
    """The section of a recipe that provides the input; empty: all recipes provide it."""

    PURPOSE: ClassVar[str] = ""
    """The part of an error message that describes the section."""

    IS_RECORDED: ClassVar[bool] = False
    """True if a data set provides the input only if its recipe requested the label."""

    @abstractmethod
    def read(self, neighbours: NeighbourViews) -> T:
        """Return the input for the picture whose neighbours these are."""

    def is_missing(self, recipe: Recipe) -> bool:
        """Return whether a recipe does not provide the input."""
        return bool(self.SECTION) and getattr(recipe, self.SECTION) is None

    @property
    def view_offset(self) -> int:
        """The instant whose triangles are read, relative to the picture's own; 0: none but its own."""
        return 0

    @property
    def pose_offset(self) -> int:
        """The instant whose poses are read, relative to the picture's own; 0: none but its own."""
        return self.view_offset


class _OfTime(Need[T]):
    SECTION: ClassVar[str] = "time"
    PURPOSE: ClassVar[str] = "whose instants are compared"


@dataclass(frozen=True)
class Next(_OfTime["View | None"]):
    """The view of the picture's own sensor a number of instants later; None at the end of a sequence."""

    instants: int = 1

    @property
    def view_offset(self) -> int:
        """The number of instants between the two."""
        return self.instants

    def read(self, neighbours: NeighbourViews) -> View | None:
        """Return the view."""
        return neighbours.view(self.view_offset, None)


@dataclass(frozen=True)
class Previous(_OfTime["View | None"]):
    """The view of the picture's own sensor a number of instants earlier; None at the beginning of a sequence."""

    instants: int = 1

    @property
    def view_offset(self) -> int:
        """The number of instants of the need, as a negative number."""
        return -self.instants

    def read(self, neighbours: NeighbourViews) -> View | None:
        """Return the view."""
        return neighbours.view(self.view_offset, None)


@dataclass(frozen=True)
class Poses(_OfTime["Moment | None"]):
    """Poses and cameras a number of instants later, or earlier if negative; None if the shot has no such instant."""

    instants: int

    @property
    def pose_offset(self) -> int:
        """The number of instants between the two."""
        return self.instants

    def read(self, neighbours: NeighbourViews) -> Moment | None:
        """Return the poses."""
        return neighbours.moment(self.instants)


class Partner(Need["View | None"]):
    """The view of the first sensor that is rectified with the picture's own, or of the first panorama above or below it; None
    without one.
    """

    SECTION: ClassVar[str] = "rig"
    PURPOSE: ClassVar[str] = "with a sensor that is rectified with its own"

    def read(self, neighbours: NeighbourViews) -> View | None:
        """Return the view."""
        partner = neighbours.partner
        return None if partner is None else neighbours.view(0, partner[0])


class RigPoses(Need["Moment | None"]):
    """The poses of all sensors of the rig at the picture's instant."""

    SECTION: ClassVar[str] = "rig"
    PURPOSE: ClassVar[str] = "whose sensors are compared"

    def read(self, neighbours: NeighbourViews) -> Moment | None:
        """Return the poses."""
        return neighbours.moment(0)


class OwnView(Need["View | None"]):
    """The picture's own view, to look up points of objects in it."""

    def read(self, neighbours: NeighbourViews) -> View | None:
        """Return the view."""
        return neighbours.view(0, None)


class ObjectPoints(Need["Callable[[int], SurfacePoints]"]):
    """Random points on the surfaces of objects, as a function of the number of points per object."""

    def read(self, neighbours: NeighbourViews) -> Callable[[int], SurfacePoints]:
        """Return the function."""
        return neighbours.surface


class FollowedPoints(Need["Followed"]):
    """The points that the picture's sensor follows through the sequence."""

    SECTION: ClassVar[str] = "tracks"
    PURPOSE: ClassVar[str] = "which say what is followed"
    IS_RECORDED: ClassVar[bool] = True

    def read(self, neighbours: NeighbourViews) -> Followed:
        """Return the points, which are picked at the first request."""
        return neighbours.followed


class Scanner(Protocol):
    """The measurement of a LiDAR: its sensor, the appearance of surfaces, and the motion while it turns."""

    @property
    def sensor(self) -> Sensor:
        """The sensor, whose `lidar` is None for a camera."""
        ...

    @property
    def painted(self) -> Painted:
        """The appearance of surfaces at the picture's instant."""
        ...

    def turning(self, seconds: float) -> Turning:
        """Return the motion of the scene during the given seconds, while the columns of the picture are measured one after
        another.
        """
        ...


class LidarScan(Need[Scanner]):
    """The measurement of a LiDAR."""

    SECTION: ClassVar[str] = "rig"
    PURPOSE: ClassVar[str] = "with a LiDAR among its sensors"
    IS_RECORDED: ClassVar[bool] = True

    def read(self, neighbours: NeighbourViews) -> Scanner:
        """Return the measurement."""
        return neighbours

    def is_missing(self, recipe: Recipe) -> bool:
        """Return whether no sensor of the recipe is a LiDAR."""
        return not getattr(recipe.rig, "has_lidar", False)


class Randomness(Need[tuple[str, ...]]):
    """The names that, together with a seed, determine the random values of the picture's labels."""

    def read(self, neighbours: NeighbourViews) -> tuple[str, ...]:
        """Return the names, for `viewsphere.labels.shared.randomness.generator`."""
        return neighbours.drawn_as


class Scenery(Protocol):
    """The shot of a picture, its sensor, and the settings that develop light into the picture."""

    @property
    def shot(self) -> Shot:
        """The shot."""
        ...

    @property
    def sensor(self) -> Sensor:
        """The picture's own sensor."""
        ...

    @property
    def finish(self) -> Finish:
        """The settings."""
        ...


class ShotAppearance(Need[Scenery]):
    """The appearance of the shot's things, its sky and its weather. Models then carry their colours and materials."""

    IS_RECORDED: ClassVar[bool] = True

    def read(self, neighbours: NeighbourViews) -> Scenery:
        """Return the shot and its settings."""
        return neighbours


def requires(needs: tuple[Need[Any], ...], kind: type[Need[Any]]) -> bool:
    """Return whether any of these needs is of the kind."""
    return any(isinstance(need, kind) for need in needs)


def no_disparity(intrinsics: Intrinsics) -> str | None:
    """The reason why pictures of this lens have no disparity; None if they have."""
    if not intrinsics.lens.is_parallel:
        return None
    return (
        f"expected a lens whose rays pass through one centre; found {intrinsics.lens.name}, whose disparity is constant, "
        f"baseline x {intrinsics.fx:g} pixels a metre: leave it out"
    )


def no_sides(intrinsics: Intrinsics) -> str | None:
    """The reason why words for left and right do not fit pictures of this lens; None if they do."""
    if intrinsics.lens.has_depth:
        return None
    return f"expected a lens whose pictures have a left and a right; found {intrinsics.lens.name}: leave it out"
