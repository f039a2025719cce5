"""The credits of models: from their entries, else from their sources or a table beside their files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from pydantic import ValidationError

from viewsphere.assets.paths.inside import split_source
from viewsphere.composing.tables import Cells, table_rows
from viewsphere.errors import RecipeError
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import Named, source_of
from viewsphere.validation.errors import report, shown
from viewsphere.validation.quantity import first_few, quantity

TABLE = "credits.csv"
"""Name of the table in a folder of models: its column `file` holds names and patterns of files; the first match is used."""

COLUMNS = ("file", *Credit.model_fields)

Table = Mapping[str, Credit]
"""Credits by the files' names, or patterns of them."""


def credits_of(specs: Iterable[ModelSpec], said: Mapping[str, Credit]) -> dict[str, Credit]:
    """The known credits of models, by their keys; `said` holds the credits from recipes' entries, by the models' keys.

    Raises RecipeError, which names file and line, for an invalid table.
    """
    table, source = cache(_read), cache(_source)
    credits = {spec.key: said.get(spec.key) or _looked_up(spec, table, source) for spec in specs}
    return {key: credit for key, credit in credits.items() if credit is not None}


def unlicensed(keys: Iterable[str], known: Mapping[str, Credit]) -> Iterator[str]:
    """Yield one line that names the models without a known licence; none if all have one."""
    keys = [key for key in keys if key not in known or known[key].licence is None]
    if keys:
        have = f"{quantity(len(keys), 'model')} {'have' if len(keys) > 1 else 'has'} no licence ({first_few(keys)})"
        yield f"{have}. Set `licence:` in the recipe, or add a {TABLE} next to the files"


def _looked_up(spec: ModelSpec, table: Callable[[Path, bool], Table], source: Callable[[str], Named | None]) -> Credit | None:
    prefix, colon, _ = spec.source.partition(":")
    named = source(prefix) if colon else None
    if named is not None:
        return named.spec.credit(spec)
    file = split_source(Path(spec.source))[0]
    rows = table(file.parent, spec.confined)
    return rows.get(file.name) or next((credit for name, credit in rows.items() if fnmatchcase(file.name, name)), None)


def _source(prefix: str) -> Named | None:
    return source_of(f"{prefix}:")


def _read(folder: Path, confined: bool) -> Table:
    """The table in a folder of models; empty if there is none."""
    path, found = folder / TABLE, dict[str, Credit]()
    if not path.exists():
        return found
    if confined and path.resolve().parent != folder.resolve():
        raise RecipeError(
            f"{path}: expected a file in this folder; found a link to {path.resolve()}: copy it, or say confined: false"
        )
    for where, cells in table_rows(path, COLUMNS):
        name = (cells["file"] or "").strip()
        if not name or name in found or "/" in name or "\\" in name:
            raise RecipeError(
                f"{where}: file: expected the name of a file in this folder, or a pattern, once; found {shown(name)}"
            )
        found[name] = _credit(where, cells)
    return found


def _credit(where: str, cells: Cells) -> Credit:
    texts = {name: (cells[name] or "").strip() or None for name in Credit.model_fields}
    try:
        return Credit(**texts)
    except ValidationError as error:
        raise RecipeError(f"{where}: {report(error, texts).splitlines()[0]}") from None
