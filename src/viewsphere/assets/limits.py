"""How much a model file may ask for: a file cannot make the reader run out of memory or time."""

MAX_FILE_BYTES = 4 << 30
MAX_TRIANGLES = 20_000_000
MAX_TEXTURE_SIDE = 16_384
MAX_TEXTURE_PIXELS = 1 << 27  # 512 MiB once it is RGBA
MAX_TEXTURES = 1_024
MAX_ALL_TEXTURE_PIXELS = 1 << 29  # of all textures of a model, 2 GiB as RGBA
MAX_ZEROS = 10_000_000  # elements of a glTF accessor that has no bytes in the file
MAX_INSTANCES = 1_000_000  # of objects in a scene of a DAE or 3MF file
MAX_ARCHIVE_BYTES = 1 << 30  # a 3MF archive once it is unpacked

MIN_SIZE = 1e-4
"""Smallest longest side of a normalised model, metres."""
MAX_SIZE = 1e5
"""Greatest longest side of a normalised model, metres."""
