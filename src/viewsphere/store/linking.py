"""Puts files of one data set into another: by hard links where the file system has them."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from viewsphere.labels import channels
from viewsphere.store.folder import Store
from viewsphere.store.foreign import ForeignFrame
from viewsphere.store.manifest import MANIFEST
from viewsphere.store.places import RemotePath, download
from viewsphere.store.records import ModelInfo
from viewsphere.store.sample_records import whole_sample


def link_file(source: Path, destination: Path) -> str:
    """Put a file at `destination` on a disk, which must not exist: as a `hard link`, else a `reflink`, else a `copy`; returns
    which. What lies at a URL is a `download`.
    """
    if isinstance(source, RemotePath):
        download(source, destination)
        return "download"
    with suppress(OSError):
        os.link(source, destination)
        return "hard link"
    try:
        import fcntl

        with source.open("rb") as read, destination.open("wb") as write:
            fcntl.ioctl(write.fileno(), 0x40049409, read.fileno())  # FICLONE of linux/fs.h
        return "reflink"
    except (ImportError, OSError):
        shutil.copyfile(source, destination)
        return "copy"


def link_model(store: Store, key: str, info: ModelInfo, files: Iterable[Path], **changed: Any) -> None:
    """Write a model of these files, those that `info` names among them, unless there is one of this key. `changed` are fields
    of it that become others.
    """
    if store.model_info(key) is not None:
        return
    prefix = store.model_folder(key).relative_to(store.root).as_posix()
    with store.aside(store.model_folder(key)) as folder:
        for file in files:
            if file.name not in {"model.json", MANIFEST}:
                link_file(file.resolve(), folder / file.name)
        store.write_model_info(folder, info.moved(key, prefix, **changed))


def link_shot(store: Store, key: str, frames: Iterable[ForeignFrame], known: Iterable[Path] = ()) -> int:
    """Write a shot whose channels are files that exist already; gives the number of its frames.

    `known` are further files of the shot, as listed by `Store.known_of`.
    """
    target = store.shot_folder(key)
    prefix = target.relative_to(store.root).as_posix()
    records: list[str] = []
    with store.aside(target) as folder:
        for frame in frames:
            files: dict[str, str] = {}
            for name, source in frame.files.items():
                suffix = channels()[name].suffix if isinstance(source, bytes) else source.suffix.lower()
                inside = f"{name}/{frame.sample.index:08d}{suffix}"
                (folder / name).mkdir(exist_ok=True)
                if isinstance(source, bytes):
                    (folder / inside).write_bytes(source)
                else:
                    link_file(source.resolve(), folder / inside)
                files[name] = f"{prefix}/{inside}"
            record = whole_sample(replace(frame.sample, files=files))
            records.append(json.dumps(record, separators=(",", ":"), allow_nan=False))
        (folder / "frames.json").write_text("[\n" + ",\n".join(records) + "\n]\n", "utf-8", newline="\n")
        for file in known:
            link_file(file.resolve(), folder / file.name)
    return len(records)
