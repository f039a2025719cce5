"""The proof of an export: each file compared with a new export."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from viewsphere.files import read_bytes
from viewsphere.formats.huggingface.arrow import arrow
from viewsphere.formats.huggingface.card import CARD, card
from viewsphere.formats.huggingface.columns import Columns
from viewsphere.formats.huggingface.options import Options
from viewsphere.formats.huggingface.shards import Shards
from viewsphere.formats.shared.writing.export_files import check_files, same_bytes
from viewsphere.plugins.format import Remark
from viewsphere.store import Dataset

FOREIGN = "parquet-cpp-arrow version "
"""The beginning of the text in which pyarrow names the version that wrote a file. Another version may write the same values in
other bytes.
"""


def verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: Options) -> Iterator[Remark]:
    """Yield every difference from the current export. The proof makes a new export, of which only one file for each split
    exists at a time.
    """
    names = [CARD]
    with TemporaryDirectory() as scratch_folder:
        shards = Shards(Columns(dataset), Path(scratch_folder), options)
        for name in _all(shards, dataset):
            names.append(name)
            if (folder / name).is_file():
                changes = _changes(Path(scratch_folder), folder, name)
                yield from ((frame, f"{name}: {what}: export again") for frame, what in changes)
            (Path(scratch_folder) / name).unlink()
    file = folder / CARD
    if file.is_file() and read_bytes(file) != card(dataset, shards).encode():
        yield None, f"{CARD}: expected the card that is exported, found another: export again"
    yield from check_files(dataset, folder, (), (), names)


def _all(shards: Shards, dataset: Dataset) -> Iterator[str]:
    for sample in dataset:
        yield from shards.add(sample)
    yield from shards.end()


def _changes(scratch_folder: Path, folder: Path, name: str) -> Iterator[Remark]:
    """Yield the differences between a file and the file of the same name made for comparison."""
    if same_bytes(scratch_folder / name, folder / name):
        return
    pa = arrow()
    try:
        ours, theirs = (pa.parquet.ParquetFile(place / name) for place in (scratch_folder, folder))
        with ours, theirs:
            same = ours.schema_arrow.equals(theirs.schema_arrow, check_metadata=True)
            if not same:
                yield None, "expected the columns that are exported, found others"
            for one, other in zip_longest(_rows(ours), _rows(theirs)):
                differing = [key for key in one or other if repr((one or {}).get(key)) != repr((other or {}).get(key))]
                same = same and not differing
                if differing:
                    yield (one or other)["index"], f"expected the {differing[0]} that is exported, found another"
            wrote, other = ours.metadata.created_by, theirs.metadata.created_by
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError, MemoryError) as error:
        yield None, f"expected a Parquet file, found: {error!s:.200}"
        return
    if same and (wrote == other or not other.startswith(FOREIGN)):
        yield None, "expected the bytes that are exported, found the same values in others"


def _rows(file: Any) -> Iterator[dict[str, Any]]:
    for batch in file.iter_batches(batch_size=1):
        yield from batch.to_pylist()
