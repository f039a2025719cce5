"""The exact rasteriser and the geometric channels: every label comes from here."""
