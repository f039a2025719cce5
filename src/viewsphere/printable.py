"""Text from files made safe for a terminal, which would execute control characters in it."""

from __future__ import annotations

from unicodedata import category

CONTROL = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Unicode's categories of control and format characters, surrogates, and line separators."""


def printable(text: str) -> str:
    """The text in one line: control and format characters, such as those that begin a terminal's commands, as `\\x1b`."""
    if text.isprintable():
        return text
    return "".join(_escaped(letter) if category(letter) in CONTROL else letter for letter in text)


def is_utf8(text: str) -> bool:
    """Return whether a name is text. The names of files may be any bytes, and Python decodes invalid ones to surrogates."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _escaped(letter: str) -> str:
    return letter.encode("unicode_escape", "surrogatepass").decode("ascii")
