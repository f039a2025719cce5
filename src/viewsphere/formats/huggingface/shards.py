"""The Parquet files, written row by row."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from viewsphere.formats.huggingface.arrow import arrow
from viewsphere.formats.huggingface.columns import Columns, arrow_type
from viewsphere.formats.huggingface.options import Options
from viewsphere.model.sample import Sample

ROWS, BYTES = 100, 1 << 25
"""Limits of a group of rows, the unit held in memory: its number of rows, and its bytes of pictures."""


@dataclass
class _Split:
    """The files of a split: the number of complete files, and the started part of the next one."""

    name: str
    whole: int = 0
    samples: int = 0
    file: Any = None
    rows: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    size: int = 0


class Shards:
    """Writes samples into the files of a folder."""

    def __init__(self, columns: Columns, folder: Path, options: Options) -> None:
        self.columns, self._folder, self._most = columns, folder, options.samples_per_shard
        types = {name: arrow_type(feature) for name, feature in columns.features.items()}
        told = json.dumps({"info": {"features": columns.features}})
        self._schema: Any = arrow().schema(types, metadata={"huggingface": told})
        self.splits: dict[str, _Split] = {}
        (folder / "data").mkdir()

    def add(self, sample: Sample) -> list[str]:
        """Write a sample. Returns the name of the file that it completes, if any."""
        split = self.splits.setdefault(sample.split, _Split(split_name(sample.split)))
        row, size = self.columns.row(sample)
        split.rows.append(row)
        split.size += size
        split.samples += 1
        if len(split.rows) == ROWS or split.size >= BYTES:
            self._flush(split)
        return [self._finish(split)] if split.samples == self._most else []

    def end(self) -> list[str]:
        """Finish the last files. Returns their names."""
        return [self._finish(split) for split in self.splits.values() if split.samples]

    def _flush(self, split: _Split) -> None:
        pa, file = arrow(), self._folder / _file(split)
        if split.file is None:
            split.file = pa.parquet.ParquetWriter(file, self._schema, compression="snappy", use_dictionary=False)
        split.file.write_table(pa.Table.from_pylist(split.rows, self._schema))
        split.rows, split.size = [], 0

    def _finish(self, split: _Split) -> str:
        if split.rows:
            self._flush(split)
        split.file.close()
        name = _file(split)
        split.whole, split.samples, split.file = split.whole + 1, 0, None
        return name


def _file(split: _Split) -> str:
    return f"data/{split.name}-{split.whole:05d}.parquet"


def split_name(split: str) -> str:
    """A split's name as `datasets` allows it: letters, digits and underscores."""
    return re.sub(r"\W", "_", split)
