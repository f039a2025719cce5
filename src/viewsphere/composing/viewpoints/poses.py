"""From a recipe's viewpoints to poses, and from a pose to a camera."""

from __future__ import annotations

import hashlib
import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self, cast, overload

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.seeds import generator
from viewsphere.composing.viewpoints.pose_files import Arranged, Extrinsics, Orbit, PoseFile, read_poses
from viewsphere.errors import RecipeError
from viewsphere.files import written_path
from viewsphere.geometry.pose_category import pose_category
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.model.instant import Viewpoint, viewpoint_of
from viewsphere.model.scene import Vector
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.cameras.aim import Fill, FillBetween
from viewsphere.recipe.cameras.viewpoints import Grid, Jitter, Normal, PoseList, Sphere, Viewpoints, axis_value
from viewsphere.recipe.values import Range

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Poses(Sequence[Viewpoint]):
    """The poses of a recipe, in index order, made one by one on access: a million of them take no memory.

    `counts` are the factors of their number, outermost loop first.
    """

    viewpoints: Viewpoints
    seed: int

    @property
    def digest(self) -> str:
        """SHA-256 of the file of poses; empty without one."""
        return ""

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens of the file of poses; the first pose's lens if poses have their own."""
        return None

    def lens(self, index: int) -> Intrinsics | None:
        """The pose's own lens, None if all share one."""
        return None

    @property
    def lowest_elevation(self) -> float:
        """The lowest possible elevation, degrees; for a normal distribution, its mean."""
        assert isinstance(self.viewpoints, Grid | Sphere | Normal | Jitter)
        elevation = self.viewpoints.elevation
        if isinstance(elevation, Range):
            elevation = elevation.start
        return min(elevation) if isinstance(elevation, tuple) else elevation

    @property
    def are_known(self) -> bool:
        """Return whether the recipe alone determines the cameras' positions."""
        return not isinstance(getattr(self.viewpoints, "distance", None), Fill | FillBetween)

    def fill(self, index: int) -> float | None:
        """The share of the picture that a model fills, from which the pose's distance follows; None if it is given."""
        return None

    def target(self, index: int) -> Vector | None:
        """Return the point the camera looks at, world metres; None: the centre of the model's box."""
        target = self.viewpoints.target
        return target if isinstance(target, tuple) else None

    @property
    @abstractmethod
    def counts(self) -> dict[str, int]:
        """The size of each axis of the poses; the product is the number of poses."""

    @abstractmethod
    def name(self, index: int) -> str:
        """The pose's stable name: equal for the same pose wherever it stands in the list."""

    def place(self, index: int) -> str:
        """The pose's name without its time: equal at all time steps of an animation."""
        return self.name(index)

    @abstractmethod
    def view(self, index: int) -> Orbit:
        """Return the orbit of the camera."""

    @property
    def are_shared(self) -> bool:
        """Return whether random poses are the same for all subjects."""
        return getattr(self.viewpoints, "shared", False)

    def for_subject(self, subject: str) -> Poses:
        """The poses of a subject: random ones are drawn for each subject, unless they are shared."""
        return self if self.are_shared else self.drawn_for(subject)

    def drawn_for(self, name: str) -> Poses:
        """The same poses, random ones drawn anew for this name."""
        return replace(self, seed=int(generator(self.seed, "viewpoints", name).integers(2**63)))

    @cached_property
    def _length(self) -> int:
        return math.prod(self.counts.values())

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> Viewpoint: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Viewpoint]: ...
    def __getitem__(self, index: int | slice) -> Viewpoint | Sequence[Viewpoint]:
        if isinstance(index, slice):
            return tuple(self._pose(i) for i in range(*index.indices(len(self))))
        i = index + len(self) if index < 0 else index
        if not 0 <= i < len(self):
            raise IndexError(f"expected a pose of 0..{len(self) - 1}, got {index}")
        return self._pose(i)

    def _pose(self, index: int) -> Viewpoint:
        view = self.view(index)
        return Viewpoint(
            index=index,
            azimuth_deg=view.azimuth,
            elevation_deg=view.elevation,
            distance=view.distance,
            tilt_deg=view.tilt,
            fill=self.fill(index),
            target=self.target(index),
            category=pose_category(view.azimuth, view.elevation, self.viewpoints.bins),
        )


@dataclass(frozen=True)
class RepeatedPoses(Poses):
    """Poses that are each used several times; all properties except the time come from the base pose."""

    base: Poses

    @abstractmethod
    def base_number(self, index: int) -> int:
        """The number of the base pose."""

    def drawn_for(self, name: str) -> Self:
        """The same repeated poses, random ones drawn anew for this name."""
        base = self.base.drawn_for(name)
        return self if base is self.base else replace(self, viewpoints=base.viewpoints, seed=base.seed, base=base)

    def target(self, index: int) -> Vector | None:
        """The base pose's target."""
        return self.base.target(self.base_number(index))

    def place(self, index: int) -> str:
        """The base pose's name without its time."""
        return self.base.place(self.base_number(index))

    def view(self, index: int) -> Orbit:
        """The base pose's orbit."""
        return self.base.view(self.base_number(index))

    def fill(self, index: int) -> float | None:
        """The base pose's filled share."""
        return self.base.fill(self.base_number(index))

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens that a file of poses names."""
        return self.base.intrinsics

    def lens(self, index: int) -> Intrinsics | None:
        """The base pose's own lens."""
        return self.base.lens(self.base_number(index))

    @property
    def lowest_elevation(self) -> float:
        """The lowest elevation of the base poses."""
        return self.base.lowest_elevation

    @property
    def are_known(self) -> bool:
        """Return whether the base poses are known."""
        return self.base.are_known


@dataclass(frozen=True)
class _GridPoses(Poses):
    """The combinations of a grid: tilt outermost, then distance, elevation, azimuth innermost."""

    viewpoints: Grid | Jitter

    def drawn_for(self, name: str) -> Poses:
        """The same poses: nothing is random."""
        return self

    @property
    def counts(self) -> dict[str, int]:
        """Number of tilts, distances, elevations and azimuths."""
        return self.viewpoints.axis_counts

    def name(self, index: int) -> str:
        """The pose's values."""
        fill = self.fill(index)
        return "pose " + " ".join(repr(v + 0.0) for v in self.view(index)) + ("" if fill is None else f" fill {fill!r}")

    def view(self, index: int) -> Orbit:
        """The values at this index; distance 1 if the distance follows from a filled share."""
        tilt, distance, elevation, azimuth = self._places(index)
        grid = self.viewpoints
        return Orbit(
            axis_value(grid.azimuth, azimuth),
            axis_value(grid.elevation, elevation),
            1.0 if isinstance(grid.distance, Fill) else axis_value(grid.distance, distance),
            axis_value(grid.tilt, tilt),
        )

    def fill(self, index: int) -> float | None:
        """The filled share at this index."""
        distance = self.viewpoints.distance
        return axis_value(distance.fill, self._places(index)[1]) if isinstance(distance, Fill) else None

    def _places(self, index: int) -> tuple[int, int, int, int]:
        """The numbers of the tilt, distance, elevation and azimuth."""
        _, distances, elevations, azimuths = self._axis_lengths
        index, azimuth = divmod(index, azimuths)
        index, elevation = divmod(index, elevations)
        return *divmod(index, distances), elevation, azimuth

    @cached_property
    def _axis_lengths(self) -> tuple[int, ...]:
        return tuple(self.viewpoints.axis_counts.values())


@dataclass(frozen=True)
class _JitteredPoses(Poses):
    """Random offsets on a grid; the draws for one pose of the grid follow one another."""

    viewpoints: Jitter

    @property
    def counts(self) -> dict[str, int]:
        """The counts of the grid, and the draws for each of its poses."""
        return {**self.viewpoints.axis_counts, "draws": self.viewpoints.count}

    def name(self, index: int) -> str:
        """The values of the grid's pose, and the number of the draw."""
        place, draw = divmod(index, self.viewpoints.count)
        return f"{self._grid.name(place)} draw {draw}"

    def view(self, index: int) -> Orbit:
        """The grid's pose, moved."""
        around, by = self._grid.view(index // self.viewpoints.count), self.viewpoints.plus_minus
        azimuth, elevation, distance, tilt = generator(self.seed, "jitter", self.name(index)).random(4)
        low, high = max(around.elevation - by.elevation, -90.0), min(around.elevation + by.elevation, 90.0)
        return Orbit(
            around.azimuth + (2 * azimuth - 1) * by.azimuth,
            low + elevation * (high - low),
            around.distance + (2 * distance - 1) * by.distance,
            around.tilt + (2 * tilt - 1) * by.tilt,
        )

    def fill(self, index: int) -> float | None:
        """The filled share of the grid's pose."""
        return self._grid.fill(index // self.viewpoints.count)

    @cached_property
    def _grid(self) -> _GridPoses:
        return _GridPoses(self.viewpoints, self.seed)


@dataclass(frozen=True)
class SpherePoses(Poses):
    """Uniform by area on the sphere, or on the part of it between two azimuths and two elevations."""

    viewpoints: Sphere

    @property
    def counts(self) -> dict[str, int]:
        """The number of draws."""
        return {"draws": self.viewpoints.count}

    def name(self, index: int) -> str:
        """The number of the draw."""
        return f"draw {index}"

    def view(self, index: int) -> Orbit:
        """Azimuth, the sine of the elevation, distance and tilt, each uniform; distance 1 if the distance follows from a filled
        share.
        """
        part = self.viewpoints
        u = self._shares(index)
        low, high = (math.sin(math.radians(e)) for e in part.elevation)
        sine = min(max(low + u[1] * (high - low), -1.0), 1.0)
        elevation = min(max(math.degrees(math.asin(sine)), part.elevation[0]), part.elevation[1])
        metres = (1.0, 1.0) if isinstance(part.distance, FillBetween) else part.distance
        azimuth, distance, tilt = (
            lo + x * (hi - lo) for x, (lo, hi) in ((u[0], part.azimuth), (u[2], metres), (u[3], part.tilt))
        )
        return Orbit(azimuth, elevation, distance, tilt)

    def fill(self, index: int) -> float | None:
        """A uniform share."""
        distance = self.viewpoints.distance
        return _between(distance.fill, self._shares(index)[2]) if isinstance(distance, FillBetween) else None

    def _shares(self, index: int) -> Float:
        return generator(self.seed, "sphere", self.name(index)).random(4)


@dataclass(frozen=True)
class _NormalPoses(Poses):
    """Normal around one pose."""

    viewpoints: Normal

    @property
    def counts(self) -> dict[str, int]:
        """The number of draws."""
        return {"draws": self.viewpoints.count}

    def name(self, index: int) -> str:
        """The number of the draw."""
        return f"draw {index}"

    def view(self, index: int) -> Orbit:
        """A draw; those beyond a pole, or at no distance, are drawn again."""
        mean, sd = self.viewpoints, self.viewpoints.sd
        metres = 1.0 if isinstance(mean.distance, FillBetween) else mean.distance
        rng = generator(self.seed, "normal", self.name(index))
        while True:
            view = Orbit(
                rng.normal(mean.azimuth, sd.azimuth),
                rng.normal(mean.elevation, sd.elevation),
                rng.normal(metres, sd.distance),
                rng.normal(mean.tilt, sd.tilt),
            )
            if abs(view.elevation) <= 90 and view.distance > 0:
                return view

    def fill(self, index: int) -> float | None:
        """A uniform share."""
        distance = self.viewpoints.distance
        if not isinstance(distance, FillBetween):
            return None
        return _between(distance.fill, float(generator(self.seed, "fill", self.name(index)).random()))


def _between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] + share * (ends[1] - ends[0]))


@dataclass(frozen=True)
class ListedPoses(Poses):
    """Poses of a file. A motion's target is the point on the optical axis that is nearest to the models, 1 m ahead of the
    camera if that point is behind it.
    """

    viewpoints: PoseList
    file: PoseFile

    def drawn_for(self, name: str) -> Poses:
        """The same poses: nothing is random."""
        return self

    @property
    def counts(self) -> dict[str, int]:
        """The number of poses."""
        return {"poses": len(self.file.entries)}

    @property
    def digest(self) -> str:
        """SHA-256 of the poses, the lens, and the whole content of a file of shots."""
        shots = "".join(shot.said.model_dump_json() for shot in self.file.shots)
        return hashlib.sha256((repr(self.file) + shots).encode()).hexdigest()

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The file's lens, if it names one, the first of several."""
        return self.file.lenses[0] if self.file.lenses else self.file.intrinsics

    def lens(self, index: int) -> Intrinsics | None:
        """The pose's own lens, where the file names several."""
        return self.file.lenses[index] if self.file.lenses else None

    @property
    def lowest_elevation(self) -> float:
        """The lowest elevation of orbits; for motions, elevation does not show whether they are below the ground."""
        return min((view.elevation for view, target in self._views if target is None), default=90.0)

    def name(self, index: int) -> str:
        """The pose's values, and the number of earlier equal poses, because a resting camera has several; for a shot, its own
        name.
        """
        return self._names[index]

    def view(self, index: int) -> Orbit:
        """The orbit in the file, or the one computed from a motion."""
        return self._views[index][0]

    def target(self, index: int) -> Vector | None:
        """The recipe's target for orbits; for a motion, a point on the optical axis."""
        return self._views[index][1] or super().target(index)

    @cached_property
    def _views(self) -> tuple[tuple[Orbit, Vector | None], ...]:
        turn = world_turn(self.viewpoints, self.file)
        return tuple(
            self._view_of(turn, entry) if isinstance(entry, Extrinsics) else (entry, None) for entry in self.file.entries
        )

    @cached_property
    def _names(self) -> tuple[str, ...]:
        if self.file.shots:
            return tuple(_shot_name(shot) for shot in self.file.shots)
        seen: Counter[str] = Counter()
        names: list[str] = []
        for view, target in self._views:
            name = "pose " + " ".join(repr(v + 0.0) for v in (*view, *(target or ())))
            names.append(f"{name} again {seen[name]}" if seen[name] else name)
            seen[name] += 1
        return tuple(names)

    def _view_of(self, turn: Float, motion: Extrinsics) -> tuple[Orbit, Vector]:
        view = viewpoint_of(placed(motion, turn, self.viewpoints), (0.0, 0.0, 0.0), 0)
        assert view.target is not None
        return Orbit(view.azimuth_deg, view.elevation_deg, view.distance, view.tilt_deg), view.target


def _shot_name(shot: Arranged) -> str:
    """The shot's name and a digest of its fields: a changed shot is another shot."""
    return f"shot {shot.name} {hashlib.sha256(shot.said.model_dump_json().encode()).hexdigest()[:16]}"


def world_turn(viewpoints: PoseList, file: PoseFile) -> Float:
    """The rotation from a file's world to the recipe's, (3, 3)."""
    up = viewpoints.up or file.up
    from viewsphere.assets.normalise import rotation as axes_rotation  # which loads meshes

    return axes_rotation(up, viewpoints.forward or ("-z" if up[1] == "y" else "-y"), "viewpoints")


def placed(motion: Extrinsics, turn: Float, viewpoints: PoseList) -> Float:
    """The pose of a file's camera in the recipe's world, (4, 4), metres, OpenCV axes."""
    rotation = transform(turn, motion.R)  # rows: the camera's axes
    return rigid(rotation.T, viewpoints.scale * transform(turn, np.subtract(motion.center, viewpoints.origin)))


def poses(viewpoints: Viewpoints, seed: int, folder: Path = Path()) -> Poses:
    """The poses of a recipe's viewpoints; `seed` and `folder`, the base of relative paths, are the recipe's.

    Raises RecipeError for a file of poses that cannot be read.
    """
    match viewpoints:
        case PoseList():
            path = folder / written_path(viewpoints.path)
            return ListedPoses(viewpoints, seed, pose_file(path, viewpoints))
        case Jitter():
            return _JitteredPoses(viewpoints, seed)
        case Sphere():
            return SpherePoses(viewpoints, seed)
        case Normal():
            return _NormalPoses(viewpoints, seed)
        case Grid():
            return _GridPoses(viewpoints, seed)
        case _:
            raise RecipeError(
                "viewpoints.kind: expected grid, sphere, normal, jitter or file without time; found "
                f"{cast(Any, viewpoints).kind}, which needs time: set time: {{frames: 50, fps: 25}}"
            )


def pose_file(path: Path, viewpoints: PoseList, zooms: bool = False) -> PoseFile:
    """Read a file of poses, or the camera of a 3D file; with `zooms` the camera's lens may change.
    Raises RecipeError for unreadable files.
    """
    from viewsphere.composing.viewpoints.pose_files import cameras

    is_scene = viewpoints.format == "cameras" or (viewpoints.format == "auto" and path.suffix.lower() in cameras.SUFFIXES)
    if not is_scene:
        for name in viewpoints.of_cameras:
            raise RecipeError(f"viewpoints.{name}: expected a 3D file ({', '.join(cameras.SUFFIXES)}); found {path}")
        return read_poses(path, viewpoints.format, viewpoints.every)
    return cameras.read_cameras(path, viewpoints, zooms).thinned(viewpoints.every)
