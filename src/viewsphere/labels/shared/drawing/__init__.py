"""Colours, lines and small maps for the drawings of labels."""
