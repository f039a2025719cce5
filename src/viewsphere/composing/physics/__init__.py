"""Rigid bodies that fall and come to rest, by MuJoCo (Todorov, Erez, Tassa 2012; version 3.3 or newer).

The settings were tuned by measurements: with MuJoCo's defaults, a pile of models creeps for ever. They are lengths and seconds,
so that every world is simulated with its typical body `TYPICAL` metres long, and scaled back: for free fall, this only changes
the clock. Frame: metres, +Z up, the floor at z = 0.
"""

from __future__ import annotations

from viewsphere.composing.physics._body import Board, Body, Touch, body_of, needed
from viewsphere.composing.physics._world import CALM_LOOKS, DAMPED_S, LONGEST_S, STEP_S, TYPICAL, World

EDITION = "physics 5"
"""Version of the simulation, raised when the same bodies come to rest elsewhere than before; distinguishes stored results."""

__all__ = [
    "CALM_LOOKS",
    "DAMPED_S",
    "EDITION",
    "LONGEST_S",
    "STEP_S",
    "TYPICAL",
    "Board",
    "Body",
    "Touch",
    "World",
    "body_of",
    "needed",
]
