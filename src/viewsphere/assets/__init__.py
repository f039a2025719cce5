"""Model files to normalised meshes, and back to OBJ and GLB."""
