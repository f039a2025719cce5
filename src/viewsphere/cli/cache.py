"""The command `cache`: shows and empties the folder of reproducible results."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from viewsphere.cli.arguments import AsJson
from viewsphere.cli.terminal import print_json, say
from viewsphere.errors import UserError

if TYPE_CHECKING:
    from viewsphere.caches.budget import Entry

MEGABYTE = 1e6


class _Action(StrEnum):
    """The work of the command."""

    INFO, PRUNE, CLEAR = "info", "prune", "clear"


def cache(
    action: Annotated[
        _Action, typer.Argument(help="`info`; `prune` deletes the least recently used entries; `clear` deletes all entries.")
    ] = _Action.INFO,
    to: Annotated[
        str | None,
        typer.Option(help="With prune: the size to keep, such as 500MB; default: CACHE_LIMIT.", show_default=False),
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(help="With clear: only this kind, such as light; repeatable.", show_default=False),
    ] = None,
    json_: AsJson = False,
) -> None:
    """Show the content of the cache, or delete entries; viewsphere makes them again. Safe while other commands run."""
    from viewsphere.caches import KINDS, budget, cache_folder
    from viewsphere.limits import limits

    if to is not None and action != _Action.PRUNE:
        raise UserError("cache: --to is for `cache prune`")
    if kind and action != _Action.CLEAR:
        raise UserError("cache: --kind is for `cache clear`")
    for name in kind or ():
        if name not in KINDS:
            raise UserError(f"cache: --kind {name!r:.60} is unknown. Valid: {', '.join(KINDS)}")
    if action == _Action.INFO:
        held = {"folder": str(cache_folder()), "limit": limits.CACHE_LIMIT, "kinds": _by_kind(budget.entries())}
        print_json(held) if json_ else _tell(held)
        return
    if action == _Action.CLEAR:
        gone = budget.clear(kind or tuple(KINDS))
    else:
        gone = budget.prune(limits.CACHE_LIMIT if to is None else _bytes(to))
    size = sum(entry.size for entry in gone)
    if json_:
        print_json({"deleted": len(gone), "bytes": size})
    else:
        say(f"{cache_folder()}: {_files(len(gone))} deleted, {size / MEGABYTE:,.1f} MB")


def _by_kind(entries: Iterable[Entry]) -> dict[str, Any]:
    """For each kind of entry: number, bytes, and time of the last use in seconds since 1970."""
    from viewsphere.caches import KINDS

    kinds = {name: {"files": 0, "bytes": 0, "used": 0.0} for name in KINDS}
    for entry in entries:
        held = kinds[entry.kind]
        kinds[entry.kind] = {
            "files": held["files"] + 1,
            "bytes": held["bytes"] + entry.size,
            "used": max(held["used"], entry.used),
        }
    return kinds


def _tell(held: dict[str, Any]) -> None:
    from viewsphere.caches import KINDS

    total = sum(kind["bytes"] for kind in held["kinds"].values())
    say(f"{held['folder']}: {total / MEGABYTE:,.1f} of {held['limit'] / MEGABYTE:,.0f} MB (VIEWSPHERE_CACHE_LIMIT)")
    for name, kind in held["kinds"].items():
        say(f"{name:8} {kind['bytes'] / MEGABYTE:10,.1f} MB  {_files(kind['files']):>12}  {KINDS[name]}")


def _bytes(text: str) -> int:
    """The number of bytes in a text; raises UserError if there is none."""
    from viewsphere.limits import parsed

    try:
        size = parsed(text, int)
    except ValueError:
        size = -1
    if size < 0:
        raise UserError(f"cache: --to: expected a size, such as 500MB; found {text!r:.60}")
    return size


def _files(number: int) -> str:
    return f"{number:,} {'file' if number == 1 else 'files'}"
