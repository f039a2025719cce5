"""The frozen names that seed the draws of a recipe's fields.

The draw of a field is seeded by the names on its path, for example `sun` and `azimuth_deg`. These names are constants: you
may rename a field, a class or a module, but its draws, and so its pictures, do not change. To rename a field, move its name
from `_UNCHANGED` to `_RENAMED`, with the old name on the right.
"""

from __future__ import annotations

_UNCHANGED = """
    amount angle_deg aside at background bay begin below blend blur clouds color company count date daylight density
    diagonal distance distractors drop effects enter exposure fit flip focal_mm focal_px fog fov_deg friction glow ground hdri
    height high highest_hz horizon image jitter kerb keys kind lamps lane latitude leave length lights longest longitude mass
    material materials metallic moon most motion night normal_image objects off_center offset parked pattern pavement
    period phase_deg place planes points position principal_point puddles radius rain rate reach restitution
    rotation_deg roughness roughness_image scale side size sky smoother snow speed spin_deg spread strength sun target
    temperature_k texture tile time tint toward transform turbidity turn velocity view visibility walkers wet wind
    width windows zenith zoom
"""
"""Fields whose names equal their seed names."""

_RENAMED = {"azimuth": "azimuth_deg", "elevation": "elevation_deg", "tilt": "tilt_deg"}
"""Fields whose names differ from their seed names."""

SEED_NAMES = {**{name: name for name in _UNCHANGED.split()}, **_RENAMED}


def seed_name(field: str) -> str:
    """The name that seeds the draws of a field. A plug-in's field without a name here is seeded by its own name."""
    return SEED_NAMES.get(field, field)
