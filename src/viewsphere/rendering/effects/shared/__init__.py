"""Compiled loops of effects."""
