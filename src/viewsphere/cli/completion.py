"""Completions for the Tab key; nothing heavy is imported, so that they appear at once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, MutableMapping
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint
from io import StringIO
from pathlib import Path

import typer

from viewsphere import plugins
from viewsphere.recipe.starts import FIRST, kinds, start

BASH = "complete_bash"


def models(incomplete: str) -> list[str]:
    """Models of sources and files of this folder; nothing where the word can be no such model: the shell completes files."""
    prefixes = [f"{prefix}:" for prefix in plugins.names("sources")]
    if not any(prefix.startswith(incomplete[: len(prefix)]) for prefix in prefixes):
        return []
    listed = (f"{entry.name}:{name}" for entry in plugins.entry_points("viewsphere.source_names") for name in _names(entry))
    here = () if incomplete.startswith(tuple(prefixes)) else Path().glob(f"{incomplete}[!.]*")
    return [*listed, *sorted(f"{p}/" if p.is_dir() else str(p) for p in here)]


def _names(entry: EntryPoint) -> list[str]:
    """The names that a source's entry point lists; none if it cannot be loaded: a traceback would spoil the command line."""
    try:
        return list(entry.load()())
    except Exception:
        return []


def formats(incomplete: str) -> list[str]:
    """The comma-separated formats typed so far, each time followed by one more format."""
    given, comma, _ = incomplete.rpartition(",")
    return [given + comma + name for name in plugins.names("formats") if name not in given.split(",")]


def drawings() -> list[str]:
    """Labels that `preview` draws; listing them imports the labels' files."""
    from viewsphere.labels import drawings as known

    return [drawing.name for drawing in known()]


def starts() -> list[str]:
    """Kinds of recipes that `viewsphere new` writes."""
    return list(kinds())


def axes() -> list[str]:
    """Axes with signs, such as +x."""
    return [sign + axis for axis in "xyz" for sign in "+-"]


def changes(incomplete: str) -> list[str]:
    """The fields in the template of `viewsphere new`; after `engine=` the engines."""
    if incomplete.startswith("engine="):
        return [f"engine={name}" for name in plugins.names("engines")]
    return [f"{field}=" for field in _fields()]


def _fields() -> Iterable[str]:
    text = start(FIRST)["recipe.yaml"]
    inside = ""
    for indent, dash, name, value in re.findall(r"^( *)(- )?(?:# )?([a-z_]+):(?: +([^ #])| *#|$)", text, re.MULTILINE):
        if not indent:
            inside = "" if value else name
        if dash:
            inside += "[0]"
        if value:
            yield f"{inside}.{name}" if indent else name


def in_bash(run: Callable[[], object], environ: MutableMapping[str, str]) -> None:
    """Complete in bash, which splits `zoo:car` and `engine=raster` into three words: completions are for the last one alone."""
    words, at = environ["COMP_WORDS"].split("\n"), int(environ["COMP_CWORD"])
    whole: list[str] = []
    place = 0
    for i, word in enumerate(words):
        if i and (_parts(word) or _parts(words[i - 1])):
            whole[-1] += word
        else:
            whole.append(word)
        if i == at:
            place = len(whole) - 1
    environ["COMP_WORDS"], environ["COMP_CWORD"] = "\n".join(whole), str(place)
    given = re.match(r".*[:=]", whole[place]) if at < len(words) else None
    answer = StringIO()
    try:
        with redirect_stdout(answer):
            run()
    finally:
        for line in answer.getvalue().splitlines():
            typer.echo(line.removeprefix(given[0] if given else ""))


def _parts(word: str) -> bool:
    return set(word) <= set(":=") and bool(word)
