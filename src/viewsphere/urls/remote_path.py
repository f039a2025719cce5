"""A file or folder at a URL, read through fsspec. Failed requests are retried a few times and then reported in one line."""

from __future__ import annotations

import errno
import io
import os
import re
import time
from collections.abc import Callable, Generator
from fnmatch import fnmatchcase
from typing import IO, TYPE_CHECKING, Any, TypeVar

from viewsphere.errors import MissingExtraError, RemoteError, UserError
from viewsphere.limits import limits
from viewsphere.urls.inside import is_inside

if TYPE_CHECKING:
    from pathlib import Path
    from pathlib import Path as Base
else:
    from pathlib import PurePosixPath as Base

Answer = TypeVar("Answer")

BLOCK = 8 << 20
"""Bytes of a larger file that are requested at once."""

FIRST_WAIT_S = 0.2
"""Seconds before the second try; the delay triples before each further one."""

MISTAKES = (TypeError, AttributeError, NameError, NotImplementedError, MemoryError)
"""Exceptions that neither a retry nor the user can fix."""

OPTIONS: dict[str, dict[str, Any]] = {"s3": {"max_concurrency": 1, "config_kwargs": {"retries": {"max_attempts": 0}}}}
"""Options of file systems by kind of URL. s3fs requests no sizes before it reads, and does not retry: MAX_REMOTE_TRIES does."""

ANSWERS = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError)
"""Exceptions that are answers about the path, not failures."""

_SECRET = re.compile(r"://[^/\s@]*:[^/\s@]*@")
"""User and password in a URL."""


class RemotePath(Base):
    """A path below a URL that reads and lists like a `pathlib.Path`; type checkers treat it as one. It writes only complete
    files.

    Raises FileNotFoundError like a Path, and RemoteError if the URL does not answer or refuses.
    """

    @classmethod
    def from_url(cls, url: str) -> RemotePath:
        """The path of a URL; raises UserError for one with a password."""
        if _SECRET.search(re.sub(r":/+", "://", url)):
            raise UserError(
                f"{_shown(url)}: expected a URL without a password, which others would see; found one: give it where the "
                "storage's own programs look for it (for s3://: AWS_PROFILE, or AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY)"
            )
        return cls(url)

    def __str__(self) -> str:
        protocol, *inside = self.parts or ("",)
        return f"{protocol}//{'/'.join(inside)}" if protocol.endswith(":") else super().__str__()

    def __fspath__(self) -> str:
        raise TypeError(f"{self}: expected a file on this machine, found one at a URL")

    def read_bytes(self) -> bytes:
        """Return the bytes of the file."""
        return self._asked("read", lambda system, path: bytes(system.cat_file(path)))

    def read_text(self, encoding: str | None = None, errors: str | None = None) -> str:
        """The file's text with its line ends unchanged."""
        return self.read_bytes().decode(encoding or "utf-8", errors or "strict")

    def byte_range(self, start: int, size: int) -> bytes:
        """`size` bytes of the file from `start` on, fewer if it ends before."""

        def read(system: Any, path: str) -> bytes:
            try:
                found = bytes(system.cat_file(path, start=start, end=start + size))
            except OSError as error:
                if error.errno == errno.EINVAL:  # s3fs's error for status 416: the file ends before `start`
                    return b""
                raise
            return found if len(found) <= size else found[start : start + size]  # of servers that do not support ranges

        return self._asked("read", read) if size else b""

    def open(self, mode: str = "r", buffering: int = -1, encoding: str | None = None, **_: Any) -> IO[Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The file as a stream that is read in blocks; text keeps its line ends."""
        if set(mode) - set("rbt"):
            raise io.UnsupportedOperation(mode)
        size = self.stat().st_size
        stream = io.BytesIO(self.read_bytes()) if size <= BLOCK else io.BufferedReader(_Blocks(self, size), BLOCK)
        return stream if "b" in mode else io.TextIOWrapper(stream, encoding or "utf-8", newline="\n")

    def write_bytes(self, data: bytes) -> int:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Write a file of these bytes here, completely or not at all; return their number."""

        def write(system: Any, path: str) -> None:
            _make_parent(system, path)
            system.pipe_file(path, data)

        self._written(write)
        return len(data)

    def upload(self, file: Path) -> None:
        """Write a copy of a local file here, completely or not at all."""

        def write(system: Any, path: str) -> None:
            _make_parent(system, path)
            system.put_file(str(file), path)

        self._written(write)

    def unlink(self, missing_ok: bool = True) -> None:
        """Remove the file; do nothing if it does not exist."""
        try:
            self._asked("remove", lambda system, path: system.rm_file(path))
        except FileNotFoundError:
            if not missing_ok:
                raise

    def exists(self, **_: bool) -> bool:
        """Return whether there is a file or a folder."""
        return self._info() is not None

    def is_file(self, **_: bool) -> bool:
        """Return whether there is a file."""
        return (self._info() or {}).get("type") == "file"

    def is_dir(self, **_: bool) -> bool:
        """Return whether anything is below this path."""
        return (self._info() or {}).get("type") == "directory"

    def is_symlink(self) -> bool:
        """Return False: there are no links."""
        return False

    def resolve(self, strict: bool = False) -> RemotePath:
        """The path itself, as there are no links."""
        return self

    def absolute(self) -> RemotePath:
        """The path itself."""
        return self

    def samefile(self, other_path: Any) -> bool:
        """Return whether this is the same path."""
        return self == other_path

    def mkdir(self, mode: int = 0o777, parents: bool = False, exist_ok: bool = False) -> None:
        """Do nothing: a folder exists as soon as it contains a file."""

    def stat(self, **_: bool) -> os.stat_result:
        """Size in bytes, and modification time in seconds since 1970 if known (else 0); all other fields are 0."""
        info = self._info()
        if info is None:
            raise self._lacking()
        written: Any = next((info[name] for name in ("LastModified", "mtime", "updated", "created") if name in info), 0)
        seconds = float(written.timestamp() if hasattr(written, "timestamp") else written if isinstance(written, float) else 0)
        return os.stat_result((0, 0, 0, 0, 0, 0, int(info.get("size") or 0), 0, seconds, 0))

    def iterdir(self) -> Generator[RemotePath]:
        """Yield the paths in the folder; raises FileNotFoundError if there is none."""

        def names(system: Any, path: str) -> set[str]:
            head = path.rstrip("/") + "/"
            found = (str(name).rstrip("/") for name in system.ls(path, detail=False))
            return {name.removeprefix(head) for name in found if name.startswith(head)}

        yield from (self / name for name in sorted(self._asked("list", names)))

    def glob(self, pattern: str, **_: Any) -> Generator[RemotePath]:
        """Yield the paths in the folder whose names match; nothing if there is no folder."""
        try:
            yield from (path for path in self.iterdir() if fnmatchcase(path.name, pattern))
        except FileNotFoundError:
            return

    def rglob(self, pattern: str, **_: Any) -> Generator[RemotePath]:
        """The files below, without folders, whose names match."""
        yield from (self / path for path in self.files_below() if fnmatchcase(path.rpartition("/")[2], pattern))

    def files_below(self) -> list[str]:
        """Relative paths of all files below, sorted; empty if there is no folder."""
        return list(self.sizes_below())

    def sizes_below(self) -> dict[str, int]:
        """The sizes in bytes of all files below, by relative path, sorted; empty if there is no folder. Raises RemoteError if a
        name would lead out of a folder on a disk.
        """

        def find(system: Any, path: str) -> dict[str, int]:
            head = path.rstrip("/") + "/"
            found: dict[str, dict[str, Any]] = system.find(path, detail=True)
            return {
                file.removeprefix(head): int(info.get("size") or 0) for file, info in found.items() if file.startswith(head)
            }

        files = {file: size for file, size in sorted(self._asked("list", find).items()) if file and not file.endswith("/")}
        outside = next((file for file in files if not is_inside(file)), None)
        if outside is not None:
            raise RemoteError(f"{self}: expected names without '..', found {outside!r:.200}: rename or remove it")
        return files

    @property
    def is_shared(self) -> bool:
        """Return whether other processes see the same files there."""
        return self.parts[0] != "memory:"

    def _info(self) -> dict[str, Any] | None:
        try:
            return self._asked("look at", lambda system, path: system.info(path))
        except FileNotFoundError:
            return None

    def _written(self, write: Callable[[Any, str], None]) -> None:
        try:
            self._asked("write", write)
        except FileNotFoundError as error:
            why = f"expected to write, found: {_shown(error)}: make the bucket, or correct its name"
            raise RemoteError(f"{self}: {why}") from None

    def _lacking(self) -> FileNotFoundError:
        return FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(self))

    def _asked(self, what: str, ask: Callable[[Any, str], Answer]) -> Answer:
        """The file system's answer, requested up to MAX_REMOTE_TRIES times."""
        system, path = _system(str(self))
        for tries in range(1, limits.MAX_REMOTE_TRIES + 1):
            try:
                return ask(system, path)
            except FileNotFoundError as error:
                raise FileNotFoundError(errno.ENOENT, error.strerror or os.strerror(errno.ENOENT), str(self)) from None
            except (*ANSWERS, *MISTAKES):
                raise
            except Exception as error:
                if _is_refusal(error):
                    raise RemoteError(
                        f"{self}: expected to be allowed to {what} it, found: {_shown(error)}: see that the storage's "
                        "credentials are set, and allow it"
                    ) from None
                if tries == limits.MAX_REMOTE_TRIES:
                    raise RemoteError(
                        f"{self}: expected to {what} it, found, {tries} times: {_shown(error)}: what is finished is kept; run "
                        "the same command again when the storage answers"
                    ) from None
            time.sleep(FIRST_WAIT_S * 3 ** (tries - 1))
        raise AssertionError


class _Blocks(io.RawIOBase):
    """A file of known size as a stream that requests its blocks one by one."""

    def __init__(self, path: RemotePath, size: int) -> None:
        self._path, self._size, self._at = path, size, 0

    def readable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a position in the file."""
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        """The position in the file."""
        return self._at

    def readinto(self, buffer: Any) -> int:
        """Read the next bytes; raises RemoteError if the file became shorter."""
        wanted = max(0, min(len(buffer), self._size - self._at))
        data = self._path.byte_range(self._at, wanted)
        if len(data) != wanted:
            where = f"{wanted:,} bytes from {self._at:,} on"
            raise RemoteError(
                f"{self._path}: expected {where}, found {len(data):,}: the file is being written. Run the command again later"
            )
        buffer[:wanted] = data
        self._at += wanted
        return wanted


def _shown(error: object) -> str:
    """An error or a URL in one line, without passwords."""
    text = " ".join(str(error).split()) or type(error).__name__
    return _SECRET.sub("://...@", text if isinstance(error, str) else f"{type(error).__name__}: {text}"[:300])


def _is_refusal(error: Exception) -> bool:
    """Return whether an error is about the user's credentials or permissions, so that a retry does not help."""
    return isinstance(error, PermissionError) or "Credential" in type(error).__name__


def _make_parent(system: Any, path: str) -> None:
    """Create the folder of a file if the file system has folders. Object stores have none, and would create buckets."""
    if not system.async_impl:
        system.makedirs(path.rpartition("/")[0], exist_ok=True)


def _system(url: str) -> tuple[Any, str]:
    """The file system of a URL and the path in it. fsspec keeps one file system of each kind per process. Listings are not
    cached, since other processes write, too. Raises MissingExtraError if a package is missing.
    """
    protocol = url.partition("://")[0]
    try:
        from fsspec.core import url_to_fs  # pyright: ignore[reportMissingTypeStubs]

        system, path = url_to_fs(url, use_listings_cache=False, **OPTIONS.get(protocol, {}))
    except ImportError as error:
        extra = "viewsphere[s3]" if protocol == "s3" else "viewsphere[remote]"
        raise MissingExtraError(
            f"{url}: expected the packages that open {protocol}:// URLs, found: {error}: pip install '{extra}'"
        ) from None
    except ValueError as error:
        raise UserError(f"{url}: expected a URL that fsspec opens, found: {_shown(error)}: correct it") from None
    if protocol == "s3":
        system.retries = 1
    return system, path
