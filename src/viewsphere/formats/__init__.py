"""Formats that a data set can be exported to; these are the protocols that a format implements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

    from viewsphere.model.frozen import Frozen
    from viewsphere.model.rig import Rig
    from viewsphere.model.sample import Sample
    from viewsphere.store import Category, Dataset

Remark = tuple[int | None, str]
"""A fault of an export: the number of its frame in the plan (None: of the whole export), and what is wrong."""


@dataclass(frozen=True)
class Scope:
    """What is known of a data set before any of it is rendered. `rig`: that of its first part, None where nobody knows it, as
    of imported pictures; `is_moving`: its pictures are of sequences; `most_objects`: of one picture; `channels` and
    `annotations`: labels and passes that it keeps, and those that can be computed of its shots; `pictures`: a few of each part,
    of those of which different things are known, where the shots of any part are not kept, as those of imported ones.
    """

    categories: tuple[Category, ...]
    splits: tuple[str, ...]
    rig: Rig | None
    is_moving: bool
    most_objects: int
    channels: tuple[str, ...]
    annotations: tuple[str, ...]
    pictures: tuple[Sample, ...] = ()


class Format(Protocol):
    """A module that writes a data set in one format: `writer`.

    Most formats are trees of files (`viewsphere.formats._tree`), from which these functions follow. A format may also have:

    - `HOLDS`, what it holds, and `READ_BY`, the programs that read it: a few words each.
    - `Options`, a pydantic class of what recipes and the command line may say of it, of which `writer` and the other functions
      are then given one as their last argument; the fields' descriptions are its documentation.
    - `CHANNELS`, names of all labels and passes that it reads besides pictures that happen to be there (without it, a format
      takes whatever is kept), and `needs(*options)`, names of more that it reads then. A run that does not keep them is
      refused before it begins; an export computes those that are labels. `LIDAR = True`: a LiDAR's frames may lack them.
    - `refuses(scope, *options)`, which yields what of a `Scope` it cannot hold: `expected ...; found ...`.
    - `check()`, which raises a UserError where the format cannot be written on this machine.
    - `ANNOTATES = False`, if samples are to have all their objects, those too that the recipe leaves out of annotations.
    - `CREDITS = False`, if it does not name the models' credits: it needs not be written again where only these change.
    - `preparer` of `Prepared`, by which several processes share the work.
    - `notes(categories, *options)`, with lines for the user of what these options mean for a data set's categories.
    - `verify(dataset, folder, sampled)` of `Verified`, with which `viewsphere check` proves an export.
    - `read(path, *, keep_going) -> ForeignDataset` (`viewsphere.store.foreign`), with which data sets of it are imported.
    - `again(path) -> Again` (`viewsphere.store.again`), with which `viewsphere new --from` makes recipes of its data sets.
    """

    def writer(
        self, dataset: Dataset, folder: Path, note: Callable[[str], None], *options: Frozen
    ) -> AbstractContextManager[Callable[[Any], None]]:
        """A context manager that writes an export into this empty folder; stored pictures are put there by `dataset.link`.

        Entering the context gives a function that is called with the finished samples, or with what is prepared of them, one
        after another in frame order, and keeps none of them. Leaving the context finishes the export. `note` takes lines for
        the user; `options` is the format's `Options`, of one that has some.
        """
        ...


class Prepared(Protocol):
    """A format that makes of a sample what can be made of it anywhere and in any order."""

    def preparer(self, dataset: Dataset, folder: Path, *options: Frozen) -> Callable[[Sample], Any]:
        """A function that puts a sample's own files into the export's folder, and gives what `writer`'s is called with instead
        of the sample: something that pickle takes, and no more than a frame's part of the export.

        It is called once for each sample; where many are exported by several processes, in any of these, in any order.
        """
        ...


class Verified(Protocol):
    """A format whose exports can be proved."""

    def verify(self, dataset: Dataset, folder: Path, sampled: Collection[int], *options: Frozen) -> Iterator[Remark]:
        """All that is not as `writer` makes it, of every field of every frame and every file; a file that cannot be read is no
        exception.

        `options`: the format's `Options` as the export was written with, of one that has some. `sampled`: positions in the data
        set of the frames for costly proofs, as by another reader of the format.
        """
        ...
