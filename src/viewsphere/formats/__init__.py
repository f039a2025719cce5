"""Ways to write a data set: what a format must offer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

    from viewsphere.model.sample import Sample
    from viewsphere.store import Dataset

Remark = tuple[int | None, str]
"""What is wrong with an export, and with which frame of the plan; None: with the export as a whole."""


class Format(Protocol):
    """A module that writes a data set in one format: `writer`.

    What it may have besides: `CHANNELS`, names of channels: a run that does not keep them is refused before it begins;
    `check()`, which raises a UserError where the format cannot be written; `verify(dataset, folder, sampled)` of `Verified`, by
    which `viewsphere check` proves an export; `read(path, *, keep_going) -> ForeignDataset` (`viewsphere.store.foreign`), by
    which data sets of the format are imported.
    """

    def writer(
        self, dataset: Dataset, folder: Path, note: Callable[[str], None]
    ) -> AbstractContextManager[Callable[[Sample], None]]:
        """Ready to write into this empty folder; images by `dataset.link`.

        The context gives a function that is called with the finished samples, one after another in frame order, and keeps
        none of them. It ends when there are no more. `note` takes lines for the user.
        """
        ...


class Verified(Protocol):
    """A format whose exports can be proved."""

    def verify(self, dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
        """All that is not as `writer` makes it, of every field of every frame and every file; a file that cannot be read is no
        exception.

        `sampled`: positions in the data set of the frames for costly proofs, as by another reader of the format.
        """
        ...
