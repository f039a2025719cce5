"""Damages small files as accidents and strangers do: bytes, numbers and words, the tree of a JSON text, members of an archive.

Everything follows from the generator that is passed in, so that an input is known by its target and its seed.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable
from random import Random
from typing import Any

from viewsphere.store.shots.manifest import sealed, unsealed

NUMBERS = (
    "0", "-0", "-1", "1", "2", "3", "0.5", "-2.5", "1e-7", "1e-320", "1e308", "-1e308", "1e999", "nan", "-inf", "inf", "255", "256",
    "65535", "65536", "2147483647", "2147483648", "4294967295", "4294967296", "-2147483649", "9007199254740993",
    "9223372036854775808", "18446744073709551616", "1000000000000000", "99999999999999999999999999999999999999", "0x10", "1_000",
    "1,5", "١٢", "", "-", ".", "e", "1e", "--1", "9" * 400,
)  # fmt: skip
"""What stands in a number's place."""

TEXTS = (
    "", " ", "a", "A" * 300, "ü", "\u2028", "\U0001f600", "\x00", "..", "../x", "/etc/hostname", "C:\\x", "a/b", "nul", "null", "true",
    "%s%n", "${x}", "\\", "\n", "data:,", "data:image/png;base64,AAAA", "file:///etc/hostname", "http://localhost/x", "zoo:car",
)  # fmt: skip
"""What stands in a word's place."""

VALUES = (
    None, True, False, 0, 1, -1, 2, 0.5, -0.0, 1e-320, 1e308, -1e308, float("nan"), float("inf"), float("-inf"), 2**31, 2**32, 2**53,
    2**63, 2**64, 10**15, 10**30, 10**400, "1", "nan", [], {}, [[]], [0], [None], {"": 0}, [1, 2, 3], "\ud800", *TEXTS,
)  # fmt: skip
"""What stands in a JSON value's place."""

BYTES = (
    b"\0",
    b"\xff",
    b"\x7f",
    b"\x80",
    b"\0\0\0\0",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\x80",
    b"\0\0\0\1",
    b"\1\0\0\0",
)
WORDS = (
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xed\xa0\x80",
    b"\0\0\xc0\x7f",
    b"\0\0\x80\x7f",
    b"\n\n",
    b"\r",
    b"\t",
    b'"',
    b"<",
    b"&",
    b"#",
)

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9.:/-]*")


def mutated(data: bytes, rng: Random, kind: str) -> bytes:
    """A damaged copy. `kind`: `bytes`, `text`, `json`, `sealed` (JSON with its digest), `glb` (JSON in a binary),
    `zip`, or `mat`; each is damaged as bytes, too."""
    by_structure = STRUCTURED.get(kind)
    if by_structure is None or rng.random() < 0.25:
        return _times(data, rng, _bytes)
    try:
        data = by_structure(data, rng)
    except RecursionError:  # nested deeper than json writes
        return b"[" * 100_000
    except (ValueError, LookupError, struct.error, zipfile.BadZipFile):
        return _times(data, rng, _bytes)
    return _times(data, rng, _bytes) if rng.random() < 0.1 else data


def _times(data: bytes, rng: Random, change: Callable[[bytes, Random], bytes]) -> bytes:
    """The change once, often twice, seldom many times."""
    data = change(data, rng)
    while rng.random() < 0.45:
        data = change(data, rng)
    return data


def _at(data: bytes, rng: Random) -> int:
    """A place, often near the head, where most of what is read first stands."""
    return rng.randrange(min(len(data), 200) + 1 if rng.random() < 0.5 else len(data) + 1)


def _bytes(data: bytes, rng: Random) -> bytes:
    at, length = _at(data, rng), rng.choice((1, 2, 4, 8, rng.randrange(1, 64)))
    match rng.randrange(9):
        case 0 if data:
            at = min(at, len(data) - 1)
            return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
        case 1:
            return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
        case 2 | 3:
            new = rng.choice(BYTES + WORDS)
            return data[:at] + new + data[at + len(new) :]
        case 4:
            return data[:at] + data[at + length :]
        case 5:
            return data[: at + length] + data[at:]
        case 6:
            return data[:at]
        case 7:
            start = _at(data, rng)
            return data[:at] + data[start : start + length] + data[at:]
        case _:
            return data[:at] + struct.pack(rng.choice("<>") + rng.choice("IHq"), rng.choice((0, 1, 255, 60000))) + data[at:]


def _text(data: bytes, rng: Random) -> bytes:
    """Other numbers and words, lines that are gone, doubled or swapped."""
    kind = rng.randrange(8)
    if kind < 3:
        return _replaced(data, rng, _NUMBER, rng.choice(NUMBERS).encode())
    if kind == 3:
        others = _WORD.findall(data)
        new = rng.choice(others) if others and rng.random() < 0.6 else rng.choice(TEXTS).encode()
        return _replaced(data, rng, _WORD, new)
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    match kind:
        case 4:
            del lines[i]
        case 5:
            lines[j:j] = [lines[i]] * rng.choice((1, 1, 1, 50))
        case 6:
            lines[i], lines[j] = lines[j], lines[i]
        case _:
            words = lines[i].split()
            lines[i] = b" ".join(words[: rng.randrange(len(words) + 1)] + (words if rng.random() < 0.3 else []))
    return b"\n".join(lines)


def _replaced(data: bytes, rng: Random, pattern: re.Pattern[bytes], new: bytes) -> bytes:
    found = list(pattern.finditer(data))
    if not found:
        return _bytes(data, rng)
    one = rng.choice(found)
    return data[: one.start()] + new + data[one.end() :]


Place = tuple[Any, Any]
"""A list or an object, and the index or the name of one of its values."""


def places(value: Any) -> list[Place]:
    """Every value of a JSON tree by what it stands in."""
    found: list[Place] = []
    todo = [value]
    while todo:
        one = todo.pop()
        names = list(one) if isinstance(one, dict) else range(len(one)) if isinstance(one, list) else ()
        for name in names:
            found.append((one, name))
            todo.append(one[name])
    return found


def tree(value: Any, rng: Random) -> Any:
    """Damage one value of a JSON tree in place; returns the tree."""
    found = places(value)
    if not found or rng.random() < 0.01:
        return rng.choice(VALUES)
    holder, name = rng.choice(found)
    old, kind = holder[name], rng.randrange(9)
    match kind:
        case 0 | 1 | 2:
            holder[name] = rng.choice(VALUES)
        case 3:
            del holder[name]
        case 4:
            other, there = rng.choice(found)
            holder[name] = json.loads(json.dumps(other[there])) if there in other or isinstance(other, list) else None
        case 5 if isinstance(holder, list):
            holder[name:name] = [old] * rng.choice((1, 1, 2, 1000))
        case 5:
            holder[str(rng.choice(VALUES))] = holder.pop(name)
        case 6:
            holder[name] = rng.choice(
                ([old], {"a": old}, [old, old], str(old), {str(old): old} if isinstance(old, str) else [[old]])
            )
        case 7 if isinstance(old, (int, float)) and not isinstance(old, bool):
            holder[name] = rng.choice(
                (old + 1, old - 1, -old, old * 1000, float(min(max(old, -1e300), 1e300)), old + 0.5, old * 10**15)
            )
        case 7 if isinstance(old, str) and old:
            at = rng.randrange(len(old))
            holder[name] = old[:at] + rng.choice(TEXTS) + old[at + 1 :]
        case _:
            for _ in range(rng.choice((3, 50, rng.randrange(150, 1000), 3000))):
                old = [old]
            holder[name] = old
    return value


def _json(data: bytes, rng: Random) -> bytes:
    value = json.loads(data)
    value = tree(value, rng)
    while rng.random() < 0.4:
        value = tree(value, rng)
    return json.dumps(value).encode()


def _sealed(data: bytes, rng: Random) -> bytes:
    """Of a JSON text that carries its own digest: damaged, and sealed again."""
    return sealed(tree(unsealed(data.decode()), rng)).encode()


def glb(text: bytes, body: bytes) -> bytes:
    """A binary glTF file of a JSON text and a buffer."""
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _glb(data: bytes, rng: Random) -> bytes:
    (length,) = struct.unpack_from("<I", data, 12)
    text, body = data[20 : 20 + length], data[28 + length :]
    return glb(text, _bytes(body, rng)) if rng.random() < 0.15 else glb(_json(text, rng), body)


def _zip(data: bytes, rng: Random) -> bytes:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = max(members, key=lambda one: len(members[one])) if rng.random() < 0.7 else rng.choice(list(members))
    members[name] = _times(members[name], rng, _text if b"<" in members[name][:100] else _bytes)
    if rng.random() < 0.05:
        members[rng.choice(TEXTS)] = members.pop(name)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return out.getvalue()


def _mat(data: bytes, rng: Random) -> bytes:
    """Of a MATLAB file that is not packed: a tag with another type of element, or bytes."""
    tags = [at for at in range(128, len(data) - 8, 8) if 0 < struct.unpack_from("<I", data, at)[0] <= 18]
    if not tags or rng.random() < 0.3:
        return _bytes(data, rng)
    at = rng.choice(tags)
    return data[:at] + struct.pack("<I", rng.randrange(1, 19)) + data[at + 4 :]


STRUCTURED: dict[str, Callable[[bytes, Random], bytes]] = {
    "text": lambda data, rng: _times(data, rng, _text),
    "json": _json,
    "sealed": _sealed,
    "glb": _glb,
    "zip": _zip,
    "mat": lambda data, rng: _times(data, rng, _mat),
}
