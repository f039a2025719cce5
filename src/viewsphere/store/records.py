"""What the store says of itself: the plan it was made for, its parts, categories and models."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from itertools import accumulate, chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.model_spec import Size

STORE_VERSION = 1

ShotRow = tuple[str, int, int]
"""A shot's key, its first frame and its number of frames."""


@dataclass(frozen=True)
class Category:
    """A category of the data set; ids count from 1 in order of appearance in the recipe."""

    id: int
    name: str
    supercategory: str


@dataclass(frozen=True, eq=False)
class ModelInfo:
    """A normalised model of the data set; paths are relative to its root.

    `box3d_object` (8, 3) metres in the object's axes; sizes are (width, height, length) in metres.
    """

    key: str
    category: str
    supercategory: str
    category_id: int
    obj: str
    glb: str
    box3d_object: NDArray[np.float64]
    size: Size
    real_size: Size | None
    parts: tuple[str, ...]
    triangles: int
    digest: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """Models that were taken from the same poses: every model, in order, from every pose of the ranges [first, stop)."""

    models: tuple[str, ...]
    poses: tuple[tuple[int, int], ...]

    @property
    def count(self) -> int:
        """Poses of each model."""
        return sum(stop - first for first, stop in self.poses)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.models) * self.count


@dataclass(frozen=True)
class Part:
    """What one recipe (or one source of a merge) brought: the frames [first, first + frames).

    `rows` say which model and pose each of its frames shows, in frame order; a part whose models or poses are not known has
    none. `supplies`: (number of an earlier part, channels) that this one added to all frames of that part; they lie in shots
    of their own. `shot_frames`: most frames of a shot. `settings`: digests of what frames that are appended have to share.
    """

    digest: str
    version: str
    name: str
    recipe: dict[str, Any]
    channels: tuple[str, ...]
    first: int
    frames: int
    max_objects: int
    rows: tuple[Row, ...] = ()
    supplies: tuple[tuple[int, tuple[str, ...]], ...] = ()
    shot_frames: int = 1
    settings: dict[str, str] = field(default_factory=dict[str, str])

    @property
    def models(self) -> tuple[str, ...]:
        """Keys of the models that it shows, each once."""
        return tuple(dict.fromkeys(key for row in self.rows for key in row.models))

    @property
    def poses(self) -> int:
        """Number of different poses that it shows."""
        return len({pose for row in self.rows for first, stop in row.poses for pose in range(first, stop)})

    def model_at(self, frame: int) -> str | None:
        """Key of the model that one of its frames shows, None where that is not known."""
        start = self.first
        for row in self.rows:
            if frame < start + row.frames:
                return row.models[(frame - start) // row.count]
            start += row.frames
        return None

    def shots(self, most: int) -> Iterator[ShotRow]:
        """Key, first frame and number of frames of shots of `most` frames at most, of one model each.

        The keys are `<model>-<first pose>`; the sizes of a model's shots differ by one at most.
        """
        frame = self.first
        for row in self.rows:
            poses = [pose for first, stop in row.poses for pose in range(first, stop)]
            chunks = -(-len(poses) // most)
            edges = [i * len(poses) // chunks for i in range(chunks + 1)]
            for key in row.models:
                for first, stop in pairwise(edges):
                    yield f"{key}-{poses[first]:06d}", frame, stop - first
                    frame += stop - first

    @staticmethod
    def from_plain(value: dict[str, Any]) -> Part:
        """The part whose fields are these, as JSON gives them back."""
        plain = dict(value)
        plain["channels"] = tuple(value["channels"])
        plain["rows"] = tuple(Row(tuple(r["models"]), tuple((int(a), int(b)) for a, b in r["poses"])) for r in value["rows"])
        plain["supplies"] = tuple((int(part), tuple(channels)) for part, channels in value["supplies"])
        return Part(**plain)


@dataclass(frozen=True)
class PlanRecord:
    """What `plan.json` says: all a reader needs to know of the plan.

    `shots`: (key, first frame, frames). `pose_names`: a digest of each pose, by its index (see `sampling.extension`).
    `parts`: what was rendered or brought in one after another; a recipe that was just rendered has one. Version, digest, name
    and recipe are the last part's, all other fields are of all parts together.
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
    shots: tuple[ShotRow, ...]
    parts: tuple[Part, ...] = ()
    pose_names: str = ""

    def part_of(self, frame: int) -> int:
        """Number of the part that a frame belongs to."""
        return max(bisect_right(self._firsts, frame) - 1, 0)

    def most_objects(self, frame: int) -> int:
        """Most objects in one frame of the part that a frame belongs to."""
        return self.parts[self.part_of(frame)].max_objects if self.parts else self.max_objects

    def annotation_id(self, frame: int, object_id: int) -> int:
        """Number of an object's annotation, unique and from 1: parts that come later change none."""
        number, first = self.part_of(frame), 0
        if self.parts:
            first = self.parts[number].first
        return self._annotations[number] + (frame - first) * self.most_objects(frame) + object_id

    def folder_of(self, frame: int, size: int) -> int | None:
        """Number of the folder for a frame where none may hold more than `size` objects; None: it needs no folder.

        Parts that come later change none: what was laid flat stays so.
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
        """Number of the last part that a recipe of this digest brought, None if there is none."""
        return next((i for i in reversed(range(len(self.parts))) if self.parts[i].digest == digest), None)

    def channels_of(self, part: int) -> tuple[str, ...]:
        """Channels of a part's frames, those that later parts added included."""
        added = (channels for later in self.parts for number, channels in later.supplies if number == part)
        return tuple(dict.fromkeys(chain(self.parts[part].channels, *added)))

    def shots_of(self, part: int) -> Iterator[ShotRow]:
        """A part's own shots."""
        first, stop = self.parts[part].first, self.parts[part].first + self.parts[part].frames
        return (row for row in self.shots if first <= row[1] < stop)

    def supplements_of(self, part: int) -> Iterator[tuple[ShotRow, tuple[str, ...]]]:
        """The shots with channels that a part added to frames of earlier ones, and these channels.

        No other shot's key holds a plus.
        """
        for number, channels in self.parts[part].supplies:
            for key, first, count in self.parts[number].shots(self.parts[part].shot_frames):
                yield (f"{key}+{part}", first, count), channels

    @property
    def supplements(self) -> Iterator[tuple[ShotRow, tuple[str, ...]]]:
        """Those of all parts."""
        return chain.from_iterable(map(self.supplements_of, range(len(self.parts))))

    @cached_property
    def _firsts(self) -> list[int]:
        return [part.first for part in self.parts]

    @cached_property
    def _annotations(self) -> list[int]:
        """Annotation numbers that the parts before each one take."""
        counts = (part.frames * part.max_objects for part in self.parts)
        return list(accumulate(counts, initial=0))

    def to_json(self) -> str:
        """The text of plan.json."""
        value = {f.name: getattr(self, f.name) for f in fields(self)}
        value |= {
            "store": STORE_VERSION,
            "categories": [c.__dict__ for c in self.categories],
            "parts": [asdict(part) for part in self.parts],
        }
        return json.dumps(value, separators=(",", ":"))

    @staticmethod
    def from_json(text: str) -> PlanRecord:
        """Read plan.json's text; raises KeyError, TypeError or ValueError for anything else."""
        value: dict[str, Any] = json.loads(text)
        if value.pop("store") != STORE_VERSION:
            raise ValueError("made by another version of the store")
        value["categories"] = tuple(Category(**c) for c in value["categories"])
        value["shots"] = tuple((str(k), int(a), int(n)) for k, a, n in value["shots"])
        value["parts"] = tuple(Part.from_plain(part) for part in value.get("parts", ()))
        for name in ("splits", "channels", "models"):
            value[name] = tuple(value[name])
        return PlanRecord(**value)
