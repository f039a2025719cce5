"""The files of a model: its folder, its textures, the parts that a path names, and files with misleading names."""
