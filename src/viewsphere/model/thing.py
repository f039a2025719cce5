"""A thing: a model, where it is at each instant, and how its materials are changed."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.frozen import Frozen
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.numbers import Portion
from viewsphere.model.scene import IDENTITY, Color, Matrix4


class Repaint(Frozen):
    """A change to the materials whose names match `material`, a pattern of fnmatch. What is None stays as the file says."""

    material: str = Field(default="*", min_length=1, description="names of the materials, a pattern such as paint*")
    tint: Color | None = Field(default=None, description="multiplies the colour; white changes nothing: linear [r, g, b]")
    metallic: Portion | None = Field(default=None, description="instead of what the model says: 1 is metal")
    roughness: Portion | None = Field(default=None, description="instead of what the model says: 0 a mirror, 1 matt")


class Motion(Frozen):
    """Where a thing is: one rigid pose (world from object) for all instants of a shot, or one an instant, None where the thing
    is not there.
    """

    poses: tuple[Matrix4 | None, ...] = Field(default=(IDENTITY,), min_length=1)

    @property
    def is_still(self) -> bool:
        """Whether one pose is for all instants."""
        return len(self.poses) == 1

    def at(self, instant: int) -> Matrix4 | None:
        """World from object at an instant, counted from 0 in the shot."""
        return self.poses[0 if self.is_still else instant]

    @staticmethod
    def still(world_from_object: Matrix4) -> Motion:
        """The motion of what stands still."""
        return Motion(poses=(world_from_object,))


class Thing(Frozen):
    """One thing of a scene: an object with an id of 1..N, or with id 0 scenery that is background to every label.

    An object's id is the same at all instants of a sequence. Things of one model are instances. `scenery` marks what the
    targets stand in front of, labelled or not.
    """

    id: int = Field(ge=0)
    model: ModelSpec
    motion: Motion = Motion()
    scenery: bool = False
    repaints: tuple[Repaint, ...] = ()  # the last that matches a material counts

    @property
    def is_there(self) -> bool:
        """Whether a still thing is there at all; of a moving one, whether it is at first."""
        return self.motion.poses[0] is not None

    @property
    def world_from_object(self) -> Matrix4:
        """The pose of a still thing, of a moving one its first; the identity where the thing is not there."""
        return self.motion.poses[0] or IDENTITY
