"""The layout and JSON of the tool of Ruiz et al. 2019, key for key, without its faults (docs/formats.md lists them).

    dataset1.json
    MODELS/<key>/<key>.obj, .glb, ...
    Pose-<index>/RGB|MASK|DEPTH/<object>-<pose>.png|.tiff

Pictures imported without a camera are left out, because the layout sorts everything by pose. An object's name is its model's
key. If a pose has several frames, or a frame several objects, the numbers of the frame and the object follow it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.refusals import any_view, no_lone_mosaic
from viewsphere.model.channel import ALL_PICTURES
from viewsphere.plugins.format import FormatSpec, Remark

if TYPE_CHECKING:
    from collections.abc import Collection

    from viewsphere.formats.native.writing import Entry
    from viewsphere.model.sample import Sample
    from viewsphere.store import Dataset
    from viewsphere.store.foreign import ForeignDataset

# Plans call only `refuses`, so each function imports its code when it is called.


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: no picture has a known camera and viewpoint, or colours."""
    yield from any_view(scope)
    yield from no_lone_mosaic(scope)


def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None]
) -> AbstractContextManager[Callable[[list[Entry]], None]]:
    """Write `dataset1.json`, and models."""
    from viewsphere.formats.native.writing import writer

    return writer(dataset, folder, note)


def _preparer(dataset: Dataset, folder: Path) -> Callable[[Sample], list[Entry]]:
    """Puts a sample's picture, masks and depth in place, and makes its entries of `dataset1.json`."""
    from viewsphere.formats.native.writing import preparer

    return preparer(dataset, folder)


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Every fault of an export."""
    from viewsphere.formats.native.writing import verify

    return verify(dataset, folder, sampled)


def _read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """A data set in the layout of the paper's own tool."""
    from viewsphere.formats.native.reading import read

    return read(path, keep_going=keep_going)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("poses", "3D boxes", "masks", "depth"),
    read_by=("any JSON reader",),
    panoramas=True,
    pictures=ALL_PICTURES,
    holds_seam=True,
    refuses=_refuses,
    writer=_writer,
    preparer=_preparer,
    verify=_verify,
    read=_read,
)
