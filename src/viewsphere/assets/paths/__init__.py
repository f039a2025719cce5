"""Where a model's files lie: its folder, its textures, what a file name hides."""
