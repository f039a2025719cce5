"""The recipe: the user's settings, validated and frozen. It holds ranges and distributions, not draws."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    JsonValue,
    ModelWrapValidatorHandler,
    PrivateAttr,
    Tag,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from viewsphere.errors import RecipeError
from viewsphere.model.channel import DEFAULT_CHANNELS
from viewsphere.model.credit import Credit
from viewsphere.model.fields.file_names import is_reserved
from viewsphere.model.fields.files import Files
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.notebook import Shown
from viewsphere.model.fields.numbers import Count, Natural, Number
from viewsphere.model.sensors.lidar import LIDAR
from viewsphere.recipe.cameras.rig import RigField, SensorList, with_twins
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.cameras.tracks import TracksEntry
from viewsphere.recipe.cameras.viewpoints import Viewpoints
from viewsphere.recipe.formats import FormatEntry, FormatField
from viewsphere.recipe.models import ModelEntry
from viewsphere.recipe.reading.former_names import former_paths, is_former, refuse_both_names, renamed, with_present_names
from viewsphere.recipe.values import Interval, OrShort, shape_of
from viewsphere.recipe.variations import Variations, check_alike, varied
from viewsphere.recipe.world.scene import CameraEntry, EngineEntry, SceneEntry, engine_entry
from viewsphere.recipe.world.scenes import ScenesField
from viewsphere.validation.errors import Marks, error_at, report, shown


def _shares(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] < 0 or value[1] > 1:
        raise ValueError(f"expected shares of 0 to 1; found {shown(value)}")
    return value


class WantedEntry(Frozen):
    """Ranges [low, high] for the labels with these names of a frame's model; in random scenes, for the least visible model, and
    for the most truncated one.
    """

    visibility: Shares | None = Field(default=None, description="visible share: [0.3, 0.6]")
    truncation: Shares | None = Field(default=None, description="share outside the picture: [0.2, 0.5]")

    @model_validator(mode="after")
    def _check(self) -> WantedEntry:
        if self.visibility is None and self.truncation is None:
            raise ValueError("expected visibility or truncation; found neither")
        return self

    def miss(self, visibility: float, truncation: float) -> float:
        """The sum of a frame's distances from both wanted ranges; 0 within them."""
        pairs = ((self.visibility, visibility), (self.truncation, truncation))
        return sum(max(ends[0] - value, value - ends[1], 0.0) for ends, value in pairs if ends is not None)


Shares = Annotated[Interval, AfterValidator(_shares)]


BEFORE_RENDERING = {"name", "formats", "max_frames", "shot_frames", "keep_annotations_above"}
"""Fields of a recipe that change neither pictures nor labels, such as the credits of its models."""


def _set(value: Any) -> Any:
    if value != "set":
        raise ValueError(f"{SHARE}; found {shown(value)}")
    return value


SHARE = "expected a share of 0 to 1, a list of model keys, or set"

Share = Annotated[
    Annotated[Number, Field(ge=0, le=1), Tag("number")]
    | Annotated[tuple[str, ...], Tag("list")]
    | Annotated[Literal["set"], BeforeValidator(_set), Tag("text")],
    Discriminator(
        shape_of,
        custom_error_type="share",
        custom_error_message=SHARE,
    ),
]


class Splits(Frozen):
    """The splits of the frames: `by`, and every split's share, the keys of its models, or `set`: those that their set lists in
    the split of this name.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Share] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    by: Literal["model", "scene", "sequence", "pose", "frame", "place"] = Field(
        default="model", description="unit that stays together in one split"
    )

    @model_validator(mode="before")
    @classmethod
    def _default_shares(cls, data: Any) -> Any:
        if isinstance(data, dict) and not data.keys() - {"by"}:
            return {**data, "train": 0.7, "val": 0.3}
        return data

    @model_validator(mode="after")
    def _check(self) -> Splits:
        for name in self.shares:
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,99}", name):
                raise ValueError(f"expected names of letters, digits, '-' and '_'; found split {name!r}")
            if is_reserved(name):
                raise ValueError(
                    f"split {name!r} is the name of a Windows device, which cannot be a folder: choose another name"
                )
        folded = {name.casefold(): name for name in reversed(self.shares)}
        for name in self.shares:
            if (other := folded[name.casefold()]) != name:
                raise ValueError(
                    f"splits {other!r} and {name!r} differ only in capitals, which some file systems ignore: rename one"
                )
        numbers = self.numbers
        if numbers and abs(sum(numbers.values()) - 1) > 1e-6:
            added = " + ".join(f"{name} {share:g}" for name, share in numbers.items())
            raise ValueError(f"expected shares that add up to 1; found {added} = {sum(numbers.values()):g}")
        if len(numbers) < len(self.shares) and self.by != "model":
            raise ValueError(f"expected by: model, for a split of listed models; found by: {self.by}")
        return self

    @property
    def shares(self) -> dict[str, float | tuple[str, ...] | Literal["set"]]:
        """Split -> its share, the keys of its models, or `set`; in the recipe's order."""
        return dict(self.__pydantic_extra__)

    @property
    def numbers(self) -> dict[str, float]:
        """Split -> its share, without splits of listed models."""
        return {name: share for name, share in self.shares.items() if isinstance(share, (int, float))}

    def listed(self, of_sets: Mapping[str, str]) -> dict[str, str]:
        """The key of each listed model -> its split; `of_sets` are the splits of models in their sets, by their keys."""
        shares = self.shares
        listed = {key: name for key, name in of_sets.items() if shares.get(name) == "set"}
        return listed | {key: name for name, some in shares.items() if isinstance(some, tuple) for key in some}


def _distinct(names: tuple[str, ...]) -> tuple[str, ...]:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"expected distinct names; found {shown(name)} twice")
    return names


def _distinct_formats(entries: tuple[FormatEntry, ...]) -> tuple[FormatEntry, ...]:
    _distinct(tuple(entry.name for entry in entries))
    return entries


class Recipe(Shown, Frozen):
    """The description of a data set to be made: from a file by `Recipe.load`, or from keyword arguments equal to the file's
    fields.

    Errors raise RecipeError. Relative paths are relative to the recipe's file or, for a recipe made in Python, to the working
    folder at that time.
    """

    name: str = Field(default="dataset", min_length=1, max_length=200, description="name of the data set")
    seed: Natural = Field(default=0, description="seed of every random choice")
    models: tuple[ModelEntry, ...] = Field(min_length=1, description="models to place, each entry with one category")
    viewpoints: Viewpoints = Field(description="positions or motion of the camera; kind: grid (default), sphere, ...")
    scenes: ScenesField | None = Field(
        default=None,
        description="number of random scenes to make of the models, or a mapping of count, objects, layout and more; by "
        "default each model appears alone, or with its company",
    )
    time: TimeEntry | None = Field(
        default=None,
        description="sequences instead of still pictures: {frames: 50, fps: 25}, or seconds; every model (or scene) is "
        "one sequence from each static viewpoint",
    )
    camera: CameraEntry = Field(default=CameraEntry(fov_deg=40.0), description="image size and lens")
    rig: RigField | None = Field(
        default=None,
        description="sensors that move together: {kind: stereo, baseline}, {kind: surround, count}, {sensors: {...}} or "
        "{file: calibration}; the viewpoint is the first sensor's. By default one camera",
    )
    tracks: TracksEntry | None = Field(
        default=None,
        description="points to follow through each sequence: {grid: 16}, {count: 1024, on: objects}, or {points: file}",
    )
    scene: SceneEntry = Field(
        default=SceneEntry.of_defaults(), description="light, ground, background, effects and surroundings"
    )
    variations: Variations | None = Field(
        default=None,
        description="conditions, such as weather; every shot is rendered under each, with the same labels. Each name has "
        "the fields of scene that it changes, drawn separately unless paired: true: {morning: {sun: "
        "{elevation: 9}}, overcast: {sky: {daylight: {clouds: 1}}}}",
    )
    min_visibility: Annotated[Number, Field(gt=0, le=1)] | None = Field(
        default=None,
        description="least visibility of the frame's model (in random scenes, of each model). Redraws random viewpoints, "
        "and company with draw: per_frame, up to 32 times until it is met",
    )
    wanted: WantedEntry | None = Field(
        default=None,
        description="range of these labels for the frame's model: {visibility: [0.3, 0.6], truncation: [0.2, 0.5]}. "
        "Redraws the frame's random values until they are in range",
    )
    keep_annotations_above: Annotated[Number, Field(ge=0, lt=1)] | None = Field(
        default=None, description="exports omit annotations of objects with at most this visibility; by default none"
    )
    empty: Annotated[Number, Field(gt=0, lt=1)] | None = Field(
        default=None,
        description="chance of each frame to be empty, without models, as a negative example; drawn by the frame's name, "
        "so that appending frames changes no other",
    )
    engine: Annotated[EngineEntry, BeforeValidator(engine_entry), OrShort({"type": "string"})] = Field(
        default=EngineEntry.of_defaults(),
        description="the renderer: a name, or a mapping of name and the engine's options",
    )
    channels: Annotated[tuple[str, ...], AfterValidator(_distinct)] = Field(
        default=DEFAULT_CHANNELS, min_length=1, validate_default=True, description="channels to keep of every frame"
    )
    annotations: Annotated[tuple[str, ...], AfterValidator(_distinct)] = Field(
        default=(), description="labels of objects and pictures to compute in addition to those of every data set"
    )
    labels: dict[str, dict[str, JsonValue]] = Field(
        default={}, description="options of the recipe's labels, by name: {captions: {count: 5}}"
    )
    files: Files = Field(
        default=Files.of_defaults(), description="how each channel is written: lossless PNG and TIFF by default"
    )
    formats: Annotated[tuple[FormatField, ...], AfterValidator(_distinct_formats)] = Field(
        default=(FormatEntry(name="native"), FormatEntry(name="coco")),
        description="formats to write after rendering, by name or with options: {coco: {category_ids: coco}}",
    )
    splits: Splits = Field(
        default=Splits(),
        description="shares of train, val, ... by model, scene, pose, place or frame; 70/30 train/val by model by default",
    )
    shot_frames: Count | None = Field(default=None, description="most frames rendered and resumed as one unit")
    label_alpha: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.01, description="least alpha at which a blended texel is labelled as surface"
    )
    max_frames: Count = Field(default=1_000_000, description="refuses larger plans, which are usually typos")

    _folder: Path = PrivateAttr()
    _marks: Marks = PrivateAttr()
    _lasting_seed: int | None = PrivateAttr(default=None)

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, data: Any) -> Any:
        plain = _plain(data)
        refuse_both_names(plain)
        return with_twins(with_present_names(plain))

    @model_validator(mode="wrap")
    @classmethod
    def _report(cls, data: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        marks: Marks | None = (info.context or {}).get("marks")
        try:
            recipe = handler(data)
        except ValidationError as error:
            raise RecipeError(report(error, data, marks)) from None
        if not isinstance(data, Recipe):
            written = filter(is_former, marks.places if marks else ())
            recipe._marks = replace(recipe._marks, warnings=renamed(dict.fromkeys((*written, *former_paths(data)))))
        return recipe

    @field_validator("channels")
    @classmethod
    def _as_meant(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        """The channels, with those that other fields require: tracks, points of LiDARs, and pictures with alpha."""
        scene: SceneEntry | None = info.data.get("scene")
        if info.data.get("tracks") is not None:
            value = tuple(dict.fromkeys((*value, "tracks")))
        rig = info.data.get("rig")
        if isinstance(rig, SensorList) and rig.has_lidar:
            value = tuple(dict.fromkeys((*value, LIDAR)))
        if scene is None or not any(entry.transparent for entry in scene.backgrounds):
            return value
        return tuple(dict.fromkeys("rgba" if name == "rgb" else name for name in value))

    @model_validator(mode="after")
    def _as_stored(self) -> Self:
        """The recipe, with the distances that its lens has instead of default ones, and the picture that its kind of file
        holds; a picture that is listed itself stays beside `rgb`.
        """
        instead = dict[str, str]()
        if self.camera.lacks_depth and "channels" not in self.model_fields_set:
            instead["depth"] = "depth_ray"
        if self.files.deep is not None and self.files.deep not in self.channels:
            instead["rgb"] = self.files.deep
        if instead:  # beside `model_fields_set`, so that default channels stay default ones
            object.__setattr__(self, "channels", tuple(instead.get(name, name) for name in self.channels))
        return self

    @field_validator("scene")
    @classmethod
    def _drawn_when(cls, value: SceneEntry, info: ValidationInfo) -> SceneEntry:
        if info.data.get("time") is not None:
            return value.over_time()
        value.check_still()
        return value

    @field_validator("variations")
    @classmethod
    def _fit_scene(cls, value: Variations | None, info: ValidationInfo) -> Variations | None:
        scene, timed = info.data.get("scene"), info.data.get("time") is not None
        if value is None or scene is None:
            return value
        merged: dict[str, SceneEntry] = {}
        for name, change in value.items():
            with error_at(name):
                if not timed:
                    change.check_still()
                merged[name] = varied(scene, change.over_time() if timed else change)
        check_alike(merged)
        return value

    @field_validator("name")
    @classmethod
    def _one_line(cls, value: str) -> str:
        if not value.isprintable() or not value.strip():
            raise ValueError(f"expected one line of printable text; found {shown(value)}")
        return value

    def model_post_init(self, context: Any, /) -> None:
        """Store the folder of relative paths, and the file's lines."""
        self._folder = Path((context or {}).get("folder", Path.cwd())).absolute()
        self._marks = (context or {}).get("marks") or Marks()

    @contextmanager
    def located(self) -> Generator[None]:
        """Put the recipe's file and line before the message of a RecipeError that begins with a field's name."""
        try:
            yield
        except RecipeError as error:
            raise RecipeError("\n".join(map(self._marks.located, str(error).splitlines()))) from None

    def locate(self, message: str) -> str:
        """The message with the recipe's file and line before it, if it begins with a field's name.

        Args:
            message: An error message, such as "scene.sun: ...".

        Returns:
            The message, located if possible.
        """
        return self._marks.located(message)

    @property
    def folder(self) -> Path:
        """Absolute folder that relative paths start from."""
        return self._folder

    @classmethod
    def load(cls, path: str | PathLike[str], changes: Mapping[str, Any] | None = None) -> Self:
        """Read a recipe file and those it extends.

        A recipe at a URL (`s3://bucket/cars/recipe.yaml`) is copied here with its folder.

        Args:
            path: Path or URL of the recipe file.
            changes: Fields to set, by their paths, such as `{"viewpoints.elevation": [10, 20]}`.

        Returns:
            The validated recipe.

        Raises:
            RecipeError: A field is invalid; the message has file, line and field of every error.
            RemoteError: A URL does not answer.
        """
        from viewsphere.recipe.reading.extends import assemble
        from viewsphere.recipe.reading.fetched import fetched

        file = fetched(path)
        data, marks = assemble(file, _plain(changes))
        return cls.model_validate(data, context={"marks": marks, "folder": file.parent})

    @classmethod
    def ensure(cls, recipe: Recipe | str | PathLike[str]) -> Recipe:
        """The recipe itself, or the recipe in a file.

        Args:
            recipe: A recipe, or the path or URL of its file.

        Returns:
            The recipe.

        Raises:
            RecipeError: The file is invalid, as for `load`, or the argument is neither a recipe nor a path.
            RemoteError: A URL does not answer.
        """
        if isinstance(recipe, Recipe):
            return recipe
        if not isinstance(recipe, (str, PathLike)):
            raise RecipeError(f"expected a Recipe, or the path of its file; found {shown(recipe)}: make it with vs.Recipe(...)")
        return cls.load(recipe)

    def redrawn(self, seed: int) -> Self:
        """The recipe with another seed for all random choices, except its models and its splits.

        Args:
            seed: The other seed.

        Returns:
            The new recipe.
        """
        again = self.model_copy(update={"seed": seed})
        again._lasting_seed = self.lasting_seed
        return again

    @property
    def conditions(self) -> Mapping[str, Recipe]:
        """The recipes under each variation, by the variations' names, themselves without variations. A recipe without
        variations returns only itself, with an empty name.
        """
        if self.variations is None:
            return {"": self}
        timed = self.time is not None
        scenes = {name: varied(self.scene, change.over_time() if timed else change) for name, change in self.variations.items()}
        return {name: self.model_copy(update={"scene": scene, "variations": None}) for name, scene in scenes.items()}

    @property
    def varied_scenes(self) -> Mapping[str, SceneEntry]:
        """The scenes under each variation, by the fields that describe them: `variations.night`, or `scene`."""
        return {f"variations.{name}" if name else "scene": recipe.scene for name, recipe in self.conditions.items()}

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings about fields that are written with a former name."""
        return self._marks.warnings

    @property
    def is_new_each_frame(self) -> bool:
        """True if data shared by all frames of one shot is drawn for every frame."""
        return any(recipe.scene.is_new_each_frame for recipe in self.conditions.values())

    @property
    def lasting_seed(self) -> int:
        """The seed of models and splits, as written in the recipe."""
        return self.seed if self._lasting_seed is None else self._lasting_seed

    @property
    def sampler(self) -> str:
        """Name of the sampler that makes shots of the recipe."""
        if self.scenes is not None and self.scenes.sampler != "scenes":
            return self.scenes.sampler
        return "sequences" if self.time else "product" if self.scenes is None else "scenes"

    @property
    def digest(self) -> str:
        """SHA-256 (hexadecimal) of all fields that change a picture or a label; formats, for example, do not count."""
        credit: Any = {"models": {"__all__": set(Credit.model_fields)}}
        value = self.model_dump(mode="json", exclude=dict.fromkeys(BEFORE_RENDERING, True) | credit)
        text = json.dumps(value, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def to_yaml(self) -> str:
        """The recipe as the text of a file, without fields that equal their defaults.

        Returns:
            YAML; paths are kept as they were written.
        """
        from viewsphere.recipe.reading.file import dump

        plain = self.model_dump(mode="json", exclude_defaults=True)
        for name in () if self.time is None else self.scene.flickering:
            plain.setdefault("scene", {}).setdefault(name, {})["draw"] = "per_frame"
        return dump(plain)


def schema(**names: Sequence[str]) -> dict[str, Any]:
    """JSON schema (draft 2020-12) of recipe files, with a description of every field; `names`: all valid names that the fields
    `channels` and `annotations` list, if given.
    """
    whole = Recipe.model_json_schema()
    for field, known in names.items():
        whole["properties"][field]["items"]["enum"] = list(known)
    path = {"type": "string", "minLength": 1}
    extends = {
        "anyOf": [path, {"type": "array", "items": path}],
        "description": "another recipe, or several, whose fields hold where this one says nothing",
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **whole,
        "properties": {"extends": extends, **whole["properties"]},
        "required": [],
        "anyOf": [{"required": ["extends"]}, {"required": whole["required"]}],
        "title": "viewsphere recipe",
    }


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, and paths, as plain data; all other values unchanged."""
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, PathLike):
        return str(value)
    return value.tolist() if type(value).__module__ == "numpy" else value
