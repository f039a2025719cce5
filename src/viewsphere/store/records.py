"""What the store says of itself: the plan it was made for, its categories and models."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.shot import Size

STORE_VERSION = 1


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
class PlanRecord:
    """What `plan.json` says: all a reader needs to know of the plan. `shots`: (key, first frame, frames)."""

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
    shots: tuple[tuple[str, int, int], ...]

    def to_json(self) -> str:
        """The text of plan.json."""
        value = {**self.__dict__, "store": STORE_VERSION, "categories": [c.__dict__ for c in self.categories]}
        return json.dumps(value, separators=(",", ":"))

    @staticmethod
    def from_json(text: str) -> PlanRecord:
        """Read plan.json's text; raises KeyError, TypeError or ValueError for anything else."""
        value: dict[str, Any] = json.loads(text)
        if value.pop("store") != STORE_VERSION:
            raise ValueError("made by another version of the store")
        value["categories"] = tuple(Category(**c) for c in value["categories"])
        value["shots"] = tuple((str(k), int(a), int(n)) for k, a, n in value["shots"])
        for name in ("splits", "channels", "models"):
            value[name] = tuple(value[name])
        return PlanRecord(**value)
