"""The appearance of surfaces: colour words, physically based materials, coverage, repainting."""
