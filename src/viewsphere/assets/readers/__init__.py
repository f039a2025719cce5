"""Readers of model files, one package each, selected by suffix."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from viewsphere import plugins
from viewsphere.plugins.reader import ReaderSpec


def readers() -> dict[str, ReaderSpec]:
    """All readers by name, viewsphere's first; third-party readers that cannot be loaded are left out."""
    return _readers(plugins.names("readers"), tuple(plugins.entry_points("viewsphere.readers")))


@lru_cache(maxsize=1)
def _readers(_names: tuple[str, ...], _entries: tuple[metadata.EntryPoint, ...]) -> dict[str, ReaderSpec]:
    """The readers of these names. They are needed for every model, so they are cached until the installed packages change."""
    found = plugins.loadable(ReaderSpec)
    return dict(sorted(found.items(), key=lambda item: plugins.is_third_party("readers", item[0])))


def reader_of(suffix: str, *, moving: bool = False) -> ReaderSpec | None:
    """The reader of files with this suffix (without its dot), or the reader of their animations; None if there is none."""
    return _best([one for one in readers().values() if one.frames is not None or not moving], suffix)


def _best(known: Iterable[ReaderSpec], suffix: str) -> ReaderSpec | None:
    fitting = (one for one in known if suffix in one.suffixes)
    return min(fitting, key=lambda one: (bool(missing(one)), one.by_blender), default=None)


def missing(reader: ReaderSpec) -> list[str]:
    """The optional packages of a reader that are not installed."""
    return [name for name in reader.packages if find_spec(name) is None]


def suffixes(*, by_blender: bool | None = None) -> tuple[str, ...]:
    """Sorted suffixes of model files, without pictures: all, or only those that Blender reads here, or only the others that do
    not join models of other files.
    """
    known = readers().values()
    ordered = sorted({suffix for one in known if not one.is_picture for suffix in one.suffixes})
    if by_blender is None:
        return tuple(ordered)
    chosen = ((suffix, _best(known, suffix)) for suffix in ordered)
    here = ((suffix, reader) for suffix, reader in chosen if reader is not None and reader.by_blender == by_blender)
    return tuple(suffix for suffix, reader in here if by_blender or not reader.joins_files)


def third_party_sources(suffix: str) -> list[Path]:
    """The source files that the results of a third-party reader depend on; empty for viewsphere's readers."""
    reader = reader_of(suffix)
    name = next((name for name, one in readers().items() if one is reader), None)
    if name is None or not plugins.is_third_party("readers", name):
        return []
    file = plugins.module_file("readers", name)
    if file is None:
        return []
    return sorted(file.parent.rglob("*.py")) if file.name == "__init__.py" else [file]
