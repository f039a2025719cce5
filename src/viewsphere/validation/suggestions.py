"""The valid name that a user most likely meant by an invalid one."""

from __future__ import annotations

import re
from collections.abc import Iterable

SYNONYMS = {
    "axes": ("up", "forward"),
    "bbox": ("box2d", "bbox"),
    "bboxes": ("box2d",),
    "bounding_box": ("box2d",),
    "box": ("box2d",),
    "boxes": ("box2d",),
    "blender": ("cycles", "blend"),
    "centimeter": ("cm",),
    "centimetre": ("cm",),
    "class": ("category", "semantic"),
    "class_id": ("category_id",),
    "color": ("rgb",),
    "colour": ("color", "rgb"),
    "depth_map": ("depth",),
    "false": ("off", "none", "transparent"),
    "feet": ("ft",),
    "focal_length": ("focal_mm", "focal_px"),
    "foot": ("ft",),
    "fov": ("fov_deg",),
    "gpu": ("cycles",),
    "hdf": ("hdf5",),
    "hfov": ("fov_deg",),
    "image": ("rgb",),
    "inch": ("in",),
    "instance": ("instances",),
    "instance_segmentation": ("instances",),
    "label": ("category",),
    "mask": ("instances",),
    "meter": ("m",),
    "metre": ("m",),
    "millimeter": ("mm",),
    "millimetre": ("mm",),
    "ms_coco": ("coco",),
    "normal_map": ("normals",),
    "num": ("count",),
    "no": ("off", "none", "false", "transparent"),
    "number": ("count",),
    "opengl": ("raster",),
    "optical_flow": ("flow",),
    "pascal": ("voc", "pascal3d"),
    "pascal_voc": ("voc",),
    "path": ("source", "path"),
    "resolution": ("size",),
    "segmentation": ("instances", "semantic"),
    "semantic_segmentation": ("semantic",),
    "true": ("on", "auto"),
    "ultralytics": ("yolo",),
    "yes": ("on", "true", "auto"),
}
"""Words that other tools use, and the names here, the likeliest first; only valid names are suggested."""

OPPOSITES = (
    ("min", "max"), ("upper", "lower"), ("inner", "outer"), ("left", "right"), ("front", "back"), ("on", "off"), ("in", "out"),
    ("+", "-"), ("near", "far"), ("before", "after"), ("forward", "backward"), ("first", "last"), ("up", "down"),
)  # fmt: skip
"""Words with opposite meanings that differ in few letters; they never suggest one another."""

CLOSE = ((4, 1), (9, 2), (99, 3))
"""Longest name for each number of allowed edits. With one edit more, `elephant` suggests `plant`, and `--size` `--seed`."""


def suggestion(name: object, known: Iterable[str]) -> str | None:
    """The valid name that was most likely meant; None if no name is close enough.

    In order: the same letters in another case, number or punctuation; a synonym; the name's beginning; few edits away. A
    version behind a name is ignored (`yolov8`).
    """
    text, names = str(name), tuple(known)
    same = [one for one in names if _letters(one) == _letters(text) and not _is_opposite(text.lower(), one.lower())]
    if same:
        return next((one for one in same if _signless(one) == _signless(text)), same[0])
    meant = next((one for one in SYNONYMS.get(_singular(text.lower()), ()) if one in names), None)
    return meant or _versioned(text, names) or _begun(text, names) or _closest(text, names)


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", _singular(name.lower()))


def _signless(name: str) -> str:
    return name.lower().lstrip("+")


def _singular(name: str) -> str:
    """The name without an English plural's ending."""
    if name.endswith("ies") and len(name) > 4:
        return f"{name[:-3]}y"
    return name[:-1] if name.endswith("s") and len(name) > 3 else name


def _versioned(name: str, names: Iterable[str]) -> str | None:
    bare = re.sub(r"[-_ ]?v?\d+[a-z]?$", "", name.lower())
    return next((candidate for candidate in names if bare != name.lower() and candidate.lower() == bare), None)


def _begun(name: str, names: Iterable[str]) -> str | None:
    """The shortest name that begins with this one, or contains it as a word; two letters are often ambiguous."""
    lower = name.lower()
    begun = [
        candidate
        for candidate in names
        if lower and (candidate.lower().startswith(lower) or lower in candidate.lower().split("_"))
    ]
    return min(begun, key=len, default=None) if len(lower) > 2 or len(begun) == 1 else None


def _closest(name: str, names: Iterable[str]) -> str | None:
    lower = name.lower()
    most = next((edits for length, edits in CLOSE if len(lower.lstrip("-")) <= length), 0)
    alike = (candidate for candidate in names if abs(len(candidate) - len(lower)) <= most)  # each letter more is an edit
    longer = [
        candidate for candidate in alike if len(lower) > 2 or len(candidate) > len(lower)
    ]  # of two letters, a changed one is half
    near = [(edits(lower, candidate.lower()), candidate) for candidate in longer if not _is_opposite(lower, candidate.lower())]
    least = min(near, key=lambda pair: pair[0], default=(most + 1, ""))
    return least[1] if least[0] <= min(most, len(least[1]) - 1) else None


def _is_opposite(name: str, other: str) -> bool:
    pairs = (*OPPOSITES, *(pair[::-1] for pair in OPPOSITES))
    return any(one in name and name.replace(one, two, 1) == other for one, two in pairs)


def edits(one: str, other: str) -> int:
    """The number of inserted, deleted, replaced or exchanged neighbouring letters between two words.

    Optimal string alignment: Damerau (1964), https://doi.org/10.1145/363958.363994.
    """
    rows = [list(range(len(other) + 1))]
    for i, a in enumerate(one, 1):
        row = [i]
        for j, b in enumerate(other, 1):
            least = min(rows[-1][j] + 1, row[-1] + 1, rows[-1][j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and one[i - 2] == b:
                least = min(least, rows[-2][j - 2] + 1)
            row.append(least)
        rows.append(row)
    return rows[-1][-1]
