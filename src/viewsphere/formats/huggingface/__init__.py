"""Parquet files that `datasets.load_dataset` of Hugging Face reads directly, with a type for every column.

    README.md                          the data set's card: the files of each split
    data/<split>-00000.parquet, ...    one row for each sample; pictures are inside

The files' Arrow schema holds the types, where `datasets` looks for them (https://huggingface.co/docs/datasets). Writing needs
the extra `huggingface`.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from viewsphere.errors import UserError
from viewsphere.formats.huggingface.arrow import arrow
from viewsphere.formats.huggingface.card import CARD, card
from viewsphere.formats.huggingface.columns import Columns
from viewsphere.formats.huggingface.options import Options
from viewsphere.formats.huggingface.proving import verify
from viewsphere.formats.huggingface.shards import Shards, split_name
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


def _check() -> None:
    """Raise MissingExtraError if pyarrow is missing."""
    arrow()


@contextmanager
def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None], options: Options
) -> Generator[Callable[[Sample], None]]:
    """Write the files of all splits and the card.

    Raises UserError for splits that `datasets` could not distinguish.
    """
    if len({split_name(split) for split in dataset.splits}) < len(dataset.splits):
        told = ", ".join(dataset.splits)
        raise UserError(f"format huggingface: expected splits that differ in letters, digits and underscores; found {told}")
    columns = Columns(dataset)
    if columns.left_out:
        note(f"note: huggingface: left out, as Pillow has no such pictures: {', '.join(columns.left_out)}")
    shards = Shards(columns, folder, options)

    def add(sample: Sample) -> None:
        shards.add(sample)

    yield add
    shards.end()
    (folder / CARD).write_text(card(dataset, shards), "utf-8", newline="\n")


FORMAT = FormatSpec(
    parallel_rays=True,
    about=__doc__,
    holds=("everything but maps of points",),
    read_by=("datasets",),
    options=Options,
    check=_check,
    panoramas=True,
    writer=_writer,
    verify=verify,
)
