"""Virtual KITTI's names and colours of classes and objects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import palette
from viewsphere.model.annotations.classes import STUFF_IDS, Color, SemanticClass

COLORS: dict[str, Color] = {
    "Terrain": (210, 0, 200),
    "Sky": (90, 200, 255),
    "Tree": (0, 199, 0),
    "Vegetation": (90, 240, 0),
    "Building": (140, 140, 140),
    "Road": (100, 60, 100),
    "GuardRail": (250, 100, 255),
    "TrafficSign": (255, 255, 0),
    "TrafficLight": (200, 200, 0),
    "Pole": (255, 130, 0),
    "Misc": (80, 80, 80),
    "Truck": (160, 60, 60),
    "Car": (255, 127, 80),
    "Van": (0, 139, 139),
    "Undefined": (0, 0, 0),
}
"""The classes of Virtual KITTI 2."""

STUFF = {
    "sky": "Sky",
    "ground": "Terrain",
    "grass": "Terrain",
    "pavement": "Terrain",
    "road": "Road",
    "road marking": "Road",
    "vegetation": "Vegetation",
    "building": "Building",
    "pole": "Pole",
    "traffic sign": "TrafficSign",
    "vehicle": "Car",
    **dict.fromkeys(("wall", "door", "window"), "Building"),
}
"""Virtual KITTI's names of stuff; all other stuff is Misc."""

THINGS = {name.casefold(): name for name in ("Car", "Van", "Truck")}


@dataclass(frozen=True, eq=False)
class Names:
    """The classes of a data set: the class names of its things by category name, all colours by class name, and all colours by
    class number, (N, 3).
    """

    things: dict[str, str]
    colors: dict[str, Color]
    by_class: NDArray[np.uint8]

    @classmethod
    def from_classes(cls, classes: Iterable[SemanticClass]) -> Names:
        """The names and colours of all of a data set's classes; a category that Virtual KITTI lacks keeps its colour."""
        things, colors, numbered = dict[str, str](), dict(COLORS), {0: COLORS["Undefined"]}
        stuff = {i: COLORS[STUFF.get(name, "Misc")] for name, i in STUFF_IDS.items()}
        for one in classes:
            if one.is_thing:
                name = THINGS.get(one.name.casefold(), one.name)
                things[one.name] = name
                numbered[one.id] = colors.setdefault(name, one.color)
            else:
                numbered[one.id] = stuff[one.id]
        table = np.zeros((max(numbered) + 1, 3), np.uint8)
        table[list(numbered)] = list(numbered.values())
        return cls(things, colors, table)

    def table(self, head: str, *, things: bool = False) -> bytes:
        """A text of all classes' colours, with or without the colours of things."""
        named = set(self.things.values())
        rows = (f"{name} {r} {g} {b}" for name, (r, g, b) in self.colors.items() if things or name not in named)
        return "".join(f"{row}\n" for row in (head, *rows)).encode()


def object_colors() -> NDArray[np.uint8]:
    """Colours (256, 3) of objects by their ids, distinct from all class colours; black for 0."""
    colors = palette() | np.uint8(1)
    colors[0] = 0
    return colors
