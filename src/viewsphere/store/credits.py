"""CREDITS.md at a data set's root: the licences and the attributions of its models."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

from viewsphere.files import read_bytes
from viewsphere.model.credit import Credit
from viewsphere.store.shots.records import ModelInfo

if TYPE_CHECKING:
    from viewsphere.store.samples.dataset import Dataset

CREDITS = "CREDITS.md"
"""Name of the file."""

HEAD = """# Credits

Whose the 3D models of this data set are, and on which terms they may be used.

| licence | attribution | source | models |
|---|---|---|---|
"""


def credited(models: Iterable[ModelInfo]) -> dict[Credit | None, tuple[str, ...]]:
    """Keys of the models with each credit; models without a credit are under None. Time steps count as their model."""
    keys: defaultdict[Credit | None, dict[str, None]] = defaultdict(dict)
    for info in models:
        keys[info.credit][info.track or info.key] = None
    return {credit: tuple(named) for credit, named in keys.items()}


def credits_text(models: Iterable[ModelInfo]) -> str:
    """The file's text, GitHub Flavored Markdown (https://github.github.com/gfm/); empty if no credit is known."""
    groups = credited(models)
    rows = (_row(credit or Credit(), keys) for credit, keys in groups.items())
    return HEAD + "".join(rows) if any(groups) else ""


def _row(credit: Credit, keys: Iterable[str]) -> str:
    source = f"<{credit.source_url}>" if credit.source_url else ""
    cells = (escaped(credit.licence or "not known"), escaped(credit.attribution or ""), source, escaped(", ".join(keys)))
    return f"| {' | '.join(cells)} |\n"


def escaped(text: str) -> str:
    """The text, escaped so that Markdown shows it unchanged, also in tables: no markup, HTML, formulas or cell ends."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    return re.sub(r"([\\`*_\[\]<>|~&!$@:])", r"\\\1", printable)


def write_credits(dataset: Dataset) -> None:
    """Write the file if a credit is known; raises StoreError if writing fails."""
    if text := credits_text(dataset.models):
        dataset.store.write_beside(CREDITS, text)


def credits_problem(dataset: Dataset) -> str | None:
    """Return the error in the credits file, if its text differs from the models' records; None if it matches."""
    wanted, found = credits_text(dataset.models), None
    with suppress(OSError, UnicodeDecodeError):
        found = read_bytes(dataset.root / CREDITS, "MAX_RECORD_BYTES").decode()
    if not wanted or wanted == found:
        return None
    return f"{CREDITS}: expected what the models' records say, found {'no such text' if found is None else 'another text'}"
