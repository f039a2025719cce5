"""Sensors: cameras, LiDARs, rigs and exposures."""
