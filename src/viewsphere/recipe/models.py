"""The models of a recipe: files or models of sources, with their orientation, size and names."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from viewsphere.model.annotations.appearance import Word
from viewsphere.model.annotations.keypoints import MOST_POINTS
from viewsphere.model.credit import Attribution, Credit, Licence, SourceUrl
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Positive
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.model_spec import Axis, Measure
from viewsphere.plugins import prefix_of
from viewsphere.plugins.source import suggested
from viewsphere.recipe.cameras.time import RATE, STEPS, Frames, Rate, Steps
from viewsphere.recipe.draws import CountDrawn, Drawn, is_random
from viewsphere.recipe.values import OrShort, shape_of
from viewsphere.recipe.world.motion import MOTION, MotionField
from viewsphere.validation.errors import one_of, shown

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

UnitName = Literal["m", "cm", "mm", "in", "ft"]


def _one_or_more(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


def _unit(value: Any) -> Any:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if (number and value > 0) or (isinstance(value, str) and value in UNITS):
        return value
    raise ValueError(f"{one_of(value, tuple(UNITS))}, or the metres in one unit")


Unit = Annotated[
    UnitName | float,
    BeforeValidator(_unit),
]


class Dimensions(Frozen):
    """A model's true size in metres."""

    width: Positive = Field(description="along X, metres")
    height: Positive = Field(description="along Z, metres")
    length: Positive = Field(description="along Y, from front to back, metres")


class SizeTable(Frozen):
    """A CSV file of true sizes: columns name (a file's, without its ending), width, height and length."""

    csv: str = Field(min_length=1, description="path of the file")
    unit: Unit = Field(default="m", description="unit of its numbers: m, cm, mm, in, ft or a number of metres")


class ScaleEntry(OmitNone):
    """A measure of a model's box, and the metres to scale it to."""

    OMIT_IF_NONE = get_args(Measure)

    length: Drawn[Positive] | None = Field(
        default=None, description="metres from front to back, a number, [low, high] or a distribution"
    )
    width: Drawn[Positive] | None = Field(default=None, description="or metres from side to side")
    height: Drawn[Positive] | None = Field(default=None, description="or metres from bottom to top")
    longest: Drawn[Positive] | None = Field(default=None, description="or metres of the longest of these")
    diagonal: Drawn[Positive] | None = Field(default=None, description="or metres of the box's diagonal")

    @model_validator(mode="after")
    def _check(self) -> ScaleEntry:
        given = [name for name in self.OMIT_IF_NONE if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of {', '.join(self.OMIT_IF_NONE)}; found {' and '.join(given) or 'none'}")
        return self

    @property
    def goal(self) -> tuple[Measure, Any]:
        """The measure, and its metres or their distribution."""
        return next((name, value) for name in get_args(Measure) if (value := getattr(self, name)) is not None)


RealSize = Annotated[
    Annotated[Dimensions, Tag("mapping")]
    | Annotated[SizeTable, Tag("table")]
    | Annotated[str, Field(min_length=1), Tag("text")],
    Discriminator(
        lambda v: "table" if (isinstance(v, dict) and "csv" in v) or isinstance(v, SizeTable) else shape_of(v),
        custom_error_type="real_size",
        custom_error_message="expected 'file', the path of a CSV file or a mapping of width, height and length",
    ),
]

Scale = Annotated[
    Annotated[ScaleEntry, Tag("mapping")] | Annotated[Literal["as_is", "real_size"], Tag("text")],
    Discriminator(
        shape_of,
        custom_error_type="scale",
        custom_error_message="expected as_is, real_size or a mapping of length, width, height, longest or diagonal",
    ),
]


class ModelEntry(OmitNone):
    """Some models of one category, treated alike."""

    OMIT_IF_NONE = ("motion", "fps", "sidecar", "symmetries", "keypoints", "color", "material", "labels")

    source: Annotated[
        tuple[Annotated[str, Field(min_length=1)], ...],
        BeforeValidator(_one_or_more),
        OrShort({"type": "string"}),
    ] = Field(
        min_length=1,
        description="a file, a pattern such as cars/*.obj, a folder, zoo:<family>, a set such as gso:FOLDER, or a list of "
        "these. zoo:any draws among all shipped families of things. Paths are relative to the recipe",
    )
    category: str = Field(
        default="",
        max_length=200,
        validate_default=False,
        description="category of the models; needed for files; for the zoo, the default is its family",
    )
    supercategory: str = Field(default="", max_length=200, description="a broader category, such as vehicle")
    count: CountDrawn | None = Field(
        default=None,
        description="zoo: number of models to draw (default 1), a number, [low, high] or a distribution; sets: number of "
        "models to draw among them (default: all); files: required number of files",
    )
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)] | None = Field(
        default=None,
        description="prefix of the models' keys: <name>_<file name>, or <name>_000, <name>_001, ... for the zoo",
    )
    frames: Frames | None = Field(
        default=None,
        description="time steps of zoo:person or an animated file (abc, blend, fbx, glb, gltf, usd): all, a list of "
        "frames, or {first, last, step}. Without it, the file's first frame",
    )
    clip: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="with frames or the motion clip: the animation to play, if the file has several (actions, takes); by "
        "default the first",
    )
    fps: Rate | None = Field(default=None, description=f"with frames or the motion clip: {RATE}")
    poses: Steps = Field(default="each", description=f"with frames: {STEPS}")
    motion: MotionField = Field(default=None, description=MOTION)
    up: Axis | None = Field(default=None, description="the file's axis that points up; by default the format's")
    forward: Axis | None = Field(default=None, description="the file's axis that the model's front faces")
    unit: Unit | None = Field(default=None, description="the file's unit: m, cm, mm, in, ft or the metres in one unit")
    centring: Literal["box", "area", "floor", "as_is"] = Field(
        default="box",
        description="point at the origin: the box's centre, the surface's centroid, the centre of the box's bottom, or "
        "as_is, the file's own origin",
    )
    real_size: RealSize | None = Field(
        default=None,
        description="the true size: {width, height, length} in metres, a CSV file of name, width, height and length (its "
        "path, or {csv, unit}), or file: the file's size. The default for the zoo is file",
    )
    scale: Scale = Field(
        default="as_is",
        description="as_is, real_size, or {length: 1.8}: length of the scaled model in metres; or its width, height, longest "
        "side or diagonal",
    )
    sidecar: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="file with symmetries, keypoints and body_parts of the models; by default the file beside each model,"
        " such as mug.glb.viewsphere.yaml",
    )
    symmetries: Literal["declared", "found"] | None = Field(
        default=None,
        description="found: detects the symmetries of models that declare none; declared (the default): detects none",
    )
    keypoints: Annotated[Count, Field(le=MOST_POINTS)] | None = Field(
        default=None, description="number of far-apart surface points, for models that name no points"
    )
    faces: Literal["both", "as_file"] | None = Field(
        default=None,
        description="as_file: hides the backs of the file's single-sided surfaces from cameras (glTF, COLLADA, USD, "
        "Blender's materials); both (the default): all surfaces are visible from both sides",
    )
    color: Word | None = Field(default=None, description="word for the models' colour in captions, instead of the surface's")
    material: Word | None = Field(default=None, description="word for the models' material in captions: wooden")
    labels: Literal["own", "background"] | None = Field(
        default=None,
        description="own (the default), or background: unlabelled models that scenes.distractors puts among the others",
    )
    confined: bool = Field(
        default=True, strict=True, description="requires paths inside model files to stay in the model's folder"
    )
    licence: Licence = None
    attribution: Attribution = None
    source_url: SourceUrl = None

    @property
    def names(self) -> tuple[str, ...]:
        """The models of sources in this entry, such as `zoo:car`; empty for an entry of files."""
        return tuple(filter(prefix_of, self.source))

    @property
    def is_labelled(self) -> bool:
        """True if its models are labelled objects, not distractors."""
        return self.labels != "background"

    @property
    def credit(self) -> Credit | None:
        """The entry's credit for its models, or None."""
        credit = Credit(licence=self.licence, attribution=self.attribution, source_url=self.source_url)
        return None if credit == Credit() else credit

    @model_validator(mode="before")
    @classmethod
    def _as_fields(cls, value: Any) -> Any:
        if isinstance(value, str):
            name, colon, rest = value.partition(":")
            is_field = colon and name in cls.model_fields
            hint = f"set a space after the colon, {name}: {rest}" if is_field else f"write {{source: {value}}}"
            raise ValueError(f"expected a mapping; found {shown(value)}: {hint}")
        return value

    @model_validator(mode="after")
    def _check(self) -> ModelEntry:
        names = self.names
        if names and len(names) < len(self.source):
            raise ValueError("expected either files or models of a source; found both: give each an entry of its own")
        for name in names:
            if name.endswith(":"):
                raise ValueError(f"expected the name of a model after {name!r}; found none")
        if not names and is_random(self.count):
            raise ValueError("count is a distribution, but for files it must be one number: the required number of files")
        if not names and not self.category:
            raise ValueError(
                f"expected a category, such as car; found none (only models of a source have one of their own)"
                f"{suggested(self.source[0])}"
            )
        if self.up and self.forward and self.up[1] == self.forward[1]:
            raise ValueError(f"expected up and forward along different axes; found {self.up} and {self.forward}")
        if names and self.sidecar is not None:
            raise ValueError("models of a source cannot have a sidecar, because the source has these facts: remove sidecar")
        if self.frames is None and self.poses != "each":
            raise ValueError(f"expected frames, for poses: {self.poses}; found none")
        if not self.is_labelled and self.frames is not None:
            raise ValueError("frames cannot be set with labels: background, because distractors play no frames: remove one")
        if self.scale == "real_size" and self.real_size is None and not names:
            raise ValueError("expected real_size to be set, for scale: real_size; found none")
        return self


def unit_metres(unit: str | float) -> float:
    """Metres in one unit."""
    return UNITS[unit] if isinstance(unit, str) else unit
