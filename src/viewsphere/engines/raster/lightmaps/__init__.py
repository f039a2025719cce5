"""Light of still surfaces, stored per texel and per vertex."""
