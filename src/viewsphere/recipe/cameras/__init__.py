"""Recipe fields about cameras: viewpoints, trajectories, lenses, rigs and time."""
