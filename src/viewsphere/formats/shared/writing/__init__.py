"""Exports: the form of most formats, their files and pictures, sequences, and the limits for which they refuse."""
