"""Arrays in pickles and in NumPy's archives of several, of the same bytes whenever they are equal."""

from __future__ import annotations

import io
import pickle
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

DATE = (1980, 1, 1, 0, 0, 0)
"""Of all members of archives, so that equal arrays make equal files."""

UNIX = 3
"""The system that all archives say they are of."""


class _Portable(pickle.Pickler):
    """Pickles arrays by their shape, type and bytes: numpy's own way names modules that other versions of it do not have."""

    def reducer_override(self, obj: Any) -> Any:
        """Return the call that restores an array; other values as usual."""
        if isinstance(obj, np.ndarray):
            return np.ndarray, (obj.shape, obj.dtype.str, bytearray(np.ascontiguousarray(obj).tobytes()))
        return NotImplemented


def pickled(value: Any) -> bytes:
    """A pickle of dictionaries, texts and arrays that every version of numpy reads; equal values, equal bytes."""
    out = io.BytesIO()
    _Portable(out, protocol=4).dump(value)
    return out.getvalue()


def archive(**arrays: NDArray[Any]) -> bytes:
    """The archive of `np.savez(file, **arrays)`; equal arrays, equal bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as members:
        for name, array in arrays.items():
            head, member = io.BytesIO(), zipfile.ZipInfo(f"{name}.npy", DATE)
            member.create_system = UNIX
            np.lib.format.write_array(head, array, allow_pickle=False)
            members.writestr(member, head.getvalue())
    return out.getvalue()
