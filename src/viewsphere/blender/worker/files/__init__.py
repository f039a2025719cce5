"""Files that Blender opens: their contents, animation, cameras, and meshes as arrays."""
