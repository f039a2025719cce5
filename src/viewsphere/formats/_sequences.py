"""What formats of sequences have in common: which sensors are the left and the right eye, folders of scenes, their ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from viewsphere.errors import StoreError, UserError
from viewsphere.formats import Scope
from viewsphere.model.rig import Pair
from viewsphere.model.sample import Sample
from viewsphere.recipe.sequence import TimeEntry
from viewsphere.store import Dataset
from viewsphere.store.paths import is_name


def two_eyes(scope: Scope) -> Iterator[str]:
    """Of a format of one camera, or of a rectified pair: all else of a rig."""
    if scope.rig is not None:
        names = [sensor.name for sensor in scope.rig.sensors if sensor.lidar is None]
        if len(names) > 2 or (len(names) == 2 and not scope.rig.rectified):
            yield f"expected one camera, or two that are rectified; found {', '.join(names)}"


class Eyes:
    """The sensors of a data set that a format calls left and right; a lone camera is the left one."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        shots = (dataset.labelled(row.key) for row in dataset.rows[:1])
        rig = next((shot.rig for shot in shots if shot is not None), None)
        pair = rig.rectified[0] if rig and rig.rectified else Pair(0, 0, 0.0)
        sensors = rig.sensors if rig else ()
        self._sides: Mapping[str, str] = {}
        if sensors:
            self._sides = {sensors[pair.right].name: "right", sensors[pair.left].name: "left"}

    def side(self, sample: Sample) -> str:
        """`left` or `right`; raises UserError for a sensor that the first sequence does not have."""
        if sample.sensor not in self._sides:
            known = ", ".join(self._sides) or "none"
            raise UserError(
                f"frame {sample.index}: expected a picture of a sensor of the first part ({known}); found {sample.sensor}"
            )
        return self._sides[sample.sensor]

    def baseline(self, sample: Sample) -> float:
        """Metres between the two eyes of a sample's shot; 0 without a pair."""
        shot = self._dataset.labelled(sample.taken.key) if sample.taken else None
        return shot.rig.rectified[0].baseline if shot and shot.rig.rectified else 0.0


def check_whole(dataset: Dataset, name: str) -> None:
    """Raise UserError where instants of one sequence are of several splits."""
    parts = [part.recipe.get("splits", {}) for part in dataset.plan.parts]
    if len(dataset.splits) > 1 and any(splits.get("by") == "frame" for splits in parts):
        raise UserError(f"{name}: expected splits that keep sequences whole; found splits.by: frame: split by sequence")


def scene(sample: Sample) -> str:
    """The name of a sample's sequence, as a folder's; raises StoreError for one that a folder cannot have."""
    if not is_name(sample.sequence):
        raise StoreError(f"frame {sample.index}: expected a sequence's name without /; found {sample.sequence!r:.100}")
    return sample.sequence


def instants(dataset: Dataset, sample: Sample) -> int:
    """Number of the instants of a sample's sequence, as it is planned."""
    plan = dataset.plan
    return TimeEntry.model_validate(plan.parts[plan.part_of(sample.index)].recipe["time"]).count


def number(value: int, count: int, digits: int = 4) -> str:
    """A number of at least so many digits, and of as many as the largest of `count` has, so that names sort as numbers do."""
    return f"{value:0{max(digits, len(str(count)))}d}"
