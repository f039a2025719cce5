"""Light from the sky and from environment pictures."""
