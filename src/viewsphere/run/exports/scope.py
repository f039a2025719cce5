"""The facts about a data set that a format needs to decide whether it can hold the data set."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from typing import TYPE_CHECKING

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.refusals import central, depth_lenses, global_shutter, lacking_labels
from viewsphere.labels import label_named, label_names
from viewsphere.model.channel import PASSES, missing, picture_of
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.planning.plan import Plan
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry

if TYPE_CHECKING:
    from viewsphere.store import Dataset
    from viewsphere.store.foreign import ForeignDataset

LOOKED_AT = 1000
"""Maximum number of pictures of a part that are examined for known facts: many data sets have no cameras at all."""


def scope_of_plan(planned: Plan, channels: Sequence[str]) -> Scope:
    """Return the known facts about a recipe's data set, whose frames keep these channels."""
    recipe = planned.recipe
    return Scope(
        categories=planned.categories,
        splits=planned.splits,
        rig=planned.rig,
        is_moving=recipe.time is not None,
        most_objects=planned.max_objects,
        channels=tuple(channels),
        annotations=recipe.annotations,
    )


def scope_of(dataset: Dataset) -> Scope:
    """Return the known facts about an existing data set; with its shots kept, all labels can be computed."""
    shots = dataset.shots_of_parts
    known = Scope(
        categories=dataset.categories,
        splits=dataset.splits,
        rig=None,
        is_moving=any(part.recipe.get("time") for part in dataset.plan.parts),
        most_objects=dataset.max_objects,
        channels=dataset.plan.channels,
        annotations=(),
    )
    if any(shots):
        known = replace(known, channels=tuple(dict.fromkeys((*known.channels, *label_names()))), annotations=label_names())
    rigs = tuple(dict.fromkeys(shot.rig for shot in shots if shot is not None))
    if rigs and all(shots):
        return replace(known, rig=rigs[0], later_rigs=rigs[1:])
    pictures = tuple(chain.from_iterable(map(_telling, dataset.samples_of_parts)))
    asked = dict.fromkeys(name for sample in pictures for name in sample.requested)
    return replace(known, annotations=tuple(dict.fromkeys((*known.annotations, *asked))), pictures=pictures)


def scope_of_foreign(foreign: ForeignDataset) -> Scope:
    """Return the known facts about a data set before its import."""
    pictures = _telling(frame.sample for frame in foreign.frames())
    return Scope(
        categories=foreign.categories,
        splits=foreign.splits,
        rig=None,
        is_moving=False,
        most_objects=foreign.max_objects,
        channels=foreign.channels,
        annotations=pictures[0].requested if pictures else (),
        pictures=pictures,
    )


def _telling(samples: Iterable[Sample]) -> tuple[Sample, ...]:
    """The first sample, and the first sample for each other combination of known facts: a camera and its lens, a viewpoint, an
    object's position. At most LOOKED_AT samples are examined.
    """
    kinds: dict[tuple[Intrinsics | None, bool, bool], Sample] = {}
    for sample in islice(samples, LOOKED_AT):
        is_placed = any(o.is_placed for o in sample.objects)
        lens = None if sample.known_camera is None else sample.known_camera.intrinsics
        kinds.setdefault((lens, sample.known_pose is not None, is_placed), sample)
    return tuple(kinds.values())


def needs_of(spec: FormatSpec, entry: FormatEntry) -> tuple[str, ...]:
    """The channels and the labels on request that a format reads with these options."""
    more = spec.needs(*entry.arguments()) if spec.needs is not None else ()
    return tuple(dict.fromkeys((*(spec.channels or ()), *more)))


def is_computed(name: str) -> bool:
    """Return whether a label follows from shots and models, so that formats need no recording of it.

    A painted pass does not, and neither do point tracks, a LiDAR's points and drawn looks.
    """
    label = label_named(name)
    return name not in PASSES and not any(need.IS_RECORDED for need in (label.needs if label else ()))


def refuse(entries: Sequence[FormatEntry], scope: Scope, where: object) -> None:
    """Raise UserError with a line for each format that cannot hold the data set at `where`, with all reasons."""
    found = {e.name: list(refusals(plugins.load(FormatSpec, e.name), e, scope)) for e in entries}
    lines = [f"{where}: format {name}: {', and '.join(problems)}" for name, problems in found.items() if problems]
    if lines:
        raise UserError("\n".join(lines))


def refusals(spec: FormatSpec, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Yield the reasons why a format with these options cannot hold a data set: those of the rig of each part, once each."""
    scopes = (replace(scope, rig=rig, later_rigs=()) for rig in (scope.rig, *scope.later_rigs))
    yield from dict.fromkeys(chain.from_iterable(_refusals_of_rig(spec, entry, one) for one in scopes))


def _refusals_of_rig(spec: FormatSpec, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    yield from not_held(spec, entry, scope)
    yield from lacking_labels(scope, spec.channels or ())
    if not spec.lidar:
        yield from _pointless(spec, entry, scope)


def not_held(spec: FormatSpec, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Yield the same reasons except for a LiDAR's frames, which a planned run checks by its sensors' channels."""
    yield from _too_deep(spec, entry, scope)
    if not spec.panoramas:
        yield from depth_lenses(scope)
    if not spec.parallel_rays:
        yield from central(scope)
    if not spec.rolling:
        yield from global_shutter(scope)
    if spec.refuses is not None:
        yield from spec.refuses(scope, *entry.arguments())


def _too_deep(spec: FormatSpec, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Yield the reason why a format cannot hold pictures of more than eight bits."""
    picture = picture_of(scope.channels)
    takes_pictures = spec.channels is None or "rgb" in needs_of(spec, entry)
    if takes_pictures and picture is not None and picture not in spec.pictures:
        yield (
            f"expected pictures of eight bits, as its readers read no others; found {picture}: add rgb to channels, beside "
            f"{picture}, or leave {entry.name} out of formats"
        )


def _pointless(spec: FormatSpec, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Yield the reason why a format of pictures cannot hold a LiDAR's frames, which are not pictures."""
    needed = [name for name in needs_of(spec, entry) if name in PASSES]
    for sensor in scope.rig.sensors if scope.rig else ():
        lacking = missing(needed, sensor.kept_channels(scope.channels))
        if sensor.lidar is not None and lacking:
            yield f"expected channel {lacking[0]} of every sensor; found none of the LiDAR {sensor.name}"
