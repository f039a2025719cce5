"""The files of a model: its folder, its textures, parts named by a path, and files with misleading names."""
