"""Meshes as files: OBJ and GLB."""
