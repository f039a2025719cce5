"""The correspondences between pictures: the place in one picture of each point that a pixel of another shows."""
