"""What several placers need: rooms, footprints, spots."""
