"""Samples along edges and finer pictures."""
