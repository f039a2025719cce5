"""Detection of files that are not a model or have another format, by their first bytes: pointers, web pages, archives."""

from __future__ import annotations

import re
from itertools import chain

from viewsphere.assets.paths.finder import PICTURES as PICTURE_ENDINGS
from viewsphere.assets.readers import readers

HEAD = 4096
"""Number of leading bytes examined, enough for a server's message or the start of a page."""

PAGE = re.compile(rb"(?is)\s*(?:<!--.*?-->\s*)*<(?:!doctype html|html|head|body|script)\b")
MESSAGE = re.compile(
    rb"(?is)\s*(?:(?:error:? )?[45]\d\d\b|not found\b|access denied\b|forbidden\b|(?:<\?xml[^>]*>\s*)?<error>"
    rb"|\{(?!.*\"asset\")[^{]*\"(?:message|error|detail)\"\s*:)"
)
"""Replies of servers instead of a file: an HTTP status, a store's XML, or JSON with a message."""

ARCHIVES = {
    b"PK\x03\x04": "ZIP",
    b"\x1f\x8b\x08": "gzip",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "RAR",
    b"\xfd7zXZ": "xz",
    b"BZh": "bzip2",
}
PICTURES = {b"\x89PNG": "PNG", b"\xff\xd8\xff": "JPEG", b"RIFF": "WebP", b"GIF8": "GIF"}


def impostor(data: bytes) -> str | None:
    """A description of a stand-in for a file (a pointer, or a server's page or message), and the fix; None for other data."""
    head = data[:HEAD].removeprefix(b"\xef\xbb\xbf")
    return _pointer(head) or _from_server(head, len(data))


def wrong_kind(data: bytes, suffix: str) -> str | None:
    """A description of a file whose first bytes show that it is not a model with this suffix, and the fix; None if unknown."""
    kind = next((name for magic, name in ARCHIVES.items() if data.startswith(magic)), None)
    if kind is not None and all(reader.archives.get(suffix) != kind for reader in readers().values()):
        return f"a {kind} archive; unpack it and name the file in it"
    for magic, endings in chain.from_iterable(reader.first_bytes.items() for reader in readers().values()):
        if data.startswith(magic) and suffix not in endings:
            return f"one of another kind; rename the file so that it ends in .{endings[0]}"
    picture = next((name for magic, name in PICTURES.items() if data.startswith(magic)), None)
    return None if picture is None or f".{suffix}" in PICTURE_ENDINGS else f"a {picture} picture; name the model's file"


def _pointer(head: bytes) -> str | None:
    if head.startswith(b"version https://git-lfs.github.com/spec/"):
        size = re.search(rb"(?m)^size (\d+)", head)
        left = f", whose {int(size[1]):,} bytes are not downloaded" if size else ""
        return f"a git-lfs pointer to the file{left}; run `git lfs pull` in its repository"
    if head.lstrip(b"./").startswith((b"annex/objects/", b"git/annex/objects/")):
        return "a git-annex pointer to the file; run `git annex get` in its repository"
    return None


def _from_server(head: bytes, size: int) -> str | None:
    if PAGE.match(head):
        return "a web page (HTML); download the file itself (on GitHub: the button Download raw file)"
    if size <= HEAD and MESSAGE.match(head):
        text = " ".join(head.decode(errors="replace").split())[:80]
        return f"the message of a server ({text!r}); download the file again"
    return None
