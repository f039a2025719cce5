"""Engines: each paints pictures of a stage; labels never come from them."""
