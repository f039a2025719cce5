"""The common parts of interiors: plans of rooms, walls with their openings, coverings, and the furnishing of rooms."""
