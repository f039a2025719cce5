"""Direct light of the sun and lamps, and occlusion: shadow maps, soft shadows, ambient occlusion."""
