"""The proof of an export: each file beside what would be written now, and what pycocotools, another reader, makes of it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viewsphere.aside import temporary
from viewsphere.formats.coco.entries import Entries, Entry, files, seen
from viewsphere.formats.coco.instances import file_name, file_names, instances
from viewsphere.formats.coco.options import Options
from viewsphere.formats.coco.witness import testify
from viewsphere.formats.shared.export_files import Expected, check_files, models
from viewsphere.formats.shared.json_proof import check_json
from viewsphere.formats.shared.json_rows import Where
from viewsphere.plugins.format import Remark

if TYPE_CHECKING:
    from viewsphere.store import Dataset

OPENED: tuple[Where, ...] = ((), ("categories",), ("models",), ("images",), ("annotations",))
"""The parts of an instances file that the proof reads and compares item by item."""


def verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: Options) -> Iterator[Remark]:
    """Yield every difference from the current export. For the `sampled` frames, pycocotools' masks must equal the stored
    instance maps, and detections made from these maps must score AP 1.
    """
    names = file_names(dataset)
    with temporary("coco") as aside:
        with instances(dataset, aside, options) as append:
            expected, again = _expected(dataset, append, options), _expected(dataset, _nowhere, options)
            yield from check_files(dataset, folder, expected, again, [f"annotations/{name}" for name in names])
        for name in names:
            yield from check_json(aside / name, folder / "annotations" / name, OPENED, _frame)
        for split in dataset.splits:
            yield from testify(dataset, folder / "annotations" / file_name(split), split, sampled, options)


def _expected(dataset: Dataset, append: Callable[[Entry], None], options: Options) -> Iterator[Expected]:
    """Yield every file but the instances; for the instances, `append` receives each frame."""
    entries = Entries(dataset, options)
    for sample in dataset:
        masks = seen(sample)
        append(entries.of(sample, masks))
        yield from files(dataset, sample, masks, options)
    yield from models(dataset)


def _nowhere(entry: Entry) -> None:
    """Ignore a frame, for callers that need only its files."""


def _frame(where: Where, value: Any) -> int | None:
    """Ids of images are frames, counted from 1."""
    key = {"images": "id", "annotations": "image_id"}.get(where[0] if where else "")
    number = value.get(key) if key and isinstance(value, dict) else None
    return number - 1 if isinstance(number, int) else None
