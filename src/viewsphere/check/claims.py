"""Proof that the store contains no unclaimed files, and that left-out models and shots are missing."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from viewsphere.check.frames.sources import Sources
from viewsphere.errors import StoreError
from viewsphere.store import Dataset, Row
from viewsphere.store.samples.simulated import MADE
from viewsphere.store.shots.manifest import MANIFEST, SHARD, Manifest

OF_STORE = frozenset({"plan.json", "skipped.json", "lock", "models", "shots", "simulated", "writing", "failed"})
"""Names of the entries in a store's folder."""

OF_SHOT = frozenset({"frames.json", "shot.json", "scenery.json", MANIFEST, SHARD})
"""Names of a shot's files that do not belong to a channel."""

NUMBERED = re.compile(r"(\w+)/(\d{8,})\.\w+")
"""The path of a channel's file in its shot's folder, with the channel and the frame."""


def unclaimed(dataset: Dataset) -> Iterator[str]:
    """Files and folders of the store that the plan does not contain. The files of models are compared elsewhere."""
    store = dataset.store
    yield from _others(store.folder, lambda path: path.name in OF_STORE)
    yield from _others(store.folder / "models", lambda path: path.is_dir() and path.name in dataset.plan.models)
    for group in _children(store.folder / "shots"):
        yield from _of_shots(dataset, group)
    for entry in (store.folder / "simulated").glob("*/*"):
        yield from _others(entry, lambda path: path.name in {MADE, MANIFEST})


def _of_shots(dataset: Dataset, group: Path) -> Iterator[str]:
    """Folders that belong to no shot of the plan, and unclaimed files in the other folders."""
    if not group.is_dir():
        yield _no_such(group)
        return
    for folder in _children(group):
        row = dataset.plan.find(folder.name)
        if row is None or dataset.store.shot_folder(row.key) != folder:
            yield _no_such(folder)
        else:
            yield from _of_shot(dataset, row, folder)


def _of_shot(dataset: Dataset, row: Row, folder: Path) -> Iterator[str]:
    """Files of a shot that belong to no channel of its frames, and second files for one channel and frame."""
    try:
        paths = Manifest.read(folder).seals
        claimed = _claimed(dataset, row)
    except StoreError:
        return  # damage, which other proofs report
    held = set[tuple[str, int]]()
    for path in paths:
        match = NUMBERED.fullmatch(path)
        place = (match[1], int(match[2])) if match else None
        if path not in OF_SHOT and (place is None or place not in claimed or place in held):
            yield _no_such(folder / path)
        if place is not None:
            held.add(place)


def _claimed(dataset: Dataset, row: Row) -> set[tuple[str, int]]:
    """Channels and frames for which a shot has files; each sensor has its own channels."""
    part = dataset.plan.parts[row.part]
    shot = dataset.store.labelled(row.key) if part.recipe.get("rig") and not part.merged else None
    if shot is not None:
        return {(name, number) for number, _, sensor in shot.samples for name in shot.kept_channels(sensor)}
    return {(name, number) for name in dataset.plan.channels for number in range(row.first, row.first + row.count)}


def left_out(dataset: Dataset, sources: Sources, untried: list[str]) -> Iterator[str]:
    """Contradictions of skipped.json: names that the plan lacks, shots that exist, and models that can be made. Names whose
    reason cannot be tested again are added to `untried`.
    """
    plan, store, skipped = dataset.plan, dataset.store, dataset.store.skipped()
    finished = [row for key in store.finished() if (row := plan.find(key)) is not None] if skipped else []
    there = {name: row.key for row in finished for name in (row.key, row.subject)}
    for key, reason in skipped.items():
        is_subject = any(index.count_of(key) for index in plan.all_indices)
        if key not in plan.models and not is_subject and plan.find(key) is None:
            yield f"skipped.json: {key}: expected a model, scene or shot of the plan, found another name"
        elif key in there:
            yield f"skipped.json: {key}: expected none of its shots, because it was left out; found {there[key]}"
        elif key in plan.models and store.model_info(key) is None:
            yield from sources.excuse(key, reason)
        else:
            untried.append(key)


def _others(folder: Path, is_known: Callable[[Path], bool]) -> Iterator[str]:
    return (_no_such(path) for path in _children(folder) if not is_known(path))


def _children(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


def _no_such(path: Path) -> str:
    return f"{path}: expected no such file, because nothing in the data set names it: delete it"
