"""The scene that Blender shows, built from plain data: meshes, materials, lights; and scenes saved for people."""
