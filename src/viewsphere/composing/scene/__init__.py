"""The surroundings of things: places, sky, sun, weather, pictures."""
