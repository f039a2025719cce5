"""The files `annotations/instances_<split>.json`, and `captions_<split>.json` beside them, written frame by frame."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from viewsphere.formats.coco.categories import category_ids
from viewsphere.formats.coco.entries import CAPTIONS, Entry
from viewsphere.formats.coco.options import Options
from viewsphere.formats.coco.points import category_points, has_label, point_names
from viewsphere.formats.coco.said import Licences, imported_categories, imported_info, imported_info_of_parts
from viewsphere.formats.shared.paper import json_bytes, vehicles
from viewsphere.store.credits import credited

if TYPE_CHECKING:
    from viewsphere.store import Dataset


def file_name(split: str, kind: str = "instances") -> str:
    """File name of a split's instances, or of its captions."""
    return f"{kind}_{split}.json"


def file_names(dataset: Dataset) -> list[str]:
    """The names of all files: captions where some of the data set's pictures have them."""
    return [file_name(split, kind) for split in dataset.splits for kind in ("instances", *_captions(dataset))]


def _captions(dataset: Dataset) -> tuple[str, ...]:
    """The kind of the files of captions, none where no picture has any."""
    return (CAPTIONS,) if has_label(dataset, CAPTIONS) else ()


@contextmanager
def instances(dataset: Dataset, folder: Path, options: Options) -> Generator[Callable[[Entry], None]]:
    """Write the files of all splits into this folder: gives a function that appends a frame to its split's file."""
    folder.mkdir(exist_ok=True)
    ids = category_ids(dataset, options)
    head = _head(dataset, ids)
    kinds = {"instances": head, **{kind: {key: head[key] for key in ("info", "licenses")} for kind in _captions(dataset)}}
    with ExitStack() as stack:
        files: dict[tuple[str, str], Callable[[bytes, Iterable[bytes]], None]] = {}
        for split in dataset.splits:
            info = imported_info(dataset, split) or head["info"]
            for kind, own in kinds.items():
                start = json_bytes({**own, "info": info})[:-1]
                files[split, kind] = stack.enter_context(_written(folder / file_name(split, kind), start))

        def add(entry: Entry) -> None:
            files[entry.split, "instances"](entry.image, entry.annotations)
            if (entry.split, CAPTIONS) in files:
                files[entry.split, CAPTIONS](entry.image, entry.captions)

        yield add


@contextmanager
def _written(file: Path, head: bytes) -> Generator[Callable[[bytes, Iterable[bytes]], None]]:
    """Write one file: annotations wait in a temporary file until the images, which come first, are complete."""
    with file.open("wb") as images, TemporaryFile(dir=file.parent) as waiting:
        images.write(head + b',"images":[')
        separators = {images: b"\n", waiting: b"\n"}

        def append(image: bytes, annotations: Iterable[bytes]) -> None:
            for part, values in ((images, [image]), (waiting, annotations)):
                for value in values:
                    part.write(separators[part] + value)
                    separators[part] = b",\n"

        yield append
        images.write(b'\n],"annotations":[')
        waiting.seek(0)
        shutil.copyfileobj(waiting, images)
        images.write(b"\n]}\n")


def _head(dataset: Dataset, ids: Mapping[int, int]) -> dict[str, Any]:
    info = {"description": dataset.name, "version": "1.0", "contributor": f"viewsphere {dataset.plan.version}"}
    licenses, credits = _terms(dataset)
    names, sources, imported = point_names(dataset), imported_info_of_parts(dataset), imported_categories(dataset)
    return {
        "info": {**info, **({"sources": sources} if sources else {}), **({"credits": credits} if credits else {})},
        "licenses": licenses,
        "categories": [
            {
                **{"id": ids[c.id], "name": c.name, "supercategory": c.supercategory},
                **category_points(dataset, c, names, imported.get(c.name.casefold(), {})),
            }
            for c in dataset.categories
        ],
        "models": vehicles(dataset.models),
    }


def _terms(dataset: Dataset) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The list of licences, imported ones first; and whose the models are, each with its licence's id."""
    groups = {credit: keys for credit, keys in credited(dataset.models).items() if credit}
    licences, credits = Licences(dataset), list[dict[str, Any]]()
    for credit, keys in groups.items():
        name = credit.licence
        number = {"license": licences.add({"name": name, "url": name if name.startswith("http") else ""})} if name else {}
        credits.append({"models": keys, **credit.model_dump(exclude_none=True), **number})
    return licences.listed, credits
