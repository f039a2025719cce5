"""Model files read as normalised meshes, and meshes exported to OBJ and GLB."""
