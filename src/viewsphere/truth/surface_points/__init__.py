"""Points that stay on surfaces, and their places in pictures."""
