"""A thing: a model, where it is at each instant, and how its materials are changed."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Color, Matrix4, Picture


class Repaint(OmitNone):
    """A change to the materials whose names match `material`, a pattern of fnmatch. What is None stays as the file says."""

    OMIT_IF_NONE = ("image", "texture")

    material: str = Field(default="*", min_length=1, description="names of the materials, a pattern such as paint*")
    tint: Color | None = Field(default=None, description="multiplies the colour; white changes nothing: linear [r, g, b]")
    metallic: Portion | None = Field(default=None, description="replaces the model's value: 1 is metal")
    roughness: Portion | None = Field(default=None, description="replaces the model's value: 0 a mirror, 1 matt")
    image: Picture | None = Field(default=None, description="path of a picture that replaces the colour of opaque materials")
    texture: ProceduralMaterial | None = Field(default=None, description="built-in material that replaces opaque materials")


class TimeStep(Frozen):
    """A time step of an animated model: a frame of its file, and the seconds since that file's first frame.

    `file_from_axes`: where the rigid axes of the parts are then that are taken of the model; None: where `Parts` says.
    """

    frame: int
    seconds: float = 0.0
    file_from_axes: Matrix4 | None = None


class Motion(Frozen):
    """The place of a thing, and the time step of its file that it shows.

    `poses` has one rigid pose (world from object) for all instants of a shot, or one an instant, None where the thing is not
    there. `steps` has one time step for all instants, or one an instant, None for a model at rest. A thing of a sequence with
    `moves` does not count as still, even if it rests during a shot.
    """

    poses: tuple[Matrix4 | None, ...] = Field(default=(IDENTITY,), min_length=1)
    steps: tuple[TimeStep | None, ...] = Field(default=(None,), min_length=1)
    moves: bool = False

    @property
    def is_still(self) -> bool:
        """Return whether one pose is for all instants, and no time step is shown."""
        return len(self.poses) == 1 and self.steps == (None,) and not self.moves

    def at(self, instant: int) -> Matrix4 | None:
        """World from object at an instant, counted from 0 in the shot."""
        return self.poses[0 if len(self.poses) == 1 else instant]

    def step_at(self, instant: int) -> TimeStep | None:
        """The time step that is shown at an instant, counted from 0 in the shot."""
        return self.steps[0 if len(self.steps) == 1 else instant]

    def held(self, instant: int) -> Motion:
        """The motion of what stays as it is at an instant, counted from 0 in the shot."""
        return self if self.is_still else Motion(poses=(self.at(instant),), steps=(self.step_at(instant),))

    def lasts(self, instants: int) -> bool:
        """Return whether it says where a thing is, and what it shows, at so many instants."""
        return {len(self.poses), len(self.steps)} <= {1, instants}

    @staticmethod
    def still(world_from_object: Matrix4, step: TimeStep | None = None) -> Motion:
        """The motion of what stands still, and shows one time step."""
        return Motion(poses=(world_from_object,), steps=(step,))


class Thing(Frozen):
    """One thing of a scene: an object with an id of 1..N, or with id 0 scenery that is background to every label.

    An object's id is the same at all instants of a sequence. Things of one model are instances. `scenery` marks what the
    targets stand in front of, labelled or not.
    """

    id: int = Field(ge=0)
    model: ModelSpec
    motion: Motion = Motion.of_defaults()
    scenery: bool = False
    repaints: tuple[Repaint, ...] = ()  # the last that matches a material counts

    @property
    def is_target(self) -> bool:
        """Return whether it is an object that pictures are about, no scenery."""
        return bool(self.id) and not self.scenery

    @property
    def is_there(self) -> bool:
        """Return whether a still thing is there at all; of a moving one, whether it is at first."""
        return self.motion.poses[0] is not None

    @property
    def key(self) -> str:
        """The key of its model, as a still thing shows it, or a moving one at first."""
        return self.model.key_at(self.step and self.step.frame)

    @property
    def step(self) -> TimeStep | None:
        """The time step that a still thing shows, a moving one at first."""
        return self.motion.steps[0]

    @property
    def resting(self) -> Thing:
        """The thing at its place, with its model at rest."""
        return self if self.step is None else self.model_copy(update={"motion": Motion(poses=self.motion.poses)})

    def showing(self, step: TimeStep) -> Thing:
        """The thing where it stands, at one time step of its model's file."""
        return self.model_copy(update={"motion": Motion(poses=self.motion.poses, steps=(step,))})

    def at(self, instant: int) -> Thing:
        """The thing as it is at an instant, counted from 0 in the shot: standing still there, or not there."""
        return self if self.motion.is_still else self.model_copy(update={"motion": self.motion.held(instant)})

    @property
    def world_from_object(self) -> Matrix4:
        """The pose of a still thing, of a moving one its first; the identity where the thing is not there."""
        return self.motion.poses[0] or IDENTITY
