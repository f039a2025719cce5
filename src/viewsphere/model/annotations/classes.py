"""The classes of semantic and panoptic maps: things and stuff.

Stuff is everything but objects: sky, ground, scenery. Stuff classes have the ids 1 to 31, the same in all data sets: new ones
are added at the end. A thing's class is 31 more than its category's id. 0 is no class.
"""

from __future__ import annotations

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
"""Names of stuff, in the order of their ids, and sRGB colours: from Cityscapes if it has the class, else from ADE20K."""

STUFF_IDS = {name: i for i, name in enumerate(STUFF, 1)}
SKY, GROUND, SCENERY = (STUFF_IDS[name] for name in ("sky", "ground", "scenery"))


def thing_class(category_id: int) -> int:
    """The class of things of a category."""
    return FIRST_THING - 1 + category_id


def class_colors(count: int = MOST_COLORS) -> NDArray[np.uint8]:
    """The colours (count, 3) of classes 0, 1, .... A thing has PASCAL VOC's colour of its category's id, minus multiples of
    255.
    """
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
