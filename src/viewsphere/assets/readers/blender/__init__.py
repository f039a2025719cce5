"""Files that Blender reads: FBX, Alembic, .blend and more."""
