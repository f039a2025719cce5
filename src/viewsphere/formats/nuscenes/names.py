"""nuScenes' names of records, categories and sensors."""

from __future__ import annotations

from hashlib import blake2b

from viewsphere.model.sensors.rig import Rig

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


def modalities(rig: Rig) -> tuple[str, ...]:
    """Return the modality of each sensor, in the rig's order: `camera` or `lidar`."""
    return tuple("camera" if sensor.lidar is None else "lidar" for sensor in rig.sensors)
