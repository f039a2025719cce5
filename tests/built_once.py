"""Models of the zoo, built once for all tests of a file: many stand on the same street, and are built again to be checked."""

from __future__ import annotations

from contextlib import contextmanager
from unittest.mock import patch

import viewsphere_zoo as zoo

QUICK = {"name": "raster", "bounces": "off", "ambient_occlusion": "off", "antialias": 1, "shadow_resolution": 64}
"""An engine for recipes whose light is no matter: what bounces, hollows and shadows are, each bakes for as long as it draws."""


@contextmanager
def built_once():
    """Within it, a family's builder is called once for each state of its random numbers. Nothing changes a mesh."""
    build, kept = zoo.build, {}

    def built(name, rng):
        key = name, str(rng.bit_generator.state)
        if key not in kept:
            kept[key] = build(name, rng)
        return kept[key]

    with patch.object(zoo, "build", built):
        yield
