"""Parquet files that `datasets.load_dataset` of Hugging Face reads directly, with a type for every column.

    README.md                          the data set's card: the files of each split
    data/<split>-00000.parquet, ...    one row for each sample; pictures are inside

The files' Arrow schema holds the types, where `datasets` looks for them (https://huggingface.co/docs/datasets). Writing needs
the extra `huggingface`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from viewsphere.errors import UserError
from viewsphere.files import read_bytes
from viewsphere.formats.huggingface.arrow import arrow
from viewsphere.formats.huggingface.columns import Columns
from viewsphere.formats.huggingface.options import Options
from viewsphere.formats.huggingface.shards import Shards, split_name
from viewsphere.formats.shared.writing.export_files import check_files, same_bytes
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.store import Dataset
from viewsphere.store.credits import credits_text, escaped

_FOREIGN = "parquet-cpp-arrow version "
"""The beginning of the text in which pyarrow names the version that wrote a file. Another version may write the same values in
other bytes.
"""


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
    (folder / _CARD).write_text(_card(dataset, shards), "utf-8", newline="\n")


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: Options) -> Iterator[Remark]:
    """Yield every difference from the current export. The proof makes a new export, of which only one file for each split
    exists at a time.
    """
    names = [_CARD]
    with TemporaryDirectory() as scratch_folder:
        shards = Shards(Columns(dataset), Path(scratch_folder), options)
        for name in _all(shards, dataset):
            names.append(name)
            if (folder / name).is_file():
                changes = _changes(Path(scratch_folder), folder, name)
                yield from ((frame, f"{name}: {what}: export again") for frame, what in changes)
            (Path(scratch_folder) / name).unlink()
    file = folder / _CARD
    if file.is_file() and read_bytes(file) != _card(dataset, shards).encode():
        yield None, f"{_CARD}: expected the card that is exported, found another: export again"
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
    if same and (wrote == other or not other.startswith(_FOREIGN)):
        yield None, "expected the bytes that are exported, found the same values in others"


def _rows(file: Any) -> Iterator[dict[str, Any]]:
    for batch in file.iter_batches(batch_size=1):
        yield from batch.to_pylist()


FORMAT = FormatSpec(
    parallel_rays=True,
    about=__doc__,
    holds=("everything but maps of points",),
    read_by=("datasets",),
    options=Options,
    check=_check,
    panoramas=True,
    writer=_writer,
    verify=_verify,
)


_CARD = "README.md"


def _card(dataset: Dataset, shards: Shards) -> str:
    """The text of the data set's card: the files of each split, the columns, and the credits. It is YAML
    (https://huggingface.co/docs/hub/datasets-manual-configuration) and Markdown.
    """
    files = "".join(f"  - split: {s.name}\n    path: data/{s.name}-*.parquet\n" for s in shards.splits.values())
    head = f"---\npretty_name: {json.dumps(dataset.name)}\nconfigs:\n- config_name: default\n  data_files:\n{files}---\n"
    columns = "".join(f"| `{name}` | {_told(feature)} |\n" for name, feature in shards.columns.features.items())
    text = f"\n# {escaped(dataset.name)}\n\nMade by viewsphere {dataset.plan.version}.\n\n"
    table = f"| column | type |\n|---|---|\n{columns}"
    credits = credits_text(dataset.models)
    return head + text + table + (f"\n{credits.replace('# ', '## ', 1)}" if credits else "")


def _told(feature: Mapping[str, Any]) -> str:
    match feature.get("_type"):
        case "Image" | "ClassLabel" as kind:
            return kind
        case "Value":
            return feature["dtype"]
        case "Sequence":
            length = f" of {feature['length']}" if feature["length"] >= 0 else ""
            return f"list{length}: {_told(feature['feature'])}"
        case _:
            return "; ".join(f"`{name}`: {_told(inner)}" for name, inner in feature.items())
