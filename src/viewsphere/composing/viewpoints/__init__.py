"""Poses of cameras, drawn, listed and read from files."""
