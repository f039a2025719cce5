"""Frames repainted from the recipe, and compared with the stored pictures and passes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.check.frames.recomputed import CONTRADICTED, Recomputed, rows_of
from viewsphere.check.frames.recomputed_labels import unequal
from viewsphere.check.report import in_short
from viewsphere.errors import BlenderDied, BlenderError, UserError
from viewsphere.kernels.build import PAINTER
from viewsphere.labels import channels
from viewsphere.model.channel import PASSES
from viewsphere.model.fields.files import LOSSY, Files
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.planning.engine_digest import engine_digest
from viewsphere.planning.fitting import LOOK
from viewsphere.store import Dataset, Row, decode, encode
from viewsphere.store.shots.manifest import Manifest

STEP = 1
"""Difference in 8-bit levels allowed on another processor, where float32 sums near a half round the other way."""

SHARE = 2.0**-10
"""Relative difference of a pass allowed on another processor: the precision of half floats, or a step of an 8-bit picture."""

LOSSY_STEPS = 4
"""Levels by which a lossy file may differ if its picture differs by one: the rounding of a block is coarser at high quality."""


class Repainted:
    """Repaints frames of a data set and counts them in `frames`; `why_not` has the reason for each part that cannot be
    repainted.
    """

    def __init__(self, dataset: Dataset, recomputed: Recomputed) -> None:
        self.frames = 0
        self.why_not: dict[int, str] = {}
        self._dataset, self._recomputed = dataset, recomputed

    def differences(self, sample: Sample) -> Iterator[str]:
        """Pictures and passes of a sample that differ from the repainted ones."""
        before = dict(self.why_not)
        for row in rows_of(self._dataset.plan, sample.index):
            yield from self._of_row(row, sample)
        self.frames += before == self.why_not

    @property
    def reasons(self) -> str:
        """Return the reasons why parts could not be painted; empty if all could."""
        return in_short(self.why_not.values())

    def _of_row(self, row: Row, sample: Sample) -> Iterator[str]:
        composer = self._recomputed.composer(row.part)
        if composer is None:
            self.why_not[row.part] = self._recomputed.reasons or CONTRADICTED
            return
        if self._dataset.plan.parts[row.part].settings.get(LOOK) != engine_digest(composer.portion.plan.recipe.engine.name):
            self.why_not[row.part] = "painted by another state of the engine's program"
            return
        try:
            shot = composer.shot(row)
            painted = self._painted(shot, sample.index)
        except (UserError, BlenderError, BlenderDied) as error:
            self.why_not[row.part] = str(error)
            return
        tolerant = Manifest.read(self._dataset.store.shot_folder(row.key)).painter not in ("", PAINTER)
        for name in PASSES:
            if name in painted.channels:
                yield from _compared(name, painted.channels[name], sample, shot.files, tolerant)

    def _painted(self, shot: Shot, number: int) -> Sample:
        """The sample of a number, painted together with only the other samples of its instant."""
        instant, sensor = next((instant, sensor) for place, instant, sensor in shot.samples if place == number)
        instants = (now.model_copy(update={"recorded": i == instant}) for i, now in enumerate(shot.instants))
        alone = shot.model_copy(update={"instants": tuple(instants), "first": number - sensor})
        return next(sample for sample in self._recomputed.stages.render(alone) if sample.index == number)


def _compared(name: str, painted: NDArray[Any], sample: Sample, files: Files, tolerant: bool) -> Iterator[str]:
    """The difference of a stored channel from the repainted one, which is written and read in the same way."""
    channel = channels()[name]
    wanted, found = decode(channel, Path(name), lambda: encode(channel, painted, files)), sample.channels[name]
    if wanted.shape != found.shape:
        yield f"{name}: expected shape {wanted.shape}, which was painted again; found {found.shape}"
        return
    wrong = _beyond(found, wanted, files.encoding(channel) in LOSSY) if tolerant else unequal(found, wanted)
    if wrong.any():
        where = tuple(int(i[0]) for i in np.nonzero(wrong))
        yield (
            f"{name}: {wrong.sum()} of {wrong.size} pixels are not those painted again: at pixel {where[1::-1]} expected "
            f"{wanted[where[:2]].tolist()}, found {found[where[:2]].tolist()}"
        )


def _beyond(found: NDArray[Any], wanted: NDArray[Any], is_lossy: bool) -> NDArray[np.bool_]:
    """A mask (H, W): True where any component differs by more than another processor allows."""
    if np.issubdtype(found.dtype, np.integer):
        most = LOSSY_STEPS if is_lossy else SHARE * np.iinfo(found.dtype).max if found.dtype == np.uint16 else STEP
        return unequal(np.abs(found.astype(np.int64) - wanted) > most, np.zeros(found.shape, np.bool_))
    return unequal(np.isclose(found, wanted, rtol=SHARE, atol=SHARE, equal_nan=True), np.ones(found.shape, np.bool_))
