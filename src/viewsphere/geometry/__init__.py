"""Pure functions on arrays: cameras, rotations, boxes, masks."""
