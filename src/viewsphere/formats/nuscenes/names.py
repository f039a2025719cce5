"""nuScenes' names of records, categories and sensors."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from hashlib import blake2b

from viewsphere.model.sensors.rig import CAMERA, Rig

CATEGORIES = {
    "animal": "animal",
    "barrier": "movable_object.barrier",
    "bicycle": "vehicle.bicycle",
    "bus": "vehicle.bus.rigid",
    "car": "vehicle.car",
    "motorcycle": "vehicle.motorcycle",
    "pedestrian": "human.pedestrian.adult",
    "person": "human.pedestrian.adult",
    "traffic_cone": "movable_object.trafficcone",
    "trailer": "vehicle.trailer",
    "truck": "vehicle.truck",
}
"""nuScenes' names for categories that other data sets name in one word."""


def token(*names: object) -> str:
    """The token of a record, derived from its subject: 32 hexadecimal digits."""
    return blake2b("\n".join(map(str, names)).encode(), digest_size=16).hexdigest()


LOG, MAP = token("log"), token("map")
"""The only records of these tables."""


def category_of(name: str) -> str:
    """nuScenes' name of a category, or the category's own name."""
    return CATEGORIES.get(name.casefold(), name)


def channels_of(rig: Rig) -> tuple[str, ...]:
    """The channels of a rig's sensors, in the rig's order."""
    lidars = sum(sensor.lidar is not None for sensor in rig.sensors)
    found: list[str] = []
    for sensor in rig.sensors:
        name = re.sub(r"[^A-Z0-9]", "_", sensor.name.upper())
        if sensor.lidar is not None:
            found.append("LIDAR_TOP" if lidars == 1 else f"LIDAR_{name}")
        else:
            found.append("CAM_FRONT" if sensor.name == CAMERA else f"CAM_{name}")
    return tuple(found)


def modalities(rig: Rig) -> tuple[str, ...]:
    """Return the modality of each sensor, in the rig's order: `camera` or `lidar`."""
    return tuple("camera" if sensor.lidar is None else "lidar" for sensor in rig.sensors)


def alike(what: str, named: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield an error for names that are equal in nuScenes, from pairs of a name and its name there."""
    counts = Counter(own for _, own in named)
    for name in (name for name, count in counts.items() if count > 1):
        found = ", ".join(other for other, own in named if own == name)
        yield f"expected {what} of different names in nuScenes; found {found}, all {name}"
