"""A data set of any number of frames in seconds: the records of a small one again and again, and one picture a shot."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

from viewsphere.store import Dataset
from viewsphere.store.index import Block
from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.manifest import Manifest, digest
from viewsphere.store.shots.sample_records import whole_sample

FRAMES = 273_600
"""Those of the paper's largest data set."""

EACH = 60
"""Frames of a shot."""


def large_dataset(small: Path, root: Path, frames: int = FRAMES) -> Path:
    """A data set of so many frames, those of the small one in turn, in a new folder."""
    samples = list(Dataset(small))
    picture = Dataset(small).path(samples[0].files["rgb"])
    sealed = picture.stat().st_size, digest(picture.read_bytes())
    records = [json.dumps({**_rounded(whole_sample(sample)), "files": None}, separators=(",", ":"))[:-1] for sample in samples]
    tails = [record.partition(",")[2].removesuffix('"files":null') for record in records]
    store = Store(root)
    shutil.copytree(Store(small).folder / "models", store.folder / "models")
    (store.folder / "writing").mkdir()
    plan = Store(small).plan()
    part = replace(plan.parts[0], blocks=(Block(plan.models[:1], ((0, frames),)),), frames=frames, shot_frames=EACH)
    store.save(replace(plan, frames=frames, poses=frames, parts=(part,)))
    for row in store.plan().rows:
        folder = store.shot_folder(row.key)
        (folder / "rgb").mkdir(parents=True)
        (folder / "rgb" / "00000000.png").hardlink_to(picture)
        files = json.dumps({"rgb": f"{folder.relative_to(root).as_posix()}/rgb/00000000.png"})
        numbers = range(row.first, row.first + row.count)
        lines = (f'{{"index": {i}, {tails[i % len(tails)]}"files": {files}}}' for i in numbers)
        text = ("[\n" + ",\n".join(lines) + "\n]\n").encode()
        (folder / "frames.json").write_bytes(text)
        seals = {"frames.json": (len(text), digest(text)), "rgb/00000000.png": sealed}
        Manifest(seals).write(folder)
    return root


def _rounded(value):
    """A third of the bytes of numbers."""
    return json.loads(json.dumps(value), parse_float=lambda text: round(float(text), 3))
