"""Code that several formats need."""
