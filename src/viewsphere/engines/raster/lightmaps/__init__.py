"""Light of still surfaces, by texel and by vertex."""
