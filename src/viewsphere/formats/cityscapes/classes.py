"""Cityscapes' labels, and their assignment to the classes of a data set."""

from __future__ import annotations

from collections.abc import Mapping

from viewsphere.model.annotations.classes import SemanticClass

Color = tuple[int, int, int]

COLORS: Mapping[str, Color] = {
    "unlabeled": (0, 0, 0),
    "ego vehicle": (0, 0, 0),
    "rectification border": (0, 0, 0),
    "out of roi": (0, 0, 0),
    "static": (0, 0, 0),
    "dynamic": (111, 74, 0),
    "ground": (81, 0, 81),
    "road": (128, 64, 128),
    "sidewalk": (244, 35, 232),
    "parking": (250, 170, 160),
    "rail track": (230, 150, 140),
    "building": (70, 70, 70),
    "wall": (102, 102, 156),
    "fence": (190, 153, 153),
    "guard rail": (180, 165, 180),
    "bridge": (150, 100, 100),
    "tunnel": (150, 120, 90),
    "pole": (153, 153, 153),
    "polegroup": (153, 153, 153),
    "traffic light": (250, 170, 30),
    "traffic sign": (220, 220, 0),
    "vegetation": (107, 142, 35),
    "terrain": (152, 251, 152),
    "sky": (70, 130, 180),
    "person": (220, 20, 60),
    "rider": (255, 0, 0),
    "car": (0, 0, 142),
    "truck": (0, 0, 70),
    "bus": (0, 60, 100),
    "caravan": (0, 0, 90),
    "trailer": (0, 0, 110),
    "train": (0, 80, 100),
    "motorcycle": (0, 0, 230),
    "bicycle": (119, 11, 32),
}
"""Names and colours of the labels, in the order of their ids, from 0
(https://github.com/mcordts/cityscapesScripts/blob/master/cityscapesscripts/helpers/labels.py).
"""

LABELS = tuple(COLORS)
INSTANCES = range(LABELS.index("person"), len(LABELS))
"""Labels with separate instances."""

_ALSO = {
    "road": "road marking, lane, street",
    "sidewalk": "pavement, footpath",
    "terrain": "grass, lawn",
    "vegetation": "tree, hedge, shrub, bush, plant",
    "building": "house, door, window",
    "pole": "lamp post, street lamp",
    "traffic sign": "road sign",
    "static": "scenery, street furniture, bench, post box, wheelie bin, floor, ceiling, furniture, household item",
    "person": "pedestrian, human, man, woman, child",
    "rider": "cyclist, motorcyclist",
    "car": "vehicle, van, suv, jeep, taxi",
    "truck": "lorry, pickup",
    "train": "tram",
    "motorcycle": "motorbike, moped, scooter",
    "bicycle": "bike",
}
"""Other names of labels."""

_OTHERS = {other: name for name, others in _ALSO.items() for other in others.split(", ")}


def label_of(one: SemanticClass) -> int:
    """The id of a class's label, by its name; otherwise the id of `dynamic` for a thing, and of `static` for stuff."""
    name = " ".join(one.name.lower().replace("_", " ").replace("-", " ").split())
    name = _OTHERS.get(name, name)
    return LABELS.index(name if name in COLORS else "dynamic" if one.is_thing else "static")
