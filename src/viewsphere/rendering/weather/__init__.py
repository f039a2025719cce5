"""Fog, rain, snow and puddles."""
