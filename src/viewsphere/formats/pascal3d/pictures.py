"""The facts about each picture in PASCAL3D+'s records, of the folders of all categories, and in its lists."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from viewsphere.formats.pascal3d.records import Record, Seen
from viewsphere.formats.shared.reading.image_lists import MISTAKES, TRAIN, VAL, lists, one_line
from viewsphere.formats.shared.reading.posed_pictures import picture_inside
from viewsphere.formats.shared.viewpoint_mat import KIT
from viewsphere.store.paths import file_inside, is_name

SUFFIXES = (".jpg", ".JPEG", ".jpeg", ".JPG", ".png")
FILES_KEPT = 64
"""Number of records to keep while going through pictures."""

Of = Callable[[Path], Record]


@dataclass(frozen=True)
class Told:
    """A picture's source (pascal, imagenet), name and split, and the categories whose folders contain it, each with its record
    there.
    """

    source: str
    name: str
    split: str
    kinds: tuple[str, ...]
    files: tuple[Path, ...]


def told_pictures(root: Path, record_of: Of, problems: list[str]) -> Iterator[Told]:
    """The pictures of all folders, each once, by source and name; the problems of lists, of records and of their objects are
    appended. A picture with an unreadable record is left out.
    """
    folders: defaultdict[tuple[str, str], dict[str, Path]] = defaultdict(dict)
    for file in sorted((root / "Annotations").glob("*/*.mat")):
        kind, _, source = file.parent.name.rpartition("_")
        if kind and source:
            folders[source, file.stem][kind] = file
    splits = _splits(root, {kind for files in folders.values() for kind in files}, problems)
    for (source, name), files in sorted(folders.items()):
        inside = [one for file in files.values() for one in _readable(root, file, record_of, problems)]
        if len(inside) == len(files):
            split = next((splits[kind, name] for kind in (*files, "") if (kind, name) in splits), TRAIN)
            yield Told(source, name, split, tuple(files), tuple(inside))


def _readable(root: Path, file: Path, record_of: Of, problems: list[str]) -> Iterator[Path]:
    """A record's file, if it can be read."""
    try:
        own = file_inside(root, file.relative_to(root).as_posix())
        problems += record_of(own).problems
        yield own
    except MISTAKES as error:
        problems.append(f"{file}: {one_line(error)}")


def _splits(root: Path, kinds: set[str], problems: list[str]) -> dict[tuple[str, str], str]:
    """The split of a picture by a category, or "" for lists of all categories, and its name."""
    found: dict[tuple[str, str], str] = {}
    for folder in (f"{KIT}/ImageSets/Main", "Image_sets"):
        named = list(lists(root, folder, problems))
        stems = {stem for stem, _, _ in named}
        for stem, _, rows in named:
            kind = max((kind for kind in kinds if stem.startswith(f"{kind}_")), key=len, default="")
            split = stem.removeprefix(f"{kind}_").removeprefix("imagenet_") if kind else stem
            if split == "trainval" and {stem.removesuffix(split) + own for own in (TRAIN, VAL)} <= stems:
                continue
            if is_name(split) and (kind or split in (TRAIN, VAL, "test", "trainval")):
                found |= {key: split for row in rows if (key := (kind, row.split()[0])) not in found}
    return found


def objects_of(told: Told, record_of: Of) -> list[Seen]:
    """The objects of a picture. Each comes from the record in its category's folder, or else from the first record. Their ids
    are kept if all have one; otherwise they count from 1.
    """
    found: list[Seen] = []
    for number, (kind, file) in enumerate(zip(told.kinds, told.files, strict=True)):
        others = set(told.kinds) - {kind}
        found += [o for o in record_of(file).objects if o.kind == kind or (number == 0 and o.kind not in others)]
    ids = [o.id for o in found]
    is_numbered = None not in ids and len(set(ids)) == len(ids)
    found.sort(key=lambda o: (o.id or 0) if is_numbered else o.place)
    return found if is_numbered else [replace(o, id=number) for number, o in enumerate(found, 1)]


def picture_of(root: Path, told: Told, record: Record) -> tuple[Path, tuple[int, int]] | None:
    """A picture in the first folder that contains it, with its width and height; None if it is missing. Raises ValueError if
    the record gives K and the picture's size does not fit it.
    """
    places = [f"Images/{kind}_{told.source}/{told.name}{end}" for kind in told.kinds for end in SUFFIXES]
    there = next((place for place in places if (root / place).is_file()), None)
    if there is None:
        return None
    file, size = picture_inside(root, there)
    if record.lens is not None and record.size is not None and record.size != size:
        said, found = (f"{width} x {height}" for width, height in (record.size, size))
        raise ValueError(f"expected a picture of {said} pixels, as imgsize beside K says; found {found}")
    return file, size
