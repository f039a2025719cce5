"""Encoders and decoders of pixels: PNG, TIFF, OpenEXR, NPZ, and the formats of Pillow and imagecodecs."""
