"""Procedural materials: wood, brick, leather, ..., as repeating squares, in metres.

A material is one module with a `viewsphere.plugins.material.MaterialSpec`, which draws a `Surface` from frozen parameters.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from viewsphere import plugins
from viewsphere.materials.shared.surface import Color, Light, Map, Surface
from viewsphere.plugins.material import MaterialSpec

__all__ = ["Color", "Light", "Map", "Surface", "drawn", "is_grained", "metres", "surface", "word"]


def drawn(name: str, seed: int) -> Any:
    """The parameters for a seed; raises UserError for an unknown material, with the nearest known one."""
    return plugins.load(MaterialSpec, name).draw(np.random.default_rng(seed))


def surface(name: str, seed: int, size: int) -> Surface:
    """The material for a seed, `size` texels a side; equal arguments give the same bytes on every processor.

    Raises UserError for an unknown name, with the nearest known one.
    """
    return plugins.load(MaterialSpec, name).surface(drawn(name, seed), size)


def metres(name: str, seed: int) -> float:
    """The distance in metres after which the material for a seed repeats."""
    return drawn(name, seed).metres


def word(name: str) -> str:
    """Return the adjective for things made of a material, for use in sentences: wooden."""
    return plugins.load(MaterialSpec, name).word


def is_grained(name: str) -> bool:
    """Return whether a material's grain runs along the longest side of a thing."""
    return plugins.load(MaterialSpec, name).grained
