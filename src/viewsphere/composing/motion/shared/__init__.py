"""Code shared by several motions."""
