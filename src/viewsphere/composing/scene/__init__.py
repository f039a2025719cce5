"""What surrounds the things: places, sky, sun, weather, pictures."""
