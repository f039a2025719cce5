"""A data set as its exports show it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from viewsphere.model.sample import Sample
from viewsphere.store.samples.choice import Choice
from viewsphere.store.samples.dataset import Dataset


class Exported(Dataset):
    """A data set whose samples lack the annotations that exports leave out: of what is seen no more than `least`, if that
    is said.
    """

    def __init__(self, root: str | os.PathLike[str], choice: Choice | None, least: float | None) -> None:
        super().__init__(root, choice)
        self.least = least

    def __reduce__(self) -> tuple[type[Dataset], tuple[Path, Choice, float | None]]:  # pyright: ignore[reportIncompatibleMethodOverride]
        return type(self), (self.root, self.choice, self.least)

    def shown(self, sample: Sample) -> Sample:
        """A sample of the data set with the annotations that are kept; of imported ones nobody knows the visibility."""
        if self.least is None:
            return sample
        kept = tuple(o for o in sample.objects if o.source is not None or o.visibility > self.least)
        return replace(sample, objects=kept)
