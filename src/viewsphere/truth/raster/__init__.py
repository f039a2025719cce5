"""The triangle that each pixel shows, and its distance."""
