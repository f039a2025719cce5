"""Colours, lines and small maps with which labels are drawn."""
