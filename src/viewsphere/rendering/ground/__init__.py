"""The ground: its material, its slabs, and its fading into the sky."""
