"""The import of data sets made elsewhere."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from importlib.metadata import version
from itertools import islice
from pathlib import Path

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.progress import Listener, Progress
from viewsphere.store import Block, Dataset, Part, PlanRecord, Store, located
from viewsphere.store.credits import write_credits
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.shots.linking import link_model, link_shot
from viewsphere.store.shots.records import IMPORT, NAME_BYTES
from viewsphere.validation.errors import one_of

SHOT_FRAMES = 1000
"""Number of frames that are stored in one folder and written together."""


def readable_formats() -> tuple[str, ...]:
    """Names of the formats that can be read, sorted."""
    return tuple(_readers())


def _readers() -> dict[str, Callable[..., ForeignDataset]]:
    return {name: spec.read for name, spec in plugins.loadable(FormatSpec).items() if spec.read is not None}


def import_dataset(
    kind: str, source: Path | str, out: Path | str, *, keep_going: bool = False, listener: Listener | None = None
) -> ForeignDataset:
    """Import a data set of another tool into `out`; pictures are linked instead of copied if possible.

    Returns the foreign data set; its `left_out` lists the parts that `keep_going` left out. Raises UserError for a format that
    cannot be read, StoreError for a broken data set (before anything is written) and for an `out` that contains other data.
    """
    foreign = read_dataset(kind, source, keep_going=keep_going)
    put_in_store(foreign, located(out), listener)
    return foreign


def read_dataset(kind: str, source: Path | str, *, keep_going: bool = False, field: str = "import") -> ForeignDataset:
    """Read a whole data set of another tool.
    Raises as `import_dataset` does; an unknown format is reported as an error of `field`.
    """
    known = _readers()
    if kind not in known:
        raise UserError(f"{field}: {one_of(kind, tuple(known))}")
    return known[kind](Path(source), keep_going=keep_going)


def put_in_store(foreign: ForeignDataset, out: Path, listener: Listener | None = None) -> None:
    """Write the data set into a store, unless it is there already; raises StoreError for an `out` that contains other data."""
    store, record = Store(out), _plan_record(foreign)
    with store.opened_for(record):
        for model in foreign.models:
            link_model(store, model.info.key, model.info, model.files, model.write)
        _link_frames(foreign, store, record, listener)
        write_credits(Dataset(out))


def _link_frames(foreign: ForeignDataset, store: Store, record: PlanRecord, listener: Listener | None) -> None:
    frames = foreign.frames()
    for row in record.rows:
        chunk = islice(frames, row.count)
        if store.has_shot(row.key):
            for _ in chunk:
                pass
        else:
            link_shot(store, row.key, chunk)
        if listener:
            listener(Progress("frames", row.first + row.count, record.frames))


def _plan_record(foreign: ForeignDataset) -> PlanRecord:
    made = version("viewsphere")
    recipe = {"name": foreign.name, **({"said": dict(foreign.said)} if foreign.said else {})}
    part = Part(
        digest=foreign.digest,
        version=made,
        name=foreign.name,
        recipe=recipe,
        channels=foreign.channels,
        first=0,
        frames=foreign.count,
        max_objects=foreign.max_objects,
        blocks=(Block((IMPORT,), ((0, foreign.count),)),),
        sampler=IMPORT,
        shot_frames=SHOT_FRAMES,
        new_poses=foreign.poses,
        pose_names=b64encode(bytes(NAME_BYTES * foreign.poses)).decode(),
    )
    return PlanRecord(
        version=made,
        digest=foreign.digest,
        name=foreign.name,
        recipe=recipe,
        categories=foreign.categories,
        splits=foreign.splits,
        channels=foreign.channels,
        models=tuple(model.info.key for model in foreign.models),
        poses=foreign.poses,
        frames=foreign.count,
        max_objects=foreign.max_objects,
        parts=(part,),
    )
