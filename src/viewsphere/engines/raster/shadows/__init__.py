"""Light of the sun and lamps that arrives, and occlusion: shadow maps, soft shadows, ambient occlusion."""
