"""What a format has to know of a data set before it can say that it holds it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

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
    shots, parts = dataset.shots_of_parts, dataset.plan.parts
    is_known = bool(shots) and all(shots)
    asked = [set(part.recipe.get("annotations", ())) for part in parts]
    kept, annotations = dataset.plan.channels, tuple(sorted(set.intersection(*asked))) if asked else ()
    return Scope(
        categories=dataset.categories,
        splits=dataset.splits,
        rig=shots[0].rig if is_known and shots[0] else None,
        is_moving=any(part.recipe.get("time") for part in parts),
        most_objects=dataset.max_objects,
        channels=tuple(dict.fromkeys((*kept, *channel_labels()))) if is_known else kept,
        annotations=tuple(on_request()) if is_known else annotations,
    )


def needs_of(module: Format, entry: FormatEntry) -> tuple[str, ...]:
    """The channels and the labels on request that a format reads as these options want it."""
    more: Callable[..., Sequence[str]] | None = getattr(module, "needs", None)
    always: Sequence[str] = getattr(module, "CHANNELS", ())
    return tuple(dict.fromkeys((*always, *(more(*entry.arguments()) if more else ()))))


def refusals(module: Format, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """What of a data set a format cannot hold, as these options want it."""
    yield from not_held(module, entry, scope)
    if not getattr(module, "LIDAR", False):
        yield from _pointless(module, entry, scope)


def not_held(module: Format, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """The same but for a LiDAR's frames, which a run that is planned tells by its sensors' channels."""
    refuses: Callable[..., Iterator[str]] | None = getattr(module, "refuses", None)
    if refuses:
        yield from refuses(scope, *entry.arguments())


def _pointless(module: Format, entry: FormatEntry, scope: Scope) -> Iterator[str]:
    """Of a format of pictures: a LiDAR, whose frames are none."""
    needed = [name for name in needs_of(module, entry) if name in PASSES]
    for sensor in scope.rig.sensors if scope.rig else ():
        lacking = missing(needed, sensor.kept(scope.channels))
        if sensor.lidar is not None and lacking:
            yield f"expected channel {lacking[0]} of every sensor; found none of the LiDAR {sensor.name}"
