"""The parts of bicycles. While building, the frame's plane is x = 0, the bottom bracket at y = 0, the ground at z = 0."""
