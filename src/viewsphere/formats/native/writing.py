"""Writes pictures, masks, depth and `dataset1.json`."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from viewsphere.formats.native.entries import Entry, entries_of, files
from viewsphere.formats.native.poses import poses
from viewsphere.formats.shared.export_files import put
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset


def preparer(dataset: Dataset, folder: Path) -> Callable[[Sample], list[Entry]]:
    """Puts a sample's picture, masks and depth in place, and makes its entries of `dataset1.json`."""

    def prepare(sample: Sample) -> list[Entry]:
        for _, name, content in files(dataset, sample):
            put(dataset, content, folder / name)
        return entries_of(dataset, sample)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[list[Entry]], None]]:
    """Write `dataset1.json`, and models."""
    with poses(dataset, folder) as append:
        yield append
    dataset.link_models(folder / "MODELS")
