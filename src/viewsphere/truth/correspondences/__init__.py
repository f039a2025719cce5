"""Where what a pixel shows is in another picture."""
