"""Links files of one data set into another: by hard links where the file system supports them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from viewsphere.model.fields.files import Files
from viewsphere.store.foreign import ForeignFrame, Loaded
from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.manifest import MANIFEST
from viewsphere.store.shots.records import ModelInfo
from viewsphere.store.shots.sample_records import whole_sample
from viewsphere.store.shots.shot_files import ShotFiles
from viewsphere.urls import link_file


def link_model(
    store: Store,
    key: str,
    info: ModelInfo,
    files: Iterable[Path],
    write: Callable[[Path], None] | None = None,
    **changed: Any,
) -> None:
    """Write a model from these files and those that `write` puts into a folder, unless the key exists. They must include the
    files named in `info`. `changed` replaces fields of its metadata.
    """
    if store.model_info(key) is not None:
        return
    prefix = store.model_folder(key).relative_to(store.root).as_posix()
    with store.scratch_folder(store.model_folder(key)) as folder:
        for file in files:
            if file.name not in {"model.json", MANIFEST}:
                link_file(file.resolve(), folder / file.name)
        if write:
            write(folder)
        store.write_model_info(folder, info.moved(key, prefix, **changed))


def link_shot(
    store: Store, key: str, frames: Iterable[ForeignFrame], known: Iterable[Path] = (), kinds: Files | None = None
) -> int:
    """Write a shot whose channels are existing files; return the number of its frames.

    `known` are further files of the shot, as listed by `Store.known_of`; `kinds` determine whether its channels go into one
    file.
    """
    target = store.shot_folder(key)
    prefix = target.relative_to(store.root).as_posix()
    records: list[str] = []
    with store.scratch_folder(target) as folder, ShotFiles(folder, kinds or Files()) as put:
        for frame in frames:
            files: dict[str, str] = {}
            for name, source in frame.files.items():
                inside = f"{name}/{frame.sample.index:08d}{source.suffix.lower()}"
                if isinstance(source, Loaded):
                    put.add(inside, source.data)
                else:
                    put.link(inside, source)
                files[name] = f"{prefix}/{inside}"
            record = whole_sample(replace(frame.sample, files=files))
            records.append(json.dumps(record, separators=(",", ":"), allow_nan=False))
        (folder / "frames.json").write_text("[\n" + ",\n".join(records) + "\n]\n", "utf-8", newline="\n")
        for file in known:
            link_file(file.resolve(), folder / file.name)
    return len(records)
