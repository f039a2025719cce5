"""What surfaces look like: colour words, physically based materials, coverage, repainting."""
