"""The proof of an export: each file beside what would be written now."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path

from viewsphere.aside import temporary
from viewsphere.formats.native.entries import Entry, entries_of, files
from viewsphere.formats.native.poses import FILE_NAME, poses
from viewsphere.formats.shared.export_files import Expected, check_files, models
from viewsphere.formats.shared.json_proof import check_json
from viewsphere.formats.shared.json_rows import Where
from viewsphere.plugins.format import Remark
from viewsphere.store import Dataset

OPENED: tuple[Where, ...] = (
    *((), ("vehicles",), ("poses",)),
    *(("poses", "*"), ("poses", "*", "vehicles_rendered")),
)
"""The parts of the JSON that the proof compares item by item."""


def verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Yield every difference from the current export; no proof is limited to the `sampled` frames."""
    with temporary("native") as aside:
        with poses(dataset, aside) as append:
            again = _expected(dataset, lambda entries: None)
            yield from check_files(dataset, folder, _expected(dataset, append), again, [FILE_NAME])
        yield from check_json(aside / FILE_NAME, folder / FILE_NAME, OPENED, lambda where, value: None)


def _expected(dataset: Dataset, append: Callable[[Sequence[Entry]], None]) -> Iterator[Expected]:
    """Yield every file but the JSON; for the JSON, `append` receives each frame."""
    for sample in dataset:
        append(entries_of(dataset, sample))
        yield from files(dataset, sample)
    yield from models(dataset)
