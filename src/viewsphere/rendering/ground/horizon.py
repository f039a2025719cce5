"""The end of the ground: haze covers it towards the horizon, in every engine alike."""

BEGIN, OVER = 30.0, 470.0
"""Distances behind the middle of all placed things, in halves of their extent: where the ground begins to fade into the sky,
and how much farther it has faded altogether.
"""

FLAT = 0.03
"""Sine of the angle between view and ground below which the ground fades at any distance, altogether at the horizon."""
