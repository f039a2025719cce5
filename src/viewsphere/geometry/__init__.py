"""Pure functions on arrays: cameras, rotations, boxes, masks, picture files."""
