"""Writes pictures, masks and the instances JSON of each split."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere.errors import UserError
from viewsphere.formats.coco.categories import keeps_ids, notes
from viewsphere.formats.coco.entries import Entries, Entry, files, seen
from viewsphere.formats.coco.instances import instances
from viewsphere.formats.coco.options import Options
from viewsphere.formats.shared.export_files import put
from viewsphere.model.channel import missing
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.store import Dataset

CHANNELS = ("rgb",)


def preparer(dataset: Dataset, folder: Path, options: Options) -> Callable[[Sample], Entry]:
    """Puts a sample's images and masks in place, and makes its entries of the instances JSON."""
    entries = Entries(dataset, options)

    def prepare(sample: Sample) -> Entry:
        masks = seen(sample)
        for _, name, content in files(dataset, sample, masks, options):
            put(dataset, content, folder / name)
        return entries.of(sample, masks)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None], options: Options) -> Generator[Callable[[Entry], None]]:
    """Write the instances JSON of each split, and models.

    Raises UserError if the data set has no picture: channel `rgb`, or else `rgba`.
    """
    if missing(CHANNELS, dataset.plan.channels):
        raise UserError(f"{dataset.root}: format coco: expected channel rgb, found none: add it to the recipe's channels")
    for line in () if keeps_ids(dataset) else notes(dataset.categories, options):
        note(f"note: {line}")
    with instances(dataset, folder / "annotations", options) as append:
        yield append
    dataset.link_models(folder / "MODELS")
