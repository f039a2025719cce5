"""Proof that no file of the store was changed since it was written: sizes and digests against the manifests."""

from __future__ import annotations

from pathlib import Path

from viewsphere.errors import StoreError
from viewsphere.store import Dataset
from viewsphere.store.manifest import Manifest


def damaged(dataset: Dataset) -> tuple[int, dict[Path, list[str]]]:
    """How many files stand in the manifests of finished shots and models; and of each folder with damage what is wrong."""
    count, found = 0, dict[Path, list[str]]()
    for folder in _folders(dataset):
        try:
            manifest = Manifest.read(folder)
        except StoreError as error:
            found[folder] = [str(error)]
            continue
        count += len(manifest.files)
        messages = list(manifest.damage(folder))
        if messages:
            found[folder] = messages
    return count, found


def _folders(dataset: Dataset) -> list[Path]:
    """Those of the finished models, and of the shots that the plan knows."""
    store = dataset.store
    models = [store.model_folder(key) for key in dataset.plan.models]
    shots = [store.shot_folder(key) for key in store.finished() if dataset.plan.find(key) is not None]
    return [folder for folder in models if folder.is_dir()] + sorted(shots)
