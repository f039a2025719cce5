"""What materials are made of: noise, cells, strokes and courses, all of which tile, and how tones become colours."""
