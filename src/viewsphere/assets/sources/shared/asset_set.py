"""The source of a public set of models: a folder whose layout says which models there are, without reading one."""

from __future__ import annotations

import gzip
import json
import os
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from stat import S_ISREG
from typing import Any

from viewsphere.errors import ModelError, UserError
from viewsphere.files import open_file, written_path
from viewsphere.limits import limits
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import AssetSet, SourceModel, SourceSpec
from viewsphere.printable import printable
from viewsphere.validation.quantity import first_few


@dataclass(frozen=True)
class SetFolder:
    """The folder of a set: lists folders, and reads metadata that lies in it.

    Attributes:
        root: The path of the folder. Paths are plain text here: for sets of 50,000 models, `Path` would take four fifths of
            the time.
        unreadable: The folders that could not be listed, each a model with a fault, in the order in which they were listed.
    """

    root: str
    unreadable: list[SourceModel] = field(default_factory=list["SourceModel"])

    def subfolders(self, folder: str, chosen: Sequence[str] = ()) -> list[str]:
        """The names of the folders in a folder; see `entries`. A link in a circle counts as one, so that it is reported."""
        return self.entries(folder, chosen, _is_folder)

    def entries(self, folder: str, chosen: Sequence[str], is_wanted: Callable[[os.DirEntry[str]], bool]) -> list[str]:
        """The names in a folder that are wanted, sorted, without hidden ones; with `chosen`, only its first name.

        A missing folder has none. Raises UserError for a folder with too many entries.
        """
        names: list[str] = []
        try:
            with os.scandir(folder) as found:
                for count, entry in enumerate(found, 1):
                    if count > limits.MAX_ENTRIES:
                        raise UserError(
                            f"{folder} holds more than {limits.MAX_ENTRIES:,} entries (limit MAX_ENTRIES). Name a folder "
                            "nearer to the models, or set VIEWSPHERE_MAX_ENTRIES higher"
                        )
                    if not entry.name.startswith(".") and (not chosen or entry.name == chosen[0]) and is_wanted(entry):
                        names.append(entry.name)
        except (FileNotFoundError, NotADirectoryError):
            return []
        except (OSError, ValueError) as error:  # ValueError: a name with a null byte
            reason = error.strerror if isinstance(error, OSError) else str(error)
            self.unreadable.append(SourceModel(folder, fault=f"the folder cannot be listed: {reason}. Make it readable"))
        return sorted(names)

    def metadata(self, file: str, limit: str = "MAX_RECORD_BYTES") -> bytes:
        """The bytes of a file of metadata, unpacked if its name ends in `.gz`.

        Empty for a missing or damaged file, one above the limit, and one that a link leads out of the set's folder.
        """
        most = getattr(limits, limit)
        with suppress(OSError, EOFError, ValueError, zlib.error):
            if _real(file).is_relative_to(self._real_root):
                with open_file(Path(file), limit) as stream:
                    data = gzip.GzipFile(fileobj=stream).read(most + 1) if file.endswith(".gz") else stream.read()
                return data if len(data) <= most else b""
        return b""

    @staticmethod
    def parsed(text: bytes) -> Any:
        """The value of a JSON text of the set; None for an empty, damaged or too deeply nested one."""
        with suppress(ValueError, RecursionError):
            return json.loads(text)
        return None

    @cached_property
    def _real_root(self) -> Path:
        return _real(self.root)


Models = Callable[[SetFolder, Sequence[str]], Iterator[SourceModel]]
"""`models(tree, chosen)`: the models below the root of a set, in order. Each name in `chosen` selects within one level of
folders.
"""


def asset_source(
    about: AssetSet,
    models: Models,
    file: Callable[[str], str | None],
    credit: Callable[[str], Credit],
    depth: int = 1,
    depth_of: Callable[[str], int] | None = None,
    load: Callable[[ModelSpec, Path], Any] | None = None,
) -> SourceSpec:
    """The spec of a source that reads a set of models from a folder.

    Args:
        about: The facts about the set, for messages and documentation.
        models: A function that lists models. A name may be the root of the set, or a folder or model below.
        file: `file(model)`: the file of the model at this path; None if it has none.
        credit: `credit(model)`: the credit of the model at this path.
        depth: Largest number of names in a model's path below the root.
        depth_of: `depth_of(model)`: the number for the model at this path; by default `depth`.
        load: `load(model, file)`: the mesh or the file to read; by default the file.
    """

    def loaded(model: ModelSpec) -> Any:
        found = file(_path(model))
        if found is None:
            raise ModelError(f"{_path(model)}: no model of {about.title} ({about.layout})")
        root = Path(_path(model)).parents[(depth_of(_path(model)) if depth_of else depth) - 1]
        if model.confined and not _real(found).is_relative_to(_real(root)):
            raise ModelError(f"{found}: leads out of {root}. Copy the model, or set `confined: false`")
        return Path(found) if load is None else load(model, Path(found))

    return SourceSpec(
        expand=lambda name: _expanded(written_path(name), about, models, depth),
        folder=about,
        load=loaded,
        credit=lambda model: credit(_path(model)),
    )


def first_file(folder: str, *names: str) -> str | None:
    """The path of the first of these files that a folder holds; None if it holds none of them."""
    return next((path for name in names if _is_file(path := f"{folder}/{name}")), None)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    """Return whether an entry is a folder, or a link whose end cannot be looked up."""
    try:
        return entry.is_dir()
    except OSError:
        return True


def _is_file(path: str) -> bool:
    """Return whether there is a regular file at a path; links are followed."""
    try:
        return S_ISREG(os.stat(path).st_mode)  # noqa: PTH116, see `SetFolder`
    except (OSError, ValueError):
        return False


def model_at(path: str, file: str | None, expected: str, **facts: Any) -> SourceModel:
    """The model at a path below the root of a set. Without a file, or with a name that no record can hold, it has a fault."""
    if not path.isprintable():
        return SourceModel(path, fault="its name is not printable text: rename it", **facts)
    return SourceModel(path, fault="" if file is not None else f"no {expected}", **facts)


def _expanded(path: Path, about: AssetSet, models: Models, depth: int) -> tuple[SourceModel, ...]:
    """The models of the set whose root is the path or a folder above it; raises UserError if there are none."""
    path = Path(os.path.abspath(path))  # noqa: PTH100, links are kept: they may be how a user names a set
    unreadable: list[SourceModel] = []
    for above in range(min(depth, len(path.parts) - 1) + 1):
        root, chosen = path.parents[above - 1] if above else path, path.parts[len(path.parts) - above :]
        tree = SetFolder(root.as_posix())
        found = tuple(models(tree, chosen))
        if found:
            return (*found, *tree.unreadable)
        unreadable += tree.unreadable
    if unreadable:
        return (unreadable[0],)
    raise UserError(f"expected {about.title} ({about.layout}) in {printable(str(path))}; found {_content(path)}")


def _content(folder: Path) -> str:
    """The content of a folder in words, for a message."""
    try:
        return first_few([printable(name) for name in sorted(os.listdir(folder))]) or "an empty folder"  # noqa: PTH208
    except (FileNotFoundError, NotADirectoryError):
        return "no such folder"
    except (OSError, ValueError):
        return "a folder that cannot be listed"


def _path(model: ModelSpec) -> str:
    return model.source.partition(":")[2]


def _real(path: str | Path) -> Path:
    return Path(os.path.realpath(path))
