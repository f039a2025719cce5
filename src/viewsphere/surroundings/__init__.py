"""The surroundings of the targets, for every engine: the sky, the sun as it arrives, the ground's material."""
