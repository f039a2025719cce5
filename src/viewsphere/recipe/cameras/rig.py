"""The rig of a recipe: sensors mounted to one another, which are listed, generated, or read from calibrations."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationError, field_validator, model_validator

from viewsphere.errors import RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Length, Metres, Number, Positive
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.recipe.cameras.lens import DistortionField
from viewsphere.recipe.cameras.lidar import LidarEntry
from viewsphere.recipe.cameras.projection import WithProjection
from viewsphere.recipe.values import OrShort, pair
from viewsphere.recipe.world.scene import CameraEntry, CameraMatrix, PictureSize, Row
from viewsphere.validation.errors import error_at, explained, shown

MOST_SENSORS = 64
"""Limit of sensors in a rig, which protects from files made by mistake."""
AXES = "OpenCV axes of the first sensor: x right, y down, z forward"
OWN_LENSES = ("fov_deg", "focal_px", "K", "projection")
LENS_FIELDS = ("size", *(name for name in CameraEntry.LENS if name != "of_viewpoints"), "projection")

SensorName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
Place = tuple[Metres, Metres, Metres]


Rotation = Annotated[
    Annotated[tuple[Number, Number, Number], Tag("angles")] | Annotated[tuple[Row, Row, Row], Tag("matrix")],
    Discriminator(lambda value: "matrix" if _is_of_lists(value) else "angles"),
]


def _is_of_lists(value: object) -> bool:
    return isinstance(value, (list, tuple)) and any(isinstance(row, (list, tuple)) for row in cast("Sequence[object]", value))


class SensorEntry(WithProjection):
    """A sensor's mounting, and its own lens and channels."""

    LENS = ("fov_deg", "fov_axis", "focal_px", "K", "distortion", "lidar")

    position: Place = Field(default=(0.0, 0.0, 0.0), description=f"[x, y, z] in metres; {AXES}")
    rotation: Rotation | None = Field(
        default=None,
        description="[x, y, z] in degrees: y turns it to the right, then x up, then z clockwise seen from behind; or the "
        "3x3 matrix from the sensor's axes to the rig's",
    )
    look: Place | None = Field(default=None, description=f"instead of rotation: the point [x, y, z] to look at, metres, {AXES}")
    size: PictureSize | None = Field(default=None, description="[width, height] in pixels; default: the camera's")
    fov_deg: Annotated[Number, Field(gt=0, lt=180)] | None = Field(default=None, description="as in camera")
    fov_axis: Literal["horizontal", "vertical"] | None = Field(default=None, description="as in camera")
    focal_px: Annotated[tuple[Positive, Positive], BeforeValidator(pair), OrShort({"type": "number"})] | None = Field(
        default=None, description="as in camera"
    )
    K: CameraMatrix | None = Field(default=None, description="as in camera")
    distortion: DistortionField | None = Field(
        default=None, description="as in camera; a sensor with its own lens does not inherit the camera's"
    )
    lidar: LidarEntry | None = Field(default=None, description="instead of a lens: a LiDAR, with its rings, columns and noise")
    channels: Annotated[tuple[str, ...], Field(min_length=1)] | None = Field(
        default=None,
        description="channels of the recipe that this sensor keeps; default: all but lidar, for a LiDAR only lidar",
    )

    @model_validator(mode="after")
    def _one_turn(self) -> SensorEntry:
        if self.rotation is not None and self.look is not None:
            raise ValueError("expected rotation or look; found both")
        if self.look is not None and self.look == self.position:
            raise ValueError(f"expected look away from position; found both at {shown(self.look)}")
        return self

    @model_validator(mode="after")
    def _one_lens(self) -> SensorEntry:
        given = [name for name in OWN_LENSES if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"expected one of {', '.join(OWN_LENSES)}; found {' and '.join(given)}")
        if self.lidar is not None and self.has_lens:
            raise ValueError(f"expected none of {', '.join(LENS_FIELDS)} beside lidar, which says its rays; found one")
        if self.fov_axis and not self.fov_deg:
            raise ValueError("expected fov_axis beside fov_deg; found it alone")
        return self

    @property
    def has_lens(self) -> bool:
        """True if it sets its lens or its size."""
        return any(getattr(self, name, None) is not None for name in LENS_FIELDS)

    def lens(self, camera: CameraEntry) -> CameraEntry:
        """Size and lens of the sensor; missing ones are those of the recipe's camera. Raises ValueError for a sensor's size
        together with a camera whose lens is in pixels.
        """
        mine = {name: value for name in LENS_FIELDS if (value := getattr(self, name, None)) is not None}
        states = any(name in mine for name in OWN_LENSES)
        if not states and camera.is_random:
            raise ValueError(
                "expected fov_deg, focal_px or K beside size or distortion, as the camera's lens is drawn; found none"
            )
        if not states and "size" in mine and (camera.focal_px or camera.K or camera.of_viewpoints):
            raise ValueError(
                "expected fov_deg, focal_px or K beside size, as the camera's lens is in its own pixels; found none"
            )
        if not states and camera.of_viewpoints:
            raise ValueError(
                "expected fov_deg, focal_px or K beside distortion, as the camera's lens is its file's; found none"
            )
        shared = ("size",) if states else (name for name in LENS_FIELDS if name in camera.model_fields_set)
        theirs = {name: value for name in shared if (value := getattr(camera, name)) is not None}
        return CameraEntry.model_validate(theirs | mine)


class SensorList(Frozen):
    """Sensors by name. The first is the rig's origin: if it has another pose, all sensors are moved and turned so that it is
    there.
    """

    kind: Literal["sensors"] = Field(default="sensors", description="a mapping of sensors by name")
    sensors: Annotated[dict[SensorName, SensorEntry], Field(min_length=1, max_length=MOST_SENSORS)] = Field(
        description="each sensor by its name; the viewpoint is the first one's"
    )

    @field_validator("sensors")
    @classmethod
    def _told_apart(cls, value: dict[str, SensorEntry]) -> dict[str, SensorEntry]:
        seen: dict[str, str] = {}
        for name in value:
            if (other := seen.setdefault(name.casefold(), name)) != name:
                raise ValueError(
                    f"sensors {other!r} and {name!r} differ only in capitals, which some file systems ignore: rename one"
                )
        return value

    @property
    def has_lidar(self) -> bool:
        """True if one of them is a LiDAR."""
        return any(entry.lidar is not None for entry in self.sensors.values())


def with_twins(given: Any) -> Any:
    """A recipe's fields with a rig of the camera and of those that it has in `also`: sensors at the same place."""
    if not isinstance(given, Mapping):
        return given
    given = cast("Mapping[str, Any]", given)
    camera = given.get("camera")
    if isinstance(camera, CameraEntry):
        camera = camera.model_dump(mode="json", exclude_unset=True) if camera.also is not None else None
    twins = camera.get("also") if isinstance(camera, Mapping) else None
    if not isinstance(camera, Mapping) or not isinstance(twins, Mapping):
        return given
    if given.get("rig") is not None:
        with error_at("camera", "also"):
            raise ValueError("expected none beside rig, which has all sensors; found some: list them there")
    rest = {field: value for field, value in cast("Mapping[str, Any]", camera).items() if field != "also"}
    straight = _without_distortion(rest)
    entries = {n: {**straight, **v} if _has_no_lens(v) else v for n, v in cast("Mapping[str, Any]", twins).items()}
    for name, values in entries.items():
        with error_at("camera", "also", str(name)):
            _check_twin(name, values)
    return {**given, "camera": rest, "rig": {"kind": "sensors", "sensors": {CAMERA: {}, **entries}}}


def _without_distortion(camera: Mapping[str, Any]) -> dict[str, Any]:
    """Size and K of a bent lens, for its pinhole twin; nothing if the lens is straight or drawn. For a wrong lens, whose own
    error follows, K is None.
    """
    try:
        entry = CameraEntry.model_validate(camera)
        if entry.distortion is None or entry.is_random or entry.of_viewpoints:
            return {}
        return {"size": list(entry.size), "K": entry.intrinsics.K.tolist()}
    except (ValidationError, RecipeError):
        return {"K": None}


def _has_no_lens(values: Any) -> bool:
    """Return whether a twin has no field of a lens, so that it is the pinhole with the camera's K."""
    return isinstance(values, Mapping) and not any(field in values for field in LENS_FIELDS)


def _check_twin(name: str, values: Any) -> None:
    """Raise ValueError for a twin that is no camera with a lens of its own, or that stands elsewhere."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", str(name)):
        raise ValueError(f"expected a name of letters, digits, '_', '.' and '-'; found {shown(name)}")
    if str(name).casefold() == CAMERA:
        raise ValueError(f"expected another name; found {name}, the first camera's")
    if not isinstance(values, Mapping):
        raise ValueError(f"expected a mapping with one of {', '.join(OWN_LENSES)}; found {shown(values)}")
    if not any(lens in values for lens in OWN_LENSES):
        given, lenses = ", ".join(map(str, values)) or "an empty mapping", ", ".join(OWN_LENSES)
        raise ValueError(
            f"expected a lens of its own: one of {lenses}, or {{}} beside a bent lens; found {shown(given)}. Add one"
        )
    for field in ("position", "rotation", "look", "lidar"):
        if field in values:
            raise ValueError(f"expected none of position, rotation, look and lidar; found {field}: list all sensors in rig")
    try:
        SensorEntry.model_validate(values)
    except ValidationError as error:
        raise explained(error, tuple(SensorEntry.model_fields)) from None


class StereoRig(Frozen):
    """Two equal cameras side by side, rectified: `left`, which has the viewpoint, and `right`."""

    kind: Literal["stereo"] = Field(description="two equal cameras, left and right, side by side")
    baseline: Length = Field(description="metres from the left camera to the right one")


class SurroundRig(Frozen):
    """Equal cameras that cover all directions: `camera0` ahead, each next one turned further to the right."""

    kind: Literal["surround"] = Field(description="equal cameras all around: camera0 ahead, camera1 turned to the right, ...")
    count: Annotated[Count, Field(ge=2, le=MOST_SENSORS)] = Field(description="number of cameras")
    radius: Annotated[Metres, Field(ge=0)] = Field(default=0.0, description="metres from the rig's middle to each camera")


class RigFile(Frozen):
    """Sensors of calibration files. Missing values, such as sizes, are those of the recipe's camera."""

    kind: Literal["file"] = Field(default="file", description="from calibrations")
    path: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Field(min_length=1)] = Field(
        description="the file, or files: camera_info has one per camera, OpenCV can have one for lenses and one for R, T"
    )
    format: Literal["auto", "opencv", "kalibr", "camera_info", "basalt", "aria", "colmap", "ocamcalib"] = Field(
        default="auto", description="auto: detected from the file's content"
    )
    rectified: bool = Field(default=False, strict=True, description="rectified pictures instead of raw ones: the pinholes of P")

    @field_validator("path", mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        return (value,) if isinstance(value, str) else value


def _as_written(value: Any) -> Any:
    """`{file: PATH}` as `{kind: file, path: PATH}`; anything else unchanged."""
    if isinstance(value, Mapping) and "file" in value and not {"kind", "path"} & value.keys():
        entry = dict(cast("Mapping[str, Any]", value))
        return {"kind": "file", "path": entry.pop("file"), **entry}
    return value


def _kind(value: Any) -> Any:
    return value.get("kind", "sensors") if isinstance(value, dict) else getattr(value, "kind", None)


RigField = Annotated[
    Annotated[
        Annotated[SensorList, Tag("sensors")]
        | Annotated[StereoRig, Tag("stereo")]
        | Annotated[SurroundRig, Tag("surround")]
        | Annotated[RigFile, Tag("file")],
        Discriminator(_kind),
    ],
    BeforeValidator(_as_written),
]
