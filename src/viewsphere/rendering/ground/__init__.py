"""The ground: its material, its slabs, where it fades into the sky."""
