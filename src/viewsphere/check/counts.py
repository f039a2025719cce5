"""Proof that the plan's frames and models exist, and that the credits match the models."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.store import Dataset, PlanRecord
from viewsphere.store.credits import credits_problem


def missing(dataset: Dataset, notes: list[str]) -> Iterator[str]:
    """Frames and models of the plan that the store lacks; those left out on purpose become notes."""
    plan, store = dataset.plan, dataset.store
    skipped = store.skipped()
    notes += [f"{key} was left out: {reason}" for key, reason in skipped.items()]
    if sum(part.frames for part in plan.parts) != plan.frames:
        yield f"expected parts of {plan.frames} frames together, found {sum(part.frames for part in plan.parts)}"
    for number, (part, index) in enumerate(zip(plan.parts, plan.indices, strict=True), 1):
        if part.frames != index.samples:
            yield f"part {number}: expected {index.samples} frames, found a plan of {part.frames}"
    yield from _missing_shots(dataset)
    yield from (f"expected model {key}, found none: render again to go on" for key in lacking_models(dataset))
    for info in dataset.models:
        for file in (info.obj, info.glb):
            if not dataset.path(file).is_file():
                yield f"model {info.key}: expected {file}, found none"


def lacking_models(dataset: Dataset) -> list[str]:
    """Keys of the plan's models that are missing and were not left out on purpose."""
    skipped, folder = dataset.store.skipped(), dataset.store.model_folder
    return [key for key in dataset.plan.models if key not in skipped and not (folder(key) / "model.json").is_file()]


def credits(dataset: Dataset) -> Iterator[str]:
    """Problems of the file of credits, which is written when a run ends."""
    problem = credits_problem(dataset)
    if problem:
        yield f"{problem}: render again, or mend it with viewsphere check --repair"


def _missing_shots(dataset: Dataset) -> Iterator[str]:
    """The missing frames of each part, and the missing channels that a part adds to other parts' frames."""
    plan, store = dataset.plan, dataset.store
    for gap in store.gaps(plan):
        what = _factors(plan)
        if len(plan.parts) > 1:
            channels = dict.fromkeys(name for _, names in plan.parts[gap.part].supplies for name in names)
            what = f"{', '.join(channels)} of older frames, " if gap.is_added else ""
            what += f"part {gap.part + 1}, recipe {plan.parts[gap.part].name!r}"
        yield (
            f"expected {gap.of} frames ({what}), found {gap.of - gap.frames}: shot {gap.first.key} is the first of "
            f"{gap.shots} missing: render again to go on"
        )


def _factors(plan: PlanRecord) -> str:
    """The factors of a plan's number of frames, in words."""
    time = next((part.recipe["time"] for part in plan.parts if part.recipe.get("time")), None)
    if time is not None:
        instants = TimeEntry.model_validate(time).count
        films = sum(len(block.subjects) * block.size for part in plan.parts for block in part.blocks) // instants
        return f"{films} sequences x {instants} instants"
    scenes = {name for part in plan.parts if part.is_sampled and not part.is_product for name in part.subjects}
    return f"{len(scenes)} scenes x {plan.poses} poses" if scenes else f"{len(plan.models)} models x {plan.poses} poses"
