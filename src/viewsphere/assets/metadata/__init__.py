"""Facts of a mesh: its surface, symmetries and keypoints."""
