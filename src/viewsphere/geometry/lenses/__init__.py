"""Lens models, one file each: a lens gives a ray for each pixel and a pixel for each point.

A file holds `LENS = LensSpec(...)`; the file's name is the lens's name in recipes. Nothing outside this package depends on the
lens model: callers use the methods and properties of `Lens`, which `lens_of` returns.
"""

# ruff: noqa: D102, the classes in `viewsphere.model` say what each name of the protocols means

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from viewsphere.errors import PluginError
from viewsphere.plugin_modules import PACKAGES, entry_points, listed
from viewsphere.validation.specs import Takes, check_calls, mistakes

Float = NDArray[np.float64]
Bounds = tuple[float, float, float, float]
Window = tuple[int, int, int, int]
"""Pixels [x0, x1) x [y0, y1) as (x0, y0, x1, y1); may reach outside the image."""

NEAR = 1e-6
"""Distance in front of the camera, in metres, from which geometry is projected; nearer parts are cut off."""

DEFAULT = "pinhole"
"""The lens of intrinsics without `distortion`."""


class LensParameters(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True):
    """The parameters of a lens besides its camera matrix K; each lens model has its own class."""

    model: str = Field(description="the lens model")

    @model_serializer(mode="wrap")
    def _with_model(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {"model": self.model, **handler(self)}  # also where defaults are left out

    @property
    def numbers(self) -> tuple[float, ...]:
        """All parameters in order, for formats that store them as one list of numbers."""
        values = (value for name, value in self if name != "model")
        return tuple(float(number) for value in values for number in np.ravel(value))


class LensOptions(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True):
    """The fields of a recipe's camera beside `projection` and `size`; each lens that a recipe may name so has its own class."""

    projection: str = Field(description="name of the lens")

    @model_serializer(mode="wrap")
    def _with_projection(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {"projection": self.projection, **handler(self)}  # also where defaults are left out

    @property
    def has_depth(self) -> bool:
        """Return whether z-depth is defined."""
        return _spec(self.projection).has_depth

    @property
    def is_open(self) -> bool:
        """Return whether the scale of pictures is not set, so that it follows from the viewpoints' `distance: {fill: ...}`."""
        return False

    def calibration(self, size: tuple[int, int]) -> Calibration:
        """K and the parameters of the lens for a picture of this size (width, height)."""
        calibrate = _spec(self.projection).calibrate
        assert calibrate is not None
        return calibrate(self, size)


class Calibration(NamedTuple):
    """The entries of K, pixels, and the parameters of the lens, without those that follow from the picture's size."""

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: LensParameters


class Rays(NamedTuple):
    """Rays in camera axes: origins and directions (..., 3), metres. NaN directions where a lens has no ray."""

    origins: Float
    directions: Float


def central(directions: Float) -> Rays:
    """The rays that begin at the camera's centre and have these directions."""
    return Rays(np.broadcast_to(np.zeros(3), directions.shape), directions)


class OpenCVLens(NamedTuple):
    """A lens in the form that OpenCV's functions take besides K: `cv2.fisheye` or `cv2.projectPoints`, and `distCoeffs`."""

    is_fisheye: bool
    coefficients: tuple[float, ...]


class ColmapLens(NamedTuple):
    """A lens in COLMAP's terms: a camera model whose parameters are fx, fy, cx, cy, if it `has_matrix`, and then these."""

    model: str
    parameters: tuple[float, ...]
    has_matrix: bool = True


class BlenderLens(NamedTuple):
    """A camera of Blender's that shows the same rays: its `type` and, for PANO, its `panorama_type`; and the values of its
    properties by their names, apart from `lengths`, which are in metres.
    """

    type: str
    panorama: str | None = None
    values: Mapping[str, float] = {}
    lengths: Mapping[str, float] = {}


class LensSpec(BaseModel):
    """A lens model: typed parameters, and functions whose first value is a `viewsphere.geometry.lenses.Lens`."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", arbitrary_types_allowed=True, strict=True, hide_input_in_errors=True, defer_build=True
    )

    KIND: ClassVar[Any] = "lenses"

    parameters: type[LensParameters] = Field(
        description="the class of the parameters in `distortion` of a recipe, a subclass of "
        "`viewsphere.geometry.lenses.LensParameters`"
    )
    options: type[LensOptions] | None = Field(
        default=None,
        description="the class of the fields beside `projection: <its name>` of a recipe's camera, a subclass of "
        "`viewsphere.geometry.lenses.LensOptions`. Default: recipes name the lens as `distortion` alone",
    )
    calibrate: Callable[[Any, tuple[int, int]], Calibration] | None = Field(
        default=None,
        description="`calibrate(options, size)`: K and the parameters that follow from `options` for a picture of size (width, "
        "height); raises ValueError for a size that the lens cannot have",
    )
    rays: Callable[[Any, Float], Rays] = Field(
        description="`rays(lens, xy)`: the rays through positions (N, 2) of the picture, in camera axes, NaN where there is "
        "none. They begin at the camera's centre (use `viewsphere.geometry.lenses.central`), unless `is_parallel`"
    )
    project: Callable[[Any, Float], Float] = Field(
        description="`project(lens, points)`: the positions (N, 2) in the picture of points (N, 3) in camera axes, NaN where "
        "the lens does not show a point. Inverse of `rays`"
    )
    has_unit_rays: bool = Field(
        default=True,
        description="whether directions are unit vectors, which may look anywhere; False: all have z = 1, and only points with "
        "z > 0 are shown",
    )
    is_linear: bool = Field(
        default=False, description="whether pixels are K times points, as a pinhole's: straight lines stay straight"
    )
    is_parallel: bool = Field(
        default=False,
        description="whether all rays are parallel to the axis: K then maps x and y, metres, to pixels, and straight lines "
        "stay straight",
    )
    is_scan: bool = Field(default=False, description="whether pixels are a LiDAR's measurements instead of a picture")
    has_depth: bool = Field(
        default=True, description="whether z-depth is defined, with all that follows from it; False for panoramas"
    )
    period: Callable[[Any], int | None] | None = Field(
        default=None,
        description="`period(lens)`: the pixels after which the picture repeats across, its width, for a picture of a full "
        "turn; None for others. Default: no picture does",
    )
    bounds: Annotated[Callable[..., tuple[Bounds | None, bool]] | None, Takes(6)] = Field(
        default=None,
        description="`bounds(lens, R, t, vertices, is_used, triangles)`: the 2D box of what the lens shows of triangles (n, 3) "
        "of world vertices (v, 3), None without, and whether it shows all. Default: a search that needs `project` alone",
    )
    screen: Callable[[Float], Float] | None = Field(
        default=None,
        description="`screen(directions)`: places (N, 3), in camera axes, of rays' directions (N, 3) on the surface on which "
        "drawings of cameras show the picture. Default: the unit sphere, or the plane z = 1 if rays are not unit vectors",
    )
    focal: Callable[[Any, float, float], float] | None = Field(
        default=None,
        description="`focal(parameters, fov, extent)`: the focal length, pixels, with which `extent` pixels span an angle "
        "(radians) around the axis; raises ValueError for an angle that the lens cannot have. Default: a pinhole's",
    )
    field_of_view: Callable[[Any], tuple[float, float]] | None = Field(
        default=None,
        description="`field_of_view(lens)`: angles of view across and down, degrees; by default between the outermost pixels",
    )
    as_opencv: Callable[[Any], OpenCVLens] | None = Field(
        default=None,
        description="`as_opencv(lens)`: the same lens in OpenCV's terms, for formats that have its models; None: it has none",
    )
    as_colmap: Callable[[Any], ColmapLens | None] | None = Field(
        default=None,
        description="`as_colmap(lens)`: the same lens in COLMAP's terms, or None; None instead of a function: COLMAP has none",
    )
    as_blender: Callable[[Any], BlenderLens | None] | None = Field(
        default=None,
        description="`as_blender(lens)`: the same lens as a camera of Blender's, or None; None instead of a function: it is "
        "sampled from pinhole pictures. All have K's principal point as their shift, unless they are panoramas",
    )
    ray_cells: int | None = Field(
        default=None,
        description="cells a side of each face of the cube in which rays are indexed. Default: cells of two pixels at the axis",
    )

    @model_validator(mode="wrap")
    @classmethod
    def _explain(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            made = handler(data)
        except ValidationError as error:
            raise mistakes(cls, error, data) from None
        check_calls(made)
        if (made.options is None) != (made.calibrate is None):
            raise PluginError("LensSpec: expected options and calibrate together; found one of them")
        return made


@dataclass(frozen=True, eq=False)
class Lens:
    """A lens model with its parameters and camera matrix, for a picture of one size."""

    spec: LensSpec
    intrinsics: Intrinsics
    parameters: Any

    def positions(self, x: Float, y: Float) -> Float:
        """The positions (N, 2) in the picture of x and y (N,) to which K applies, that is after distortion."""
        i = self.intrinsics
        return np.stack([i.fx * x + i.skew * y + i.cx, i.fy * y + i.cy], axis=-1)

    @property
    def name(self) -> str:
        """The name of its model."""
        return self.parameters.model

    @property
    def is_linear(self) -> bool:
        """Return whether pixels are K times points, as for a pinhole."""
        return self.spec.is_linear

    @property
    def is_parallel(self) -> bool:
        """Return whether all rays are parallel to the axis, and begin in the plane z = 0, instead of at the camera's centre."""
        return self.spec.is_parallel

    @property
    def is_straight(self) -> bool:
        """Return whether straight lines stay straight: pixels are a projective map of points, see `Camera.P`."""
        return self.spec.is_linear or self.spec.is_parallel

    @property
    def has_unit_rays(self) -> bool:
        """Return whether ray directions are unit vectors, which may point anywhere, instead of vectors of z = 1."""
        return self.spec.has_unit_rays

    @property
    def is_scan(self) -> bool:
        """Return whether pixels are a LiDAR's measurements instead of a picture."""
        return self.spec.is_scan

    @property
    def has_depth(self) -> bool:
        """Return whether z-depth is defined."""
        return self.spec.has_depth

    def channels(self, names: Iterable[str]) -> tuple[str, ...]:
        """Names of channels, with `depth_ray` instead of `depth` where z-depth is not defined."""
        return tuple("depth_ray" if name == "depth" and not self.has_depth else name for name in names)

    @cached_property
    def period(self) -> int | None:
        """The pixels after which a picture of a full turn repeats across, its width; None for other pictures."""
        return None if self.spec.period is None else self.spec.period(self)

    @property
    def ray_cells(self) -> int | None:
        """Number of cells along a side of each cube face that indexes the rays; None means cells of about two pixels at the
        axis.
        """
        return self.spec.ray_cells

    @cached_property
    def opencv(self) -> OpenCVLens | None:
        """The same lens in OpenCV's terms, which many formats share; None if OpenCV has no such model."""
        return None if self.spec.as_opencv is None else self.spec.as_opencv(self)

    @cached_property
    def colmap(self) -> ColmapLens | None:
        """The same lens in COLMAP's terms; None if COLMAP has no such model."""
        return None if self.spec.as_colmap is None else self.spec.as_colmap(self)

    @cached_property
    def blender(self) -> BlenderLens | None:
        """The same lens as a camera of Blender's; None if Blender has no such camera."""
        return None if self.spec.as_blender is None else self.spec.as_blender(self)

    @property
    def record(self) -> dict[str, Any] | None:
        """The model and its parameters as plain data, None for a pinhole."""
        own = self.intrinsics.distortion
        return None if own is None else own.model_dump(mode="json")

    @property
    def flat_record(self) -> dict[str, Any] | None:
        """The model with its parameters as one list of `coefficients`; None for a pinhole."""
        own = self.intrinsics.distortion
        return None if own is None else {"model": own.model, "coefficients": list(own.numbers)}

    def rays(self, xy: ArrayLike) -> Rays:
        """The rays through positions (..., 2) of the picture. Directions are NaN where the lens has no ray, and have z = 1
        unless the lens `has_unit_rays`.
        """
        at = np.ascontiguousarray(xy, np.float64)
        origins, directions = self.spec.rays(self, at.reshape(-1, 2))
        shape = (*at.shape[:-1], 3)
        return Rays(origins.reshape(shape), directions.reshape(shape))

    def on_screen(self, directions: Float) -> Float:
        """Places (N, 3) of directions (N, 3) on the surface on which drawings of cameras show the picture: a unit sphere, the
        plane z = 1, or the lens's own.
        """
        return directions if self.spec.screen is None else self.spec.screen(directions)

    def directions(self, subdivision: int = 1, window: Window | None = None) -> Float:
        """Directions of the rays through sample centres, (H, W, 3): `subdivision` x `subdivision` samples a pixel.

        `window` (x0, y0, x1, y1) selects other pixels instead of the image, and may reach outside it.
        """
        i = self.intrinsics
        x0, y0, x1, y1 = (subdivision * edge for edge in window or (0, 0, i.width, i.height))
        across, down = (np.arange(x0, x1) + 0.5) / subdivision, (np.arange(y0, y1) + 0.5) / subdivision
        if self.is_linear:
            rays, y = np.empty((y1 - y0, x1 - x0, 3)), (down - i.cy) / i.fy
            rays[..., 0], rays[..., 1] = (across - i.cx - i.skew * y[:, None]) / i.fx, y[:, None]
        else:
            origins, rays = self.rays(_grid(across, down))
            if origins.any() and not self.is_parallel:
                raise PluginError(
                    f"lens {self.name}: its rays do not all begin at the camera's centre. Return `central(directions)`"
                )
        if not self.has_unit_rays:
            rays[..., 2] = 1.0  # also where it has no ray
        return rays

    def origins(self) -> Float:
        """Places, in camera axes, where the rays through the pixels' centres begin, (H, W, 3): 0 unless rays are parallel."""
        i = self.intrinsics
        if not self.is_parallel:
            return np.broadcast_to(np.zeros(3), (i.height, i.width, 3))
        return self.rays(_grid(np.arange(i.width) + 0.5, np.arange(i.height) + 0.5)).origins

    def project(self, points: ArrayLike) -> tuple[Float, NDArray[np.bool_]]:
        """Positions in the picture, (..., 2) float64, of points (..., 3) in camera axes, and whether the lens shows them, (...)
        bool. Positions that it does not show are NaN.
        """
        points = np.asarray(points, np.float64)
        xy = self.spec.project(self, np.ascontiguousarray(points.reshape(-1, 3))).reshape(*points.shape[:-1], 2)
        return xy, ~np.isnan(xy[..., 0])

    def bounds(
        self, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
    ) -> tuple[Bounds | None, bool]:
        """The 2D box (x0, y0, x1, y1) of the parts of triangles (n, 3) that the lens shows, and whether it shows all of them.

        The corners are world vertices (v, 3); `is_used` masks the vertices that triangles use. The box is None if the lens
        shows no part.
        """
        if self.spec.bounds is None:
            from viewsphere.geometry.lenses.shared.outline import bounds

            return bounds(self, R, t, vertices, is_used, triangles)
        return self.spec.bounds(self, R, t, vertices, is_used, triangles)

    def field_of_view(self) -> tuple[float, float]:
        """Angles of view across and down, degrees."""
        if self.spec.field_of_view is not None:
            return self.spec.field_of_view(self)
        i = self.intrinsics
        column, row = (int(np.clip(v, 0, most - 1)) for v, most in ((i.cx, i.width), (i.cy, i.height)))
        strips = (0, row, i.width, row + 1), (column, 0, column + 1, i.height)
        angles = [_angles_off_axis(self.directions(1, strip).reshape(-1, 3)) for strip in strips]
        across, down = (float(np.nanmax(a[: len(a) // 2]) + np.nanmax(a[len(a) // 2 :])) for a in angles)
        return across, down


def _grid(across: NDArray[np.floating], down: NDArray[np.floating]) -> Float:
    """Positions (H, W, 2) of columns (W,) and rows (H,)."""
    xy = np.empty((len(down), len(across), 2))
    xy[..., 0], xy[..., 1] = across, down[:, None]
    return xy


def _angles_off_axis(directions: Float) -> Float:
    """Angles of directions (N, 3) to the optical axis, degrees."""
    return np.degrees(np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2]))


class Intrinsics(Protocol):
    """Image size in pixels, the camera matrix K (3, 3), its entries, and the lens; a `distortion` of None means a pinhole."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def fx(self) -> float: ...
    @property
    def fy(self) -> float: ...
    @property
    def cx(self) -> float: ...
    @property
    def cy(self) -> float: ...
    @property
    def skew(self) -> float: ...
    @property
    def distortion(self) -> LensParameters | None: ...
    @property
    def K(self) -> Float: ...
    @property
    def lens(self) -> Lens: ...


class Camera(Protocol):
    """Intrinsics and the world-to-camera motion x_camera = R x_world + t (OpenCV axes, metres); P, (3, 4), is K [R|t], or for
    parallel rays K [R|t] with (0, 0, 0, 1) as the last row of [R|t].
    """

    @property
    def intrinsics(self) -> Intrinsics: ...
    @property
    def R(self) -> Float: ...
    @property
    def t(self) -> Float: ...
    @property
    def K(self) -> Float: ...
    @property
    def P(self) -> Float: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def lens(self) -> Lens: ...


@lru_cache(maxsize=64)
def lens_of(intrinsics: Intrinsics) -> Lens:
    """The lens of these intrinsics. Raises PluginError if a third-party model is not installed or not valid."""
    own = intrinsics.distortion
    spec = _spec(DEFAULT if own is None else own.model)
    return Lens(spec, intrinsics, LensParameters(model=DEFAULT) if own is None else own)


def focal_from_fov(fov: float, extent: float, parameters: LensParameters | None = None) -> float:
    """The focal length in pixels at which `extent` pixels span the angle `fov` (radians); for a pinhole if no parameters are
    given. Raises ValueError for an angle that the lens cannot have.
    """
    focal = _spec(DEFAULT if parameters is None else parameters.model).focal
    return extent / (2 * math.tan(fov / 2)) if focal is None else focal(parameters, fov, extent)


def lens_parameters(model: str, **values: Any) -> LensParameters:
    """The parameters of a lens model. Raises PluginError for an unknown model, ValidationError for invalid values."""
    return _spec(model).parameters.model_validate({"model": model, **values})


def read_parameters(value: Any) -> Any:
    """The parameters of a lens model, read from a mapping that names it as `model`; any other value is returned unchanged."""
    if not isinstance(value, Mapping) or not isinstance(value.get("model"), str):
        return value
    return _spec(value["model"]).parameters.model_validate(dict(value))


def opencv_parameters(coefficients: tuple[float, ...], is_fisheye: bool = False) -> LensParameters:
    """The parameters of an OpenCV lens: k1 k2 k3 k4 of `cv2.fisheye`, otherwise k1 k2 p1 p2 [k3 [k4 k5 k6]]."""
    return lens_parameters("fisheye" if is_fisheye else "brown_conrady", coefficients=coefficients)


def _spec(name: str) -> LensSpec:
    """The spec of a lens model, without the suggestions that `viewsphere.plugins.load` adds to its errors."""
    entry = next((entry for entry in entry_points(group="viewsphere.lenses") if entry.name == name), None)
    found = importlib.import_module(f"{_package_with(name)}.{name}") if entry is None else entry.load()
    spec = found if isinstance(found, LensSpec) else getattr(found, "LENS", None)
    if not isinstance(spec, LensSpec):
        raise PluginError(f"lens {name}: expected LENS = LensSpec(...) in its module; found none")
    return spec


def _package_with(name: str) -> str:
    """The package with a lens model: a third party's comes first, and one that cannot be imported has none."""
    named = (entry.module for entry in entry_points(PACKAGES) if entry.name == LensSpec.KIND)
    for package in (*named, __name__):
        with suppress(Exception):
            if name in listed(package):
                return package
    raise PluginError(f"lens {name}: expected a lens model of viewsphere or of an installed package; found none")
