"""What a format has to know of a data set before it can say that it holds it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from viewsphere.errors import UserError
from viewsphere.formats import Format, Scope
from viewsphere.labels import channel_labels, on_request
from viewsphere.model.channel import PASSES, missing
from viewsphere.recipe.formats import FormatEntry
from viewsphere.sampling.plan import Plan
from viewsphere.store import Dataset


def scope_of_plan(planned: Plan, channels: Sequence[str]) -> Scope:
    """What is known of a recipe's data set, of which frames keep these channels."""
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
    """What is known of a data set that is there; of one whose shots are kept all labels can be computed."""
    key = next((row.key for row in dataset.rows), None)
    shot = dataset.labelled(key) if key else None
    parts = dataset.plan.parts
    asked = dict.fromkeys(name for part in parts for name in part.recipe.get("annotations", ()))
    return Scope(
        categories=dataset.categories,
        splits=dataset.splits,
        rig=shot and shot.rig,
        is_moving=any(part.recipe.get("time") for part in parts),
        most_objects=dataset.max_objects,
        channels=dataset.plan.channels if shot is None else tuple(dict.fromkeys((*dataset.plan.channels, *channel_labels()))),
        annotations=tuple(asked if shot is None else on_request()),
    )


def needs_of(module: Format, entry: FormatEntry) -> tuple[str, ...]:
    """The channels and the labels on request that a format reads as these options want it."""
    more: Callable[..., Sequence[str]] | None = getattr(module, "needs", None)
    always: Sequence[str] = getattr(module, "CHANNELS", ())
    return tuple(dict.fromkeys((*always, *(more(*entry.arguments()) if more else ()))))


def refusals(module: Format, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """What of a data set a format cannot hold, as these options want it."""
    refuses: Callable[..., Iterator[str]] | None = getattr(module, "refuses", None)
    if refuses:
        yield from refuses(scope, *entry.arguments())
    if not getattr(module, "LIDAR", False):
        yield from _pointless(module, entry, scope)


def _pointless(module: Format, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Of a format of pictures: a LiDAR, whose frames are none."""
    needed = [name for name in needs_of(module, entry) if name in PASSES]
    for sensor in scope.rig.sensors if scope.rig else ():
        lacking = missing(needed, sensor.kept(scope.channels))
        if sensor.lidar is not None and lacking:
            yield f"expected channel {lacking[0]} of every sensor; found none of the LiDAR {sensor.name}"


def check_held(module: Format, entry: FormatEntry, scope: Scope, where: str) -> None:
    """Raise UserError for the first thing of a data set that a format cannot hold."""
    for problem in refusals(module, entry, scope):
        raise UserError(f"{where}: format {entry.name}: {problem}")
