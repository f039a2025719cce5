"""What interiors are built from: plans of rooms, walls with their openings, coverings, and how people furnish rooms."""
