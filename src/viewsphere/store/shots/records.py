"""Records of the store as a whole: its plan, the plan's parts, its categories and models."""

from __future__ import annotations

from base64 import b64decode
from binascii import Error as NoBase64
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from itertools import accumulate, chain
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, JsonValue, PlainValidator, TypeAdapter, ValidationError

from viewsphere.labels import channel_labels
from viewsphere.model.annotations.appearance import Appearance
from viewsphere.model.annotations.classes import SemanticClass, classes_of
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import Size, step_key
from viewsphere.model.thing import TimeStep
from viewsphere.store.index import Block, Index, Row, without
from viewsphere.store.paths import names
from viewsphere.store.shots.manifest import sealed, unsealed
from viewsphere.store.texts import parsed
from viewsphere.validation.errors import first_of

STORE_VERSION = 3

MOST_FRAMES = 2**53
"""Largest number of frames of a data set: not all JSON readers store larger numbers exactly."""

PRODUCT = "product"
"""The sampler of models x poses."""

IMPORT = "import"
"""The sampler's name in data sets with imported pictures."""

KEEP = "keep_annotations_above"
"""The field of recipes that determines the annotations that exports leave out."""


_STRICTLY = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Strict validation of records: no unknown keys, no infinities, no NaN."""


def _box(value: Any) -> NDArray[np.float64]:
    corners = np.array(value, np.float64)
    if corners.shape != (8, 3) or not np.isfinite(corners).all():
        raise ValueError(f"expected 8 vertices; found {corners.shape}")
    return corners


Box3d = Annotated[NDArray[np.float64], PlainValidator(_box)]
"""Vertices (8, 3)."""


class OtherStoreError(Exception):
    """A store with the layout of another version."""


@dataclass(frozen=True)
class Category:
    """A category of the data set.

    Attributes:
        id: Number from 1, in order of appearance in the recipe.
        name: Name of the category.
        supercategory: Name of the supercategory.
    """

    __pydantic_config__ = _STRICTLY

    id: int
    name: str
    supercategory: str


@dataclass(frozen=True, eq=False)
class ModelInfo:
    """A normalised model of the data set; paths are relative to its root.

    A model that deforms has a record for each of its `steps`; its own fields describe its file's first frame.

    Attributes:
        key: Key of the model, or of its time step.
        category: Name of the category.
        supercategory: Name of the supercategory.
        category_id: Number of the category, from 1.
        obj: Path of the OBJ file.
        glb: Path of the GLB file.
        box3d_object: (8, 3) float64, vertices of the 3D box in the object's axes, metres.
        size: Width, height and length of the box, metres.
        real_size: Width, height and length of the real object, metres; None if unknown.
        parts: Names of the numbers 1, 2, ... in part maps.
        triangles: Number of triangles.
        digest: SHA-256 of the model.
        warnings: Repairs and omissions of the file's reader.
        step: The time step that the files show; None: not animated.
        track: Key of the animated model, in records of its time steps; else empty.
        steps: Records of the time steps, ascending.
        credit: Author, licence and source; None if unknown.
        materials: Names of the numbers 1, 2, ... in material maps.
        diameter: Largest distance between two vertices, metres; None in records of older versions.
        symmetries: Symmetries from the model file or measured; None if unknown.
        keypoints: Keypoints from the model file or measured; None if unknown.
        body_parts: Names of the numbers 1, 2, ... in body part maps.
        looks: The appearance; None if no label needs it.
        faces: `as_file`: single-sided materials are visible from the front only; None: all from both sides.
        optional: Further data, which a reader may ignore.
    """

    __pydantic_config__ = _STRICTLY

    key: str
    category: str
    supercategory: str
    category_id: int
    obj: str
    glb: str
    box3d_object: Box3d
    size: Size
    real_size: Size | None
    parts: tuple[str, ...]
    triangles: int
    digest: str
    warnings: tuple[str, ...] = ()
    step: TimeStep | None = None  # that the files show
    track: str = ""
    steps: tuple[ModelInfo, ...] = ()
    credit: Credit | None = None
    materials: tuple[str, ...] = ()
    diameter: float | None = None
    symmetries: Symmetries | None = None
    keypoints: Keypoints | None = None
    body_parts: tuple[str, ...] = ()
    looks: Appearance | None = None
    faces: Literal["as_file"] | None = None  # see `ModelSpec.faces`
    optional: dict[str, JsonValue] = field(default_factory=dict[str, JsonValue])  # as of a shot

    @property
    def node(self) -> str | None:
        """The name of the GLB's node for the time step; None for the whole GLB."""
        return None if self.step is None else PurePosixPath(self.obj).stem

    def at_frame(self, frame: int | None) -> ModelInfo:
        """Return the metadata at a time step.

        Args:
            frame: Frame of the model's file; None: at rest.

        Returns:
            The record of the time step.

        Raises:
            ValueError: The model has no such time step.
        """
        step_info = (
            self if frame is None else next((step for step in self.steps if step.step and step.step.frame == frame), None)
        )
        if step_info is None:
            raise ValueError(f"model {self.key}: expected time step {frame}, found none")
        return step_info

    def moved(self, key: str, prefix: str, **changed: Any) -> ModelInfo:
        """The model with another key, its files in the folder `prefix`; `changed` replaces further fields."""
        obj, glb = (f"{prefix}/{PurePosixPath(file).name}" for file in (self.obj, self.glb))
        keys = (step_key(key, step.step and step.step.frame) for step in self.steps)
        steps = (replace(step.moved(own, prefix, **changed), track=key) for step, own in zip(self.steps, keys, strict=True))
        return replace(self, key=key, obj=obj, glb=glb, steps=tuple(steps), **changed)

    def to_plain(self) -> dict[str, Any]:
        """The record as plain JSON data."""
        value: dict[str, Any] = {**self.__dict__, "box3d_object": self.box3d_object.tolist()}
        if self.step is None:
            del value["step"], value["steps"], value["track"]
        else:
            value |= {"step": self.step.model_dump(mode="json"), "steps": [step.to_plain() for step in self.steps]}
        if self.credit is not None:
            value["credit"] = self.credit.model_dump(exclude_none=True)
        if not self.materials:  # of models that were exported elsewhere, or before they had names here
            del value["materials"]
        if not self.body_parts:
            del value["body_parts"]
        if not self.optional:
            del value["optional"]
        for name in ("symmetries", "keypoints", "looks"):
            value[name] = value[name] and value[name].model_dump(mode="json")
        for name in ("credit", "diameter", "symmetries", "keypoints", "looks", "faces"):
            if value[name] is None:
                del value[name]
        return value

    @staticmethod
    def from_plain(value: Mapping[str, Any]) -> ModelInfo:
        """The record from the result of `to_plain`; raises LookupError, TypeError or ValueError for other data."""
        info = typed(_model_adapter(), value)
        for part in (info, *info.steps):
            names([part.key, *([part.track] if part.track else [])], "the key")
        return info


@dataclass(frozen=True)
class Part:
    """The samples [first, first + frames) that one recipe, or one source of a merge, has added to the data set.

    `blocks` list the content of its samples, in order: the subjects of its sampler (models, or scenes) and the numbers of their
    poses. `supplies`: (number of an earlier part, channels) that this one added to all frames of that part; they are in
    separate shots. `shot_frames`: most positions of a shot. `settings`: digests of the settings that appended frames must
    share. `new_poses`: number of poses that no earlier part had; `pose_names`: their digests (see `planning.extension`), None
    if they follow from the recipe. `dealt_splits`: for splits by model or by scene, the splits of models or scenes that no
    earlier part had. `merged`: the part came from another data set, where its shots and models may have had other names and
    numbers.
    """

    digest: str
    version: str
    name: str
    recipe: dict[str, Any]
    channels: tuple[str, ...]
    first: int
    frames: int
    max_objects: int
    blocks: tuple[Block, ...] = ()
    sampler: str = PRODUCT
    supplies: tuple[tuple[int, tuple[str, ...]], ...] = ()
    shot_frames: int = 1
    settings: dict[str, str] = field(default_factory=dict[str, str])
    new_poses: int = 0
    pose_names: str | None = None
    dealt_splits: dict[str, str] = field(default_factory=dict[str, str])
    merged: bool = False
    optional: dict[str, JsonValue] = field(default_factory=dict[str, JsonValue])  # as of a shot
    __pydantic_config__ = _STRICTLY

    @property
    def subjects(self) -> tuple[str, ...]:
        """The subjects of its samples, each once: keys of models, or names of scenes."""
        return tuple(dict.fromkeys(name for block in self.blocks for name in block.subjects))

    def world(self, subject: str) -> str:
        """One of its subjects without its variation: the key of a model, or the name of a scene."""
        return without(subject)[0] if self.recipe.get("variations") else subject

    @property
    def is_product(self) -> bool:
        """Return whether the part's samples show known models at known poses."""
        return self.sampler == PRODUCT and bool(self.blocks)

    @property
    def is_rendered(self) -> bool:
        """Return whether the part's recipe rendered its shots into this data set, frames of its own or channels of others."""
        return self.sampler != IMPORT and not self.merged

    @property
    def is_sampled(self) -> bool:
        """Return whether a recipe made the part: its subjects, models or scenes, have known poses."""
        return self.sampler != IMPORT and bool(self.blocks)

    def checked(self) -> Part:
        """The part itself; raises ValueError for invalid numbers and names."""
        for block in self.blocks:
            names(block.subjects, "the name")
        if any(b.each < 1 or any(not 0 <= a < z for a, z in b.positions) for b in self.blocks):
            raise ValueError("blocks of other than ascending ranges of poses")
        if min(self.first, self.frames, self.max_objects, self.new_poses) < 0:
            raise ValueError("numbers below 0")
        if not 0 < sum(b.samples for b in self.blocks) + self.first + self.frames + 1 <= MOST_FRAMES:
            raise ValueError(f"more than {MOST_FRAMES:,} frames")
        if self.shot_frames < 1:
            raise ValueError("shots without frames")
        try:
            named = len(b64decode(self.pose_names or "", validate=True))
        except NoBase64 as error:
            raise ValueError(f"names of poses that are no base64: {error}") from None
        if self.pose_names is not None and named != NAME_BYTES * self.new_poses:
            raise ValueError(f"{named:,} bytes of names of {self.new_poses:,} poses")
        return self


NAME_BYTES = 8
"""Length of a pose's digest in `Part.pose_names`; zeros mark a pose that no recipe can express."""


@dataclass(frozen=True)
class PlanRecord:
    """The content of `plan.json`: the facts of the plan that readers of the data set need.

    `parts` were rendered or imported one after another; a data set rendered once has one. Version, digest, name and recipe are
    the last part's; all other fields hold for all parts together.
    """

    version: str
    digest: str
    name: str
    recipe: dict[str, Any]
    categories: tuple[Category, ...]
    splits: tuple[str, ...]
    channels: tuple[str, ...]
    models: tuple[str, ...]
    poses: int
    frames: int
    max_objects: int
    parts: tuple[Part, ...] = ()
    __pydantic_config__ = _STRICTLY

    @property
    def classes(self) -> tuple[SemanticClass, ...]:
        """The classes behind the numbers of semantic and panoptic maps: names, colours, things and stuff."""
        return classes_of((category.id, category.name) for category in self.categories)

    @property
    def keep_annotations_above(self) -> float | None:
        """The visibility above which exports keep annotations; None: they keep all."""
        return self.recipe.get(KEEP)

    def keeping_above(self, least: float | None) -> PlanRecord:
        """The plan with exports that keep annotations above this visibility; None: they keep all."""
        parts = tuple(replace(p, recipe=_keeping(p.recipe, least)) if p.is_sampled else p for p in self.parts)
        return replace(self, recipe=_keeping(self.recipe, least), parts=parts)

    def part_of(self, frame: int) -> int:
        """Number of the part that a frame belongs to."""
        return max(bisect_right(self._firsts, frame) - 1, 0)

    def most_objects(self, frame: int) -> int:
        """Most objects in one frame of the part that a frame belongs to."""
        return self.parts[self.part_of(frame)].max_objects if self.parts else self.max_objects

    def annotation_id(self, frame: int, object_id: int) -> int:
        """Number of an object's annotation, unique and counted from 1: later parts do not change it."""
        number, first = self.part_of(frame), 0
        if self.parts:
            first = self.parts[number].first
        return self._annotations[number] + (frame - first) * self.most_objects(frame) + object_id

    def folder_of(self, frame: int, size: int) -> int | None:
        """Number of a frame's sub-folder, where no folder may hold more than `size` objects; None if the frame needs no
        sub-folder.

        Later parts do not change it: files once laid without sub-folders stay so.
        """
        spans = [(p.first, p.frames, p.max_objects) for p in self.parts] or [(0, self.frames, self.max_objects)]
        number, begun, fit = 0, 0, 1  # begun: where the part begins, in frames of which `fit` go into a folder
        for first, frames, most in spans[: self.part_of(frame) + 1]:
            begun, fit = -(-begun * max(1, size // most) // fit), max(1, size // most)
            number = (begun + frame - first) // fit
            begun += frames
        small = spans[0][1] <= max(1, size // spans[0][2])
        return None if small and not number else number

    def part_with(self, digest: str) -> int | None:
        """Number of the last part from a recipe with this digest, None if there is none."""
        return next((i for i in reversed(range(len(self.parts))) if self.parts[i].digest == digest), None)

    def channels_of(self, part: int) -> tuple[str, ...]:
        """Channels of a part's frames, with the ones added by later parts."""
        added = (channels for later in self.parts for number, channels in later.supplies if number == part)
        return tuple(dict.fromkeys(chain(self.parts[part].channels, *added)))

    @cached_property
    def indices(self) -> tuple[Index, ...]:
        """The index of each part's own shots, without shots that add channels to an earlier part's frames."""
        return tuple(Index(p.blocks, p.first, p.shot_frames, number) for number, p in enumerate(self.parts))

    @cached_property
    def supplements(self) -> tuple[tuple[Index, tuple[str, ...]], ...]:
        """Indices of the shots that add channels to an earlier part's frames, each with these channels.

        Only keys of such shots contain a plus.
        """
        return tuple(
            (Index(self.parts[number].blocks, self.parts[number].first, part.shot_frames, later, f"+{later}"), channels)
            for later, part in enumerate(self.parts)
            for number, channels in part.supplies
        )

    @property
    def all_indices(self) -> tuple[Index, ...]:
        """The indices of all shots: of parts' own ones, then of those that add channels."""
        return (*self.indices, *(index for index, _ in self.supplements))

    @property
    def rows(self) -> Iterator[Row]:
        """Rows of all shots in the order of their samples, without shots that add channels later."""
        return chain.from_iterable(self.indices)

    def indices_of(self, part: int) -> tuple[Index, ...]:
        """The indices of all shots that a part renders: of its own ones, then of those that add channels to older frames."""
        return self.indices[part], *(index for index, _ in self.supplements if index.part == part)

    def rows_of(self, part: int) -> Iterator[Row]:
        """Rows of all shots that a part renders, in the order of these indices."""
        return chain.from_iterable(self.indices_of(part))

    def find(self, key: str) -> Row | None:
        """The row of this key, None if there is none."""
        return next((row for row in (index.find(key) for index in self.all_indices) if row is not None), None)

    def row_at(self, sample: int) -> Row:
        """The row that holds a sample; raises IndexError for a sample beyond all rows."""
        return self.indices[self.part_of(sample)].row_at(sample)

    @cached_property
    def _firsts(self) -> list[int]:
        return [part.first for part in self.parts]

    @cached_property
    def _annotations(self) -> list[int]:
        """For each part the number of annotation ids taken by the parts before it."""
        counts = (part.frames * part.max_objects for part in self.parts)
        return list(accumulate(counts, initial=0))

    def to_json(self) -> str:
        """The text of plan.json, which carries its own digest."""
        value = {f.name: getattr(self, f.name) for f in fields(self)}
        value |= {
            "store": STORE_VERSION,
            "categories": [c.__dict__ for c in self.categories],
            "parts": [vars(part) | {"blocks": [vars(block) for block in part.blocks]} for part in self.parts],
        }
        if any(channel_labels()[name].holds_classes for name in self.channels if name in channel_labels()):
            value["classes"] = [vars(row) for row in self.classes]
        return sealed(value)

    @staticmethod
    def from_json(text: str) -> PlanRecord:
        """The record in plan.json's text. Raises OtherStoreError for a store of another version; KeyError, TypeError or
        ValueError for any other text.
        """
        version = parsed(text)["store"]
        if version != STORE_VERSION:
            raise OtherStoreError(
                f"another viewsphere made this data set (store version {version}; this one reads {STORE_VERSION}). Render its "
                "recipe into another folder, or delete this one"
            )
        value = unsealed(text)
        del value["store"]
        value.pop("classes", None)  # for other readers: they follow from the categories
        record = typed(_plan_adapter(), value)
        for number, part in enumerate(map(Part.checked, record.parts)):
            if any(not 0 <= other < number for other, _ in part.supplies):
                raise ValueError("channels that were added to a part that was not there")
        names((*record.splits, *record.models), "the name")
        if min(record.frames, record.poses, record.max_objects) < 0:
            raise ValueError("numbers below 0")
        return record


def _keeping(recipe: dict[str, Any], least: float | None) -> dict[str, Any]:
    return recipe if recipe.get(KEEP) == least else recipe | {KEEP: least}


Record = TypeVar("Record")


@cache  # making both takes 10 ms, and planning needs none
def _model_adapter() -> TypeAdapter[ModelInfo]:
    return TypeAdapter(ModelInfo)


@cache
def _plan_adapter() -> TypeAdapter[PlanRecord]:
    return TypeAdapter(PlanRecord)


def typed(kind: TypeAdapter[Record], value: Any) -> Record:
    """The record with these fields, as read from JSON; raises ValueError, in one line, for fields of other types."""
    try:
        return kind.validate_python(value)
    except ValidationError as error:
        place = ".".join(map(str, error.errors()[0]["loc"]))
        raise ValueError(f"{place}: {first_of(error)}") from None
