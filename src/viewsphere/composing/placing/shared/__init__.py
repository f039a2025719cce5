"""Code shared by several placers: rooms, footprints, spots."""
