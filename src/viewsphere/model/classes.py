"""Classes of all that is seen, things and stuff: what semantic and panoptic maps tell apart.

Stuff is what is no object: sky, ground, scenery. Its classes have the ids 1 to 31, the same in all data sets: new ones are
added at the end. A thing's class is 31 more than its category's id. 0 is no class.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import MOST_COLORS, palette

Color = tuple[int, int, int]

FIRST_THING = 32
"""The class of the things of category 1."""

STUFF: dict[str, Color] = {
    "sky": (70, 130, 180),
    "ground": (111, 74, 60),
    "scenery": (130, 130, 130),
    "road": (128, 64, 128),
    "road marking": (240, 230, 240),
    "pavement": (244, 35, 232),
    "grass": (152, 251, 152),
    "vegetation": (107, 142, 35),
    "building": (70, 70, 70),
    "fence": (190, 153, 153),
    "pole": (153, 153, 153),
    "traffic sign": (220, 220, 0),
    "street furniture": (250, 170, 30),
    "vehicle": (0, 0, 142),
    "person": (220, 20, 60),
    "wall": (120, 120, 120),
    "floor": (80, 50, 50),
    "ceiling": (120, 120, 80),
    "door": (8, 255, 51),
    "window": (230, 230, 230),
    "furniture": (224, 5, 255),
    "household item": (255, 122, 8),
}
"""Names of stuff, in the order of their ids, and colours, sRGB: those of Cityscapes, else of ADE20K, where it has the class."""

STUFF_IDS = {name: i for i, name in enumerate(STUFF, 1)}
SKY, GROUND, SCENERY = (STUFF_IDS[name] for name in ("sky", "ground", "scenery"))

_MARKS = dict.fromkeys(("centre_line", "zebra"), "road marking")
_PAVED = dict.fromkeys(("kerb", "pavement"), "pavement")
_GREEN = dict.fromkeys(("lawn", "verge", "base"), "grass")
_STREET = {"": "road", "edge_line": "road marking", **_MARKS, **_PAVED, **_GREEN}
_TOWN = {
    "": "road",
    **dict.fromkeys(("stop_line", "parking"), "road marking"),
    "yard": "pavement",
    **_MARKS,
    **_PAVED,
    **_GREEN,
}
_DOOR = dict.fromkeys(("door", "door_frame", "door_handle"), "door")
_WINDOW = dict.fromkeys(("window_frame", "window_handle", "sill"), "window")
_FITTED = dict.fromkeys(("ceiling_lamp", "radiator", "curtain", "curtain_rod"), "furniture")
_VEHICLES = ("bicycle", "boat", "bus", "car", "motorcycle", "truck")
_STREET_FURNITURE = ("bench", "bollard", "fountain", "post box", "traffic cone", "wheelie bin")
_FURNITURE = ("bed", "cabinet", "chair", "lamp", "refrigerator", "plain table", "sofa", "table")
_HOUSEHOLD = (
    "backpack",
    "book",
    "bottle",
    "bowl",
    "box",
    "can",
    "hair drier",
    "laptop",
    "monitor",
    "mug",
    "open box",
    "plant",
    "plate",
)

Parts = dict[str, str]

STUFF_OF: dict[str, Parts] = {
    "street": {**_STREET, **dict.fromkeys(("gutter", "edging", "crossing"), "pavement")},
    "town ground": _TOWN,
    "landscape": {"": "grass", "road": "road", "thicket": "vegetation", "wood": "vegetation", "house": "building"},
    "outskirts": {"": "grass", "thicket": "vegetation", "wood": "vegetation", "house": "building"},
    "driveway": {"": "pavement"},
    "house": {"": "building"},
    "shop": {"": "building"},
    "tree": {"": "vegetation"},
    "hedge": {"": "vegetation"},
    "shrub": {"": "vegetation"},
    "fence": {"": "fence"},
    "lamp post": {"": "pole"},
    "road sign": {"": "traffic sign", "pole": "pole"},
    "traffic light": {"": "traffic sign", "base": "pole", "post": "pole"},
    **dict.fromkeys(_STREET_FURNITURE, Parts({"": "street furniture"})),
    **dict.fromkeys(_VEHICLES, Parts({"": "vehicle"})),
    "person": {"": "person"},
    "interior": {"": "wall", "floor": "floor", "ceiling": "ceiling", "outer_wall": "building", **_DOOR, **_WINDOW, **_FITTED},
    **dict.fromkeys(_FURNITURE, Parts({"": "furniture"})),
    "shelf": {"": "furniture", **dict.fromkeys(("book", "box", "vase"), "household item")},
    "television": {"": "household item", **dict.fromkeys(("console", "door", "drawer", "handle", "leg"), "furniture")},
    "rug": {"": "floor"},
    **dict.fromkeys(_HOUSEHOLD, Parts({"": "household item"})),
}
"""Stuff that the pieces of the zoo's places are, by their categories and names of parts; empty: all other parts."""


def stuff_of(category: str, part: str) -> int:
    """The class of a part of scenery of a category.

    Where the zoo does not say, names do: of a part, else of its category, without numbers at their end and what comes before a
    slash: Road.001 is road. Else it is scenery.
    """
    known = STUFF_OF.get(category.replace("_", " "))
    if known is not None:
        return STUFF_IDS[known.get(part, known[""])]
    names = (re.sub(r"[\W\d_]+$", "", name.rpartition("/")[-1]).lower().replace("_", " ") for name in (part, category))
    return next((STUFF_IDS[name] for name in names if name in STUFF_IDS), SCENERY)


def thing_class(category_id: int) -> int:
    """The class of things of a category."""
    return FIRST_THING - 1 + category_id


def class_colors(count: int = MOST_COLORS) -> NDArray[np.uint8]:
    """The colours (count, 3) of classes 0, 1, ...: a thing's is PASCAL VOC's of its category's id, or of that less 255s."""
    things = np.resize(palette()[1:], (max(count - FIRST_THING, 0), 3))
    stuff = np.zeros((FIRST_THING, 3), np.uint8)
    stuff[1 : 1 + len(STUFF)] = list(STUFF.values())
    return np.concatenate((stuff, things))[:count]


@dataclass(frozen=True)
class SemanticClass:
    """A class by its id; `color` is sRGB. `is_thing`: whether it is a category of objects."""

    id: int
    name: str
    is_thing: bool
    color: Color


def classes_of(categories: Iterable[tuple[int, str]]) -> tuple[SemanticClass, ...]:
    """Return the classes of a data set that has these categories (id, name), stuff first."""
    things = [(thing_class(i), name) for i, name in categories]
    colors: list[list[int]] = class_colors(max([FIRST_THING, *(i + 1 for i, _ in things)])).tolist()
    named = [(i, name, False) for name, i in STUFF_IDS.items()] + [(i, name, True) for i, name in things]
    return tuple(SemanticClass(i, name, is_thing, (r, g, b)) for i, name, is_thing in named for r, g, b in [colors[i]])
