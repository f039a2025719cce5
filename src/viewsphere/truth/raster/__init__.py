"""The triangle that every pixel shows, and its distance."""
