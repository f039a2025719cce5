"""The spec of a family of models: how a model is drawn and built, and the facts common to all models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, InstanceOf, field_validator, model_validator

from viewsphere.errors import PluginError
from viewsphere.model.annotations.classes import STUFF_IDS
from viewsphere.model.annotations.keypoints import At
from viewsphere.model.model_spec import Size
from viewsphere.model.place import LevelFace
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec
from viewsphere.validation.errors import one_of

Home = Literal["table", "floor", "street", "garden", "water", "place"]
"""Usual surroundings of a family; `place`: the ground or building of a place, not a thing in it."""

Rng = np.random.Generator


class ZooFamily(Spec):
    """Functions that draw and build models of one kind, in metres, front -Y, up +Z, standing on z = 0, and facts about them."""

    KIND: ClassVar[Kind] = "families"

    random: Callable[[Rng], Any] = Field(
        description="`random(rng)`: a model, as a `viewsphere.assets.mesh.Mesh`; a `RiggedModel` for a family with `clips`"
    )
    home: Home = Field(description="the usual surroundings: `table`, `floor`, `street`, `garden`, `water`, or `place`")
    classes: Mapping[str, str] = Field(
        default={"": "scenery"},
        description="stuff classes by part, for models without labels of their own; `''` (scenery by default): all other parts",
    )
    keypoints: Mapping[str, InstanceOf[At]] = Field(default={}, description="named points, as places in the boxes around parts")
    skeleton: tuple[tuple[str, str], ...] = Field(default=(), description="lines between the points")
    sized: Callable[[Rng, Size], Any] | None = Field(
        default=None, description="`sized(rng, (width, height, length))`: a model of this size"
    )
    draw: Callable[[Rng], Any] | None = Field(default=None, description="`draw(rng)`: the parameters that `random` draws")
    surfaces: Callable[[Any], tuple[LevelFace, ...]] | None = Field(
        default=None, description="`surfaces(parameters)`: level rectangles where things may stand"
    )
    rooms: Callable[[Any], Any] | None = Field(
        default=None, description="`rooms(parameters)`: the air of the rooms, boxes (8, 3) in the model's axes"
    )
    clips: tuple[str, ...] = Field(default=(), description="names of animations")
    made_of: Callable[[], str] | None = Field(
        default=None, description="the state of downloaded files that its models are made of, for digests"
    )

    @field_validator("classes")
    @classmethod
    def _check_classes(cls, classes: Mapping[str, str]) -> Mapping[str, str]:
        for name in classes.values():
            if name not in STUFF_IDS:
                raise ValueError(one_of(name, tuple(STUFF_IDS)))
        if "" not in classes:
            raise ValueError("expected the class of all other parts, as {'': 'furniture'}; found none")
        return classes

    @model_validator(mode="after")
    def _check_skeleton(self) -> ZooFamily:
        for name in (name for line in self.skeleton for name in line):
            if name not in self.keypoints:
                raise PluginError(f"ZooFamily.skeleton: {one_of(name, tuple(self.keypoints))}")
        return self

    @model_validator(mode="after")
    def _check_draw(self) -> ZooFamily:
        needing = next((name for name in ("surfaces", "rooms") if getattr(self, name) is not None), None)
        if needing and self.draw is None:
            raise PluginError(f"ZooFamily.draw: expected a function, whose parameters {needing} takes; found none")
        return self
