"""Proof that no file of the store has changed since it was written, by sizes and digests in the manifests."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from viewsphere.errors import StoreError
from viewsphere.store import Dataset
from viewsphere.store.shots.checksums import AT_ONCE
from viewsphere.store.shots.manifest import Manifest


def damaged(dataset: Dataset) -> tuple[int, dict[Path, list[str]]]:
    """Return the number of files in the manifests of finished shots and models, and the errors of each damaged folder."""
    folders, damages = _folders(dataset), dict[Path, list[str]]()
    with ThreadPoolExecutor(AT_ONCE) as pool:
        counts = 0
        for folder, (count, messages) in zip(folders, pool.map(_damage, folders), strict=True):
            counts += count
            if messages:
                damages[folder] = messages
    return counts, damages


def _damage(folder: Path) -> tuple[int, list[str]]:
    """Return the number of files in a folder's manifest, and their errors."""
    try:
        manifest = Manifest.read(folder)
    except StoreError as error:
        return 0, [str(error)]
    return len(manifest.files), list(manifest.damage(folder))


def _folders(dataset: Dataset) -> list[Path]:
    """Return the folders of the finished models, of the simulations, and of the shots that the plan names."""
    store = dataset.store
    models = [store.model_folder(key) for key in dataset.plan.models]
    shots = [store.shot_folder(key) for key in store.finished() if dataset.plan.find(key) is not None]
    simulated = sorted((store.folder / "simulated").glob("*/*"))
    return [folder for folder in models if folder.is_dir()] + simulated + sorted(shots)
