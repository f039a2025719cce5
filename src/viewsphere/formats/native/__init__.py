"""The layout and JSON of the tool of Ruiz et al. 2019, key for key, without its faults (docs/formats.md lists them).

    dataset1.json
    MODELS/<key>/<key>.obj, .glb, ...
    Pose-<index>/RGB|MASK|DEPTH/<object>-<pose>.png|.tiff

Pictures imported without a camera are left out, because the layout sorts everything by pose. An object's name is its model's
key. If a pose has several frames, or a frame several objects, the numbers of the frame and the object follow it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

from viewsphere.formats import Scope
from viewsphere.formats.native.entries import Entry, entries_of, files
from viewsphere.formats.native.poses import poses
from viewsphere.formats.native.proving import verify
from viewsphere.formats.native.reading import read
from viewsphere.formats.shared.export_files import put
from viewsphere.formats.shared.refusals import any_view
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


def refuses(scope: Scope) -> Iterator[str]:
    """Pictures of which none has a known camera and viewpoint."""
    yield from any_view(scope)


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


FORMAT = FormatSpec(
    about=__doc__,
    holds=("poses", "3D boxes", "masks", "depth"),
    read_by=("any JSON reader",),
    refuses=refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
