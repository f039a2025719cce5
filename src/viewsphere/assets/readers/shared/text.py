"""Decoding of text model files in any encoding."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
SAMPLE_BYTES = 1 << 16
COMMENT = re.compile(r"(?:^|(?<=\s))#")
COMMENT_BEHIND_NUMBERS = re.compile(r"(?<!1\.)#")
NO_NUMBER = re.compile(r"[+-]?1\.#\w+|-?nan\(\w+\)")
"""NaN and infinity as written by Microsoft's C library."""

EASTERN = ("gb18030", "shift_jis", "euc_kr", "big5", "cp1251", "cp1252")
"""Encodings tried after the guess, from systems that write model files without Unicode."""


def decode(data: bytes, encoding: str | None = None) -> str:
    """Text of a file: decoded by `own_encoding`, else by `encoding`, else by the likeliest encoding; unreadable bytes are
    replaced.
    """
    return data.decode(own_encoding(data) or encoding or likely([data])[0], errors="replace")


def own_encoding(data: bytes) -> str | None:
    """The encoding that the bytes themselves show: by a byte-order mark, else UTF-16 if one byte of two is zero, else UTF-8."""
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return encoding
    if data[:1] == b"\0" and data[1:2] != b"\0":
        return "utf-16-be"
    if data[1:2] == b"\0" and data[:1] != b"\0":
        return "utf-16-le"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return None
    return "utf-8"


def likely(texts: Sequence[bytes]) -> tuple[str, ...]:
    """Encodings of files without a visible one, the likeliest first, judged by the lines that are not ASCII."""
    from charset_normalizer import from_bytes

    lines = (line for data in texts for line in data[: 1 << 24].splitlines() if not line.isascii())
    foreign = b"\n".join(lines)[:SAMPLE_BYTES]
    best = from_bytes(foreign).best() if foreign else None
    return tuple(dict.fromkeys((best.encoding if best is not None else "latin-1", *EASTERN)))


def statements(text: str) -> list[str]:
    """Statements of an OBJ or MTL file, each at the index of its first line in the file: continued lines are joined and
    followed by empty statements, tabs replaced by blanks, surrounding blanks removed.
    """
    plain = text.replace("\r\n", "\n").replace("\r", "\n").replace("\t", " ")
    lines = [line.strip() for line in plain.split("\n")]
    return _joined(lines) if "\\\n" in plain else lines


def _joined(lines: list[str]) -> list[str]:
    joined: list[str] = []
    start: int | None = None
    for line in lines:
        joined.append("" if start is not None else line.removesuffix("\\"))
        if start is not None:
            joined[start] += " " + line.removesuffix("\\")
        start = (len(joined) - 1 if start is None else start) if line.endswith("\\") else None
    return joined


def uncommented(text: str) -> str:
    """The text before a comment: a `#` that begins a word, because names and Microsoft's NaN (`1.#QNAN`) may contain one."""
    return COMMENT.split(text, maxsplit=1)[0].rstrip()


def numeric_words(text: str) -> list[str]:
    """The words of a numeric statement before a comment, which may follow without a blank."""
    return COMMENT_BEHIND_NUMBERS.split(text, maxsplit=1)[0].split()


def number_of(word: str) -> float | None:
    """The number if the whole word is one, None otherwise; Python's underscores (1_000) are not accepted."""
    if NO_NUMBER.fullmatch(word):
        return float("nan")
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None
