"""Code shared by several samplers."""
