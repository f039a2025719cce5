"""A thing: a model, its pose at each instant, and the changes to its materials."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Color, Matrix4, Picture


class Repaint(OmitNone):
    """A change to the materials whose names match `material`, a pattern of fnmatch. Fields that are None leave the file's
    values unchanged.
    """

    OMIT_IF_NONE = ("image", "texture")

    material: str = Field(default="*", min_length=1, description="names of the materials, a pattern such as paint*")
    tint: Color | None = Field(default=None, description="multiplies the colour; white changes nothing: linear [r, g, b]")
    metallic: Portion | None = Field(default=None, description="replaces the model's value: 1 is metal")
    roughness: Portion | None = Field(default=None, description="replaces the model's value: 0 a mirror, 1 matt")
    image: Picture | None = Field(default=None, description="path of a picture that replaces the colour of opaque materials")
    texture: ProceduralMaterial | None = Field(default=None, description="built-in material that replaces opaque materials")


class TimeStep(Frozen):
    """A time step of an animated model: a frame of its file, and the seconds since that file's first frame.

    `file_from_axes`: the rigid axes of the model's kept parts at this time; None: the axes given in `Parts`.
    """

    frame: int
    seconds: float = 0.0
    file_from_axes: Matrix4 | None = None


class Motion(Frozen):
    """The pose of a thing, and the time step of its file that it shows.

    `poses` has one rigid pose (world from object) for all instants of a shot, or one an instant, None if the thing is not
    there. `steps` has one time step for all instants, or one an instant, None for a model at rest. A thing of a sequence
    with `moves` does not count as still, even if it rests during a shot.
    """

    poses: tuple[Matrix4 | None, ...] = Field(default=(IDENTITY,), min_length=1)
    steps: tuple[TimeStep | None, ...] = Field(default=(None,), min_length=1)
    moves: bool = False

    @property
    def is_still(self) -> bool:
        """Return whether the thing has one pose for all instants, and shows no time step."""
        return len(self.poses) == 1 and self.steps == (None,) and not self.moves

    def pose_at(self, instant: int) -> Matrix4 | None:
        """World from object at an instant, counted from 0 in the shot."""
        return self.poses[0 if len(self.poses) == 1 else instant]

    def step_at(self, instant: int) -> TimeStep | None:
        """The time step that is shown at an instant, counted from 0 in the shot."""
        return self.steps[0 if len(self.steps) == 1 else instant]

    def held(self, instant: int) -> Motion:
        """A still motion with the pose and time step of an instant, counted from 0 in the shot."""
        return self if self.is_still else Motion(poses=(self.pose_at(instant),), steps=(self.step_at(instant),))

    def lasts(self, instants: int) -> bool:
        """Return whether the motion has poses and time steps for this number of instants."""
        return {len(self.poses), len(self.steps)} <= {1, instants}

    @staticmethod
    def still(world_from_object: Matrix4, step: TimeStep | None = None) -> Motion:
        """The motion of a still thing that shows one time step."""
        return Motion(poses=(world_from_object,), steps=(step,))


class Thing(Frozen):
    """One thing of a scene: an object with an id of 1..N, or with id 0 scenery that is background to every label.

    An object's id is the same at all instants of a sequence. Things of one model are instances. `scenery` marks the
    surroundings of the targets, labelled or not.
    """

    id: int = Field(ge=0)
    model: ModelSpec
    motion: Motion = Motion.of_defaults()
    scenery: bool = False
    repaints: tuple[Repaint, ...] = ()  # the last that matches a material counts

    @property
    def is_target(self) -> bool:
        """Return whether it is a subject of the pictures: an object that is not scenery."""
        return bool(self.id) and not self.scenery

    @property
    def is_there(self) -> bool:
        """Return whether the thing is present, for a moving thing at its first instant."""
        return self.motion.poses[0] is not None

    @property
    def key(self) -> str:
        """The key of its model at the shown time step, for a moving thing at its first instant."""
        return self.model.key_at(self.step and self.step.frame)

    @property
    def step(self) -> TimeStep | None:
        """The time step that the thing shows, for a moving thing at its first instant."""
        return self.motion.steps[0]

    @property
    def resting(self) -> Thing:
        """The thing at its place, with its model at rest."""
        return self if self.step is None else self.model_copy(update={"motion": Motion(poses=self.motion.poses)})

    def showing(self, step: TimeStep) -> Thing:
        """The thing at its pose, at one time step of its model's file."""
        return self.model_copy(update={"motion": Motion(poses=self.motion.poses, steps=(step,))})

    def still_at(self, instant: int) -> Thing:
        """The thing as it is at an instant, counted from 0 in the shot: as a still thing, or absent."""
        return self if self.motion.is_still else self.model_copy(update={"motion": self.motion.held(instant)})

    @property
    def world_from_object(self) -> Matrix4:
        """The pose of a still thing, or the first pose of a moving one; the identity where the thing is absent."""
        return self.motion.poses[0] or IDENTITY
