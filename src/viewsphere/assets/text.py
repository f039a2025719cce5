"""Text model files in whatever encoding they were written."""

from __future__ import annotations

import codecs

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
SAMPLE_BYTES = 1 << 16


def decode(data: bytes) -> str:
    """Text of a file: by its byte-order mark, else UTF-16 if a zero byte leads, else UTF-8, else a guess."""
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data.decode(encoding, errors="replace")
    if data[:1] == b"\0" and data[1:2] != b"\0":
        return data.decode("utf-16-be", errors="replace")
    if data[1:2] == b"\0" and data[:1] != b"\0":
        return data.decode("utf-16-le", errors="replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode(_guess(data), errors="replace")


def _guess(data: bytes) -> str:
    """A guess at the encoding, made from the lines that are not ASCII."""
    from charset_normalizer import from_bytes

    foreign = b"\n".join(line for line in data[: 1 << 24].splitlines() if not line.isascii())[:SAMPLE_BYTES]
    best = from_bytes(foreign).best() if foreign else None
    return best.encoding if best is not None else "latin-1"


def statements(text: str) -> list[str]:
    """Statements of an OBJ or MTL file: continued lines joined, tabs replaced by blanks, surrounding blanks removed."""
    plain = text.replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ").replace("\t", " ")
    return [line.strip() for line in plain.split("\n")]
