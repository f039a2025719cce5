"""Models that move by themselves: clips, time steps, skins and deforming meshes."""
