"""Ways to write a data set: what a format must offer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from viewsphere.store import Dataset


class Format(Protocol):
    """A module that writes a data set in one format: `export`; with `CHANNELS`, the names of the channels it needs, a run
    that does not keep them is refused before it begins; with `check()`, one that cannot be written here, by a UserError. One
    that has `read(path, *, keep_going) -> ForeignDataset` (`viewsphere.store.foreign`) can be imported, too.
    """

    def export(self, dataset: Dataset, folder: Path) -> Sequence[str] | None:
        """Write the finished frames of the data set into this empty folder; images by `dataset.link`.

        May give notes for the user, a line each.
        """
        ...
