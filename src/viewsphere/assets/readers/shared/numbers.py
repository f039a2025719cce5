"""Numbers of text files; malformed ones are refused with their line."""

from __future__ import annotations

import re
import warnings

import numpy as np

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.shared.text import decode

NO_NUMBER = re.compile(rb"[-+]?(?:nan\S*|1\.#\S+)", re.IGNORECASE)
"""Spellings of NaN and infinity in C libraries."""


def numbers_in(folder: ModelFolder, text: bytes, lines_before: int) -> Float:
    """Return all numbers of a text, separated by blanks. Raises ModelError for a word that is not a number, with its line in
    the file.
    """
    for words in (text, None):
        try:
            return _parsed(NO_NUMBER.sub(b"nan", text) if words is None else words)
        except (ValueError, DeprecationWarning):
            continue
    word = next(word for word in re.finditer(rb"\S+", text) if not _is_number(word[0]))
    line = lines_before + text.count(b"\n", 0, word.start()) + 1
    found = decode(word[0])[:40]
    hint = ": decimals need a point" if re.fullmatch(r"-?\d+,\d+", found) else ""
    raise folder.error(f"line {line:,}: expected a number, found {found!r}{hint}")


def _parsed(text: bytes) -> Float:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # older numpy only warns, and keeps the numbers before an error
        return np.fromstring(text, np.float64, sep=" ")


def _is_number(word: bytes) -> bool:
    try:
        return len(_parsed(word)) == 1
    except (ValueError, DeprecationWarning):
        return False
