"""The part of the data set to render, given a recipe and an output folder."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib.metadata import version
from typing import TYPE_CHECKING

from viewsphere.errors import RecipeError, StoreError, UserError
from viewsphere.labels import on_request
from viewsphere.model.channel import PASSES, missing
from viewsphere.model.sensors.rig import Sensor
from viewsphere.planning.checks.models import check_needs
from viewsphere.planning.engine_digest import engine_digest
from viewsphere.planning.extension import DatasetPart, extend, resumed, whole
from viewsphere.planning.fitting import LOOK
from viewsphere.planning.plan import Plan, check_engine, check_images, plan
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.exports.scope import is_computed, needs_of, not_held, scope_of_plan
from viewsphere.run.exports.writable import writable
from viewsphere.store import check_codecs
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.store import Part, PlanRecord, Store


def prepare(recipe: Recipe) -> Plan:
    """The recipe's plan, after all checks that need no model.

    Raises UserError for the user's mistakes: files, names, counts, engine options, background images.
    """
    planned = plan(recipe)
    check_engine(recipe)
    check_images(planned)
    check_codecs(recipe.channels, recipe.files)
    return planned


def check_formats(planned: Plan, wanted: Iterable[FormatEntry], channels: Sequence[str]) -> None:
    """Check that each format can be written, by the rule of `export`; labels that follow from the shots need not be recorded.

    Raises UserError for a format that is unknown, does not work here, or cannot hold the plan. Also raises it for a format that
    needs a missing channel that shots cannot provide: a painted pass, point tracks, a LiDAR's points, or neighbouring frames.
    """
    scope = scope_of_plan(planned, channels)
    with planned.recipe.located():
        for entry in wanted:
            spec = writable(entry.name)
            for problem in not_held(spec, entry, scope):
                raise UserError(f"formats: format {entry.name}: {problem}")
            for sensor in planned.rig.sensors:
                _check_labels(entry, spec, planned.recipe, channels, sensor)


def _check_labels(entry: FormatEntry, spec: FormatSpec, recipe: Recipe, channels: Sequence[str], sensor: Sensor) -> None:
    if sensor.lidar is not None and spec.lidar:
        return
    kept = sensor.kept_channels(tuple(channels))
    lacking = missing(sensor.intrinsics.lens.channels(needs_of(spec, entry)), {*kept, *recipe.annotations})
    absent = [name for name in lacking if not is_computed(name) or (sensor.lidar is not None and name in PASSES)]
    if absent:
        raise RecipeError(_absent(entry, absent[0], kept, recipe, sensor))
    for name in lacking:
        check_needs(recipe, f"formats: format {entry.name}", name)


def _absent(entry: FormatEntry, name: str, kept: Sequence[str], recipe: Recipe, sensor: Sensor) -> str:
    """The message about a label that a format needs and that the recipe has to record."""
    where, found = ("annotations", recipe.annotations) if name in on_request() else ("channels", kept)
    if where == "channels" and (sensor.channels or sensor.lidar):
        where = f"rig.sensors.{sensor.name}.channels"
    remedy = "" if sensor.lidar and name in PASSES else "add it, or "
    return (
        f"{where}: expected {name}, which format {entry.name} needs; found {', '.join(found) or 'none'}: "
        f"{remedy}leave {entry.name} out of formats"
    )


def to_render(planned: Plan, store: Store) -> DatasetPart:
    """The part of the data set that this plan began earlier, else the whole of a new data set. Nothing is written.

    Raises StoreError for a data set from another version, or from another state of the engine's program.
    """
    found = None
    with suppress(StoreError):  # the store decides whether it may replace another plan
        found = store.plan()
    number = found and found.part_with(planned.digest)
    if found is None or number is None:
        return whole(planned)
    if len(found.parts) == 1 and (found.version != version("viewsphere") or not _is_begun(store, found, number)):
        return whole(planned)  # the store refuses it, or replaces a plan without frames
    return _resumed(planned, store, found, number)


def to_append(planned: Plan, store: Store) -> DatasetPart:
    """Return the plan's additions to the data set, or their remainder if the part was begun. Nothing is written.

    Raises StoreError for a folder without a data set, for an unfinished data set, and for one from another version.
    Raises RecipeError for a recipe that does not fit.
    """
    found = store.plan()
    number = found.part_with(planned.digest)
    if number is not None:
        return _resumed(planned, store, found, number)
    _check_versions(store, found.parts)
    if found.frames and not found.parts:
        raise StoreError(f"{store.root}: expected a data set whose plan names its parts, found an older one: render it anew")
    left = tuple(store.gaps(found))
    if left:
        frames = sum(gap.frames for gap in left)
        raise StoreError(
            f"{store.root}: expected a finished data set to append to, found {quantity(frames, 'frame')} missing (first shot "
            f"{left[0].first.key}): first render the recipe that they are of to the end (the last was {found.name!r})"
        )
    return extend(planned, found)


def commit(portion: DatasetPart, store: Store) -> None:
    """Make the portion a part of the data set; raises StoreError if another run appended something else meanwhile."""
    parts = portion.record.parts
    with store.locked():
        there = store.plan().parts
        if there == parts:
            return
        if there != parts[:-1]:
            raise StoreError(f"{store.root}: another run appended a part meanwhile. Run this command again")
        store.save(portion.record)


def _resumed(planned: Plan, store: Store, found: PlanRecord, number: int) -> DatasetPart:
    _check_versions(store, found.parts)
    _check_look(planned, store, found, number)
    return resumed(planned, found, number)


def _check_look(planned: Plan, store: Store, found: PlanRecord, number: int) -> None:
    """Raise StoreError if a part's missing frames would be painted differently from its existing frames."""
    then, now = found.parts[number].settings.get(LOOK), engine_digest(planned.recipe.engine.name)
    if then in (None, now):
        return
    if _is_begun(store, found, number) and not _is_whole(store, found, number):
        raise _painted_otherwise(store, planned.recipe.engine.name)


def check_whether_same(store: Store, part: Part) -> None:
    """Raise StoreError if a part's frames would now be rendered differently: by another version, or painted differently."""
    _check_versions(store, (part,))
    engine = part.recipe.get("engine", {}).get("name")
    if engine and part.settings.get(LOOK) not in (None, engine_digest(engine)):
        raise _painted_otherwise(store, engine)


def _painted_otherwise(store: Store, engine: str) -> StoreError:
    return StoreError(
        f"{store.root}: expected pictures as the {engine} engine that is installed paints them, found another's: "
        "install the one that made them to go on, or choose another output folder"
    )


def _check_versions(store: Store, parts: Iterable[Part]) -> None:
    installed = version("viewsphere")
    for part in parts:
        if part.is_sampled and part.version != installed:
            raise StoreError(
                f"{store.root}: expected data made by viewsphere {installed}, found {part.version}: "
                "install that version to go on, or choose another output folder"
            )


def _is_begun(store: Store, found: PlanRecord, number: int) -> bool:
    """Return whether any shot of a part is finished; the time depends on the number of finished shots, not of planned ones."""
    return any(found.indices[number].find(key) for key in store.finished())


def _is_whole(store: Store, found: PlanRecord, number: int) -> bool:
    """Return whether all shots of a part are finished."""
    return all(store.has_shot(row.key) for row in found.indices[number])
