"""The composition of a part's shots from its recipe, for runs that render them and for proofs that compare them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.extension import DatasetPart
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.models import mesh_digest
from viewsphere.run.shots.stages import Stages, StoredBoxes
from viewsphere.store import Row


class SceneryRecord(Frozen):
    """The background of a shot: things of id 0, and the digest of each model's mesh by its key at the time step shown."""

    things: tuple[Thing, ...]
    digests: dict[str, str]


@dataclass(frozen=True, eq=False)
class Composer:
    """Composes shots of a part; `boxes` gives the sizes of the data set's models."""

    portion: DatasetPart
    boxes: StoredBoxes
    stages: Stages
    _digests: dict[str, str] = field(default_factory=dict[str, str])

    def shot(self, row: Row) -> Shot:
        """The shot of a row, after redraws until it fits. Raises UserError as `DatasetPart.shot`."""
        with self.portion.plan.recipe.located():
            return self._framing.shot(row, self._settled(row))

    @cached_property
    def _framing(self) -> Framing:
        return Framing(self.portion.plan, self.portion, self.stages, self.boxes)

    def _settled(self, row: Row) -> int | None:
        """The redraw number of a row's scene in the shots of earlier parts; None if they have no shot of the scene."""
        if not self.portion.number or self.portion.plan.draws == 1:
            return None
        parts = (index for number in range(self.portion.number) for index in self.portion.record.indices_of(number))
        shots = (self.boxes.store.shot(other.key) for index in parts for other in index.rows_of(row.subject))
        return next((shot.redraw for shot in shots if shot), None)

    def scenery(self, shot: Shot) -> str:
        """The background of a shot, and digests of its meshes, in the form that `SceneryRecord` reads; empty without a
        background.
        """
        things = tuple(thing for thing in shot.things if thing.id == 0)
        shown = {
            thing.model.key_at(step and step.frame): (thing.model, step) for thing in things for step in thing.motion.steps
        }
        for key, (spec, step) in shown.items():
            if key not in self._digests:
                self._digests[key] = mesh_digest(self.stages.model(spec, step))
        digests = {key: self._digests[key] for key in shown}
        return SceneryRecord(things=things, digests=digests).model_dump_json() if things else ""
