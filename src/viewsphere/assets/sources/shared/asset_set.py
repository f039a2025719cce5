"""The source of a public set of models: a folder whose layout says which models there are, without reading one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from stat import S_ISREG
from typing import Any

from viewsphere.errors import ModelError, UserError
from viewsphere.limits import limits
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import AssetSet, SourceModel, SourceSpec
from viewsphere.printable import printable
from viewsphere.validation.quantity import first_few

Models = Callable[[str, Sequence[str]], Iterator[SourceModel]]
"""`models(root, chosen)`: the models below a root, in order. Each name in `chosen` selects within one level of folders. Paths
are plain text here: for sets of 50,000 models, `Path` would take four fifths of the time.
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
        expand=lambda name: _expanded(Path(name).expanduser(), about, models, depth),
        folder=about,
        load=loaded,
        credit=lambda model: credit(_path(model)),
    )


def subfolders(folder: str, chosen: Sequence[str] = ()) -> list[str]:
    """The names of the folders in a folder, sorted, without hidden ones; with `chosen`, only its first name.

    Raises UserError for a folder with too many entries.
    """
    return entries(folder, chosen, lambda entry: entry.is_dir())


def entries(folder: str, chosen: Sequence[str], is_wanted: Callable[[os.DirEntry[str]], bool]) -> list[str]:
    """The names in a folder that are wanted, sorted, without hidden ones; with `chosen`, only its first name.

    Raises UserError for a folder with too many entries.
    """
    names: list[str] = []
    try:
        with os.scandir(folder) as found:
            for count, entry in enumerate(found, 1):
                if count > limits.MAX_ENTRIES:
                    raise UserError(
                        f"{folder} holds more than {limits.MAX_ENTRIES:,} entries (limit MAX_ENTRIES). Name a folder nearer to "
                        "the models, or set VIEWSPHERE_MAX_ENTRIES higher"
                    )
                if not entry.name.startswith(".") and (not chosen or entry.name == chosen[0]) and is_wanted(entry):
                    names.append(entry.name)
    except OSError:
        return []
    return sorted(names)


def first_file(folder: str, *names: str) -> str | None:
    """The path of the first of these files that a folder holds; None if it holds none of them."""
    return next((path for name in names if _is_file(path := f"{folder}/{name}")), None)


def _is_file(path: str) -> bool:
    """Return whether there is a regular file at a path; links are followed."""
    try:
        return S_ISREG(os.stat(path).st_mode)  # noqa: PTH116, see `Models`
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
    for above in range(min(depth, len(path.parts) - 1) + 1):
        root, chosen = path.parents[above - 1] if above else path, path.parts[len(path.parts) - above :]
        if found := tuple(models(root.as_posix(), chosen)):
            return found
    there = "no such folder" if not path.is_dir() else first_few([printable(name) for name in sorted(os.listdir(path))])  # noqa: PTH208
    raise UserError(f"expected {about.title} ({about.layout}) in {printable(str(path))}; found {there or 'an empty folder'}")


def _path(model: ModelSpec) -> str:
    return model.source.partition(":")[2]


def _real(path: str | Path) -> Path:
    return Path(os.path.realpath(path))
