"""The functions that open all files for reading: regular files only, each up to a named limit.

Files named by a recipe or an untrusted source may be pipes, devices or endless. `read_bytes`, `read_text`, `open_file` and
`open_text` refuse them, even if a file grows while it is read. `check_file` checks a file that a library opens by its path.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Mapping
from pathlib import Path
from stat import S_IFBLK, S_IFCHR, S_IFDIR, S_IFIFO, S_IFMT, S_IFSOCK, S_ISREG
from typing import IO, Any, cast

from viewsphere.errors import UserError
from viewsphere.limits import limits

BLOCK = 1 << 20
"""Bytes read at once beyond the size that a file reports: small compared to any limit, large enough to make a call's cost
negligible.
"""

FLAGS = sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_NOCTTY"))
"""Further flags of opening: without O_NONBLOCK a pipe that nothing writes to blocks for ever."""

COPY = "not a regular file. Copy its content into a file, and name that file"

KINDS: Mapping[int, str] = {
    S_IFIFO: f"a pipe, {COPY}",
    S_IFCHR: f"a device, {COPY}",
    S_IFBLK: f"a device, {COPY}",
    S_IFSOCK: f"a socket, {COPY}",
    S_IFDIR: "a folder, not a file. Name a file in it",
}
"""Kinds of files that are not regular, and the fix that messages suggest."""


class FileError(UserError, OSError):
    """A file that is not regular, or larger than its limit; `strerror` is the part of the message after "is"."""

    def __init__(self, file: str, problem: str) -> None:
        super().__init__(file, problem)

    def __str__(self) -> str:
        return f"{self.errno} is {self.strerror}"  # OSError gives these names to its two arguments


def read_bytes(file: Path, limit: str = "MAX_FILE_BYTES") -> bytes:
    """Return all bytes of a regular file, or of one at a URL.

    Raises FileError for other kinds of files and for files above the named limit, and OSError like `open`.
    """
    if not isinstance(file, Path):
        return _remote_bytes(file, limit)
    with _Bounded(file, limit) as stream:
        size = os.fstat(stream.fileno()).st_size
        first = stream.read(size + 1)
        return first if len(first) <= size else first + stream.readall()  # it grew, or its size is reported as 0


def read_text(file: Path, limit: str = "MAX_FILE_BYTES", encoding: str = "utf-8") -> str:
    """The text of a file, with `\\n` as line ends; raises as `read_bytes` does, and ValueError for another encoding."""
    text = read_bytes(file, limit).decode(encoding)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def open_file(file: Path, limit: str = "MAX_STREAMED_BYTES") -> io.BufferedReader:
    """A regular file, or one at a URL, as a stream of bytes; raises as `read_bytes` does, also while it is read."""
    if not isinstance(file, Path):
        _refuse_larger(str(file), file.stat().st_size, limit)
        return cast(io.BufferedReader, file.open("rb"))
    return io.BufferedReader(_Bounded(file, limit))


def open_text(file: Path, limit: str = "MAX_STREAMED_BYTES", newline: str | None = None) -> IO[str]:
    """A regular file as a stream of UTF-8 text; raises as `read_bytes` does, also while it is read."""
    return io.TextIOWrapper(open_file(file, limit), "utf-8", newline=newline)


def written_path(text: str | Path) -> Path:
    """The path that a user wrote, with `~` as the home folder; raises UserError for the home of an unknown user."""
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise UserError(f"{text}: {Path(text).parts[0]} names no user with a home folder. Write the whole path") from None


def check_file(file: Path, limit: str) -> None:
    """Raise as `read_bytes` does. Call it before a library opens a file by its path."""
    open_file(file, limit).close()


class _Bounded(io.FileIO):
    """A regular file on a disk of which at most limit + 1 bytes are read."""

    def __init__(self, file: Path, limit: str) -> None:
        super().__init__(str(file), "rb", opener=_descriptor)  # libraries expect a stream's name to be a string
        self._file, self._limit, self._most = str(file), limit, int(getattr(limits, limit))
        try:
            _refuse_larger(self._file, os.fstat(self.fileno()).st_size, limit)
        except FileError:
            self.close()
            raise

    def read(self, size: int | None = -1, /) -> bytes:
        """At most `size` bytes; raises FileError beyond the limit."""
        left = max(self._most + 1 - self.tell(), 0)
        block = super().read(left if size is None or size < 0 else min(size, left))
        self._refuse_more()
        return block

    def readall(self) -> bytes:
        """Return all further bytes; raises FileError beyond the limit."""
        return b"".join(iter(lambda: self.read(BLOCK), b""))

    def readinto(self, buffer: Any, /) -> int:
        """Read into the buffer, and return the number of bytes; raises FileError beyond the limit."""
        left = max(self._most + 1 - self.tell(), 0)
        count = super().readinto(memoryview(buffer).cast("B")[:left])
        self._refuse_more()
        return count

    def _refuse_more(self) -> None:
        _refuse_larger(self._file, self.tell(), self._limit)


def _descriptor(file: str, flags: int) -> int:
    """The descriptor of the open file; raises FileError if it is not regular."""
    try:
        descriptor = os.open(file, flags | FLAGS)
    except OSError as error:
        if error.errno == errno.ENXIO:  # sockets and missing devices
            raise FileError(str(file), KINDS[S_IFSOCK]) from None
        raise
    mode = os.fstat(descriptor).st_mode
    if not S_ISREG(mode):
        os.close(descriptor)
        raise FileError(str(file), KINDS.get(S_IFMT(mode), KINDS[S_IFCHR]))
    return descriptor


def _refuse_larger(file: str, size: int, limit: str) -> None:
    most = getattr(limits, limit)
    if size > most:
        found = f"{size:,} bytes long, and at most {most:,} bytes are allowed (limit {limit})"
        raise FileError(file, f"{found}. Set VIEWSPHERE_{limit} higher if it is meant so")


def _remote_bytes(file: Any, limit: str) -> bytes:
    data: bytes = file.byte_range(0, getattr(limits, limit) + 1)
    _refuse_larger(str(file), len(data), limit)
    return data
