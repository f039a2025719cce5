"""The shared parts of formats of sequences: the sensors of the left and the right eye, the folders of scenes, and their last
instants.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from viewsphere.errors import StoreError, UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.timeline import unknown_shots
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Pair, Rig
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.store import Dataset
from viewsphere.store.paths import is_name


def two_eyes(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format of one camera or a rectified pair: other rigs, and unknown ones."""
    yield from unknown_shots(scope)
    if scope.rig is not None:
        names = [sensor.name for sensor in scope.rig.sensors if sensor.lidar is None]
        if len(names) > 2 or (len(names) == 2 and not scope.rig.rectified):
            yield f"expected one camera, or two that are rectified; found {', '.join(names)}"


class Eyes:
    """The sensors that a format calls left and right: the first that are rectified with one another; a lone camera is left."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._rig_of = lru_cache(maxsize=8)(self._read)

    def side(self, sample: Sample) -> str:
        """`left` or `right`; raises UserError for any other sensor."""
        rig, pair = self._rig(sample), self.pair(sample)
        sides = {rig.sensors[pair.right].name: "right", rig.sensors[pair.left].name: "left"}
        if sample.sensor not in sides:
            raise UserError(f"frame {sample.index}: expected sensors {', '.join(reversed(sides))}; found {sample.sensor}")
        return sides[sample.sensor]

    def pair(self, sample: Sample) -> Pair:
        """The two eyes of a sample's shot, and the metres between them; for a lone camera the same sensor twice, 0 apart."""
        rig = self._rig(sample)
        return rig.rectified[0] if rig.rectified else Pair(0, 0, 0.0)

    def numbers(self, sample: Sample) -> tuple[int, int]:
        """The number of the first sample of a sample's instant in the data set, and of the previous instant."""
        assert sample.origin is not None
        first = sample.index - sample.origin.sensor
        return first, first - len(self._rig(sample).sensors)

    def lens(self, sample: Sample) -> Intrinsics:
        """The lens of the left eye in a sample's shot, before any zoom."""
        return self._rig(sample).sensors[self.pair(sample).left].intrinsics

    def _rig(self, sample: Sample) -> Rig:
        if sample.origin is None:
            raise StoreError(f"frame {sample.index}: expected the rig that took it; found an imported picture")
        return self._rig_of(sample.origin.key)

    def _read(self, key: str) -> Rig:
        shot = self._dataset.labelled(key)
        if shot is None:
            raise StoreError(f"{self._dataset.root}: expected a shot {key}, found none")
        return shot.rig


def check_whole(dataset: Dataset, name: str) -> None:
    """Raise UserError if the instants of one sequence belong to several splits."""
    parts = [part.recipe.get("splits", {}) for part in dataset.plan.parts]
    if len(dataset.splits) > 1 and any(splits.get("by") == "frame" for splits in parts):
        raise UserError(f"{name}: expected splits that keep sequences whole; found splits.by: frame: split by sequence")


def scene(sample: Sample) -> str:
    """The name of a sample's sequence, as a folder name. Raises StoreError for a name that a folder cannot have."""
    if not is_name(sample.sequence):
        raise StoreError(f"frame {sample.index}: expected a sequence's name without /; found {sample.sequence!r:.100}")
    return sample.sequence


def instants(dataset: Dataset, sample: Sample) -> int:
    """Planned number of instants of a sample's sequence. Raises UserError for a still picture."""
    time = dataset.plan.parts[dataset.plan.part_of(sample.index)].recipe.get("time")
    if not time:
        raise UserError(f"frame {sample.index}: expected a picture of a sequence; found a still one: export sequences apart")
    return TimeEntry.model_validate(time).count


def number(value: int, count: int, digits: int = 4) -> str:
    """A number with at least this many digits, and as many as the largest of `count` numbers, so that names sort like
    numbers.
    """
    return f"{value:0{max(digits, len(str(count)))}d}"
