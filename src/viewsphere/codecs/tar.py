"""Files in a tar (POSIX ustar), dated 1970 and without an owner, so that equal files give equal bytes."""

from __future__ import annotations

import tarfile


def head(name: str, size: int) -> bytes:
    """Return the header of a file of this name and number of bytes; raises ValueError for a name that ustar cannot hold."""
    info = tarfile.TarInfo(name)
    info.size = size
    return info.tobuf(tarfile.USTAR_FORMAT)


def filling(size: int) -> bytes:
    """Return the padding behind a file of this many bytes."""
    return bytes(-size % tarfile.BLOCKSIZE)


def member(name: str, data: bytes) -> bytes:
    """A file as a tar member: header, data and padding."""
    return head(name, len(data)) + data + filling(len(data))


def ending(size: int) -> bytes:
    """Return the bytes that end a tar of this size: two empty blocks, and the padding of a record."""
    least = size + 2 * tarfile.BLOCKSIZE
    return bytes(least + -least % tarfile.RECORDSIZE - size)
