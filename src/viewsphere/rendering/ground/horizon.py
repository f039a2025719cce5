"""The end of the ground: haze covers it towards the horizon, in the same way in every engine."""

BEGIN, OVER = 30.0, 470.0
"""Distances beyond the centre of all placed objects, in halves of their extent: the start of the ground's fading into the sky,
and the further distance until it has faded completely.
"""

FLAT = 0.03
"""Sine of the angle between view and ground below which the ground fades at any distance, completely at the horizon."""
