"""The elements of materials: noise, cells, strokes and courses, all of which tile, and the colours of tones."""
