"""Distant light: daylight, the sun, and pictures of the whole sphere."""
