"""Arrays to NumPy's compressed archives and back, in memory; `np.load` reads them.

Format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html in a ZIP archive of one member.
"""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from viewsphere.codecs.deflate import deflate
from viewsphere.codecs.size import check_size
from viewsphere.errors import UserError
from viewsphere.files import open_file

_DEFLATED, _VERSION, _DATE = 8, 20, 33  # ZIP 2.0; dated 1 January 1980, so that equal arrays make equal files


def encode_npz(array: NDArray[Any], name: str) -> bytes:
    """The archive of `np.savez_compressed(file, **{name: array})`, except that only runs of equal pixels are compressed."""
    array = np.ascontiguousarray(array)
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
    header = head.getvalue()
    first = struct.pack("<BHH", 0, len(header), len(header) ^ 0xFFFF) + header  # a separate stored block
    stream, _ = deflate(array)
    check = isal_zlib.crc32(array, isal_zlib.crc32(header))
    member = f"{name}.npy".encode("ascii")
    sizes = struct.pack("<III", check, len(first) + len(stream), len(header) + array.nbytes)
    common = struct.pack("<HHHHH", _VERSION, 0, _DEFLATED, 0, _DATE) + sizes + struct.pack("<HH", len(member), 0)
    local = b"PK\3\4" + common + member
    entry = b"PK\1\2" + struct.pack("<H", _VERSION) + common + struct.pack("<HHHII", 0, 0, 0, 0, 0) + member
    start = len(local) + len(first) + len(stream)
    end = b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(entry), start, 0)
    return b"".join((local, first, stream, entry, end))


def decode_npz(data: bytes, name: str) -> NDArray[Any]:
    """The array of this name in an archive; raises UserError if the file is damaged, lacks the array or exceeds the limit."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive, archive.open(f"{name}.npy") as member:
            check_size(*_promised(member))
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return arrays[name]
    except UserError:
        raise
    except Exception as error:  # numpy, zipfile, zlib and tokenize each have errors of their own
        raise UserError(
            f"NPZ: expected an archive with the array {name!r}, found {error}: the file is damaged or none"
        ) from error


def load_array(file: Path) -> NDArray[Any]:
    """The array in a .npy file that another process wrote; raises OSError or ValueError if it cannot be read."""
    with open_file(file) as stream:
        return np.load(stream, allow_pickle=False)


def _promised(member: IO[bytes]) -> tuple[int, int]:
    """Width and height from an array's header; for rows of numbers, the number of rows and 1."""
    major, _ = np.lib.format.read_magic(member)
    read = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
    shape, _, _ = read(member)
    if len(shape) > 3 or (len(shape) == 3 and shape[2] > 4):
        raise ValueError(f"an array of shape {shape}")
    height, width = (*shape, 1, 1)[:2]
    return width, height
