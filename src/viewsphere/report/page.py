"""The page: one HTML file that holds its style, scripts, libraries, pictures and numbers, and needs no network."""

from __future__ import annotations

import base64
import html
import json
import re
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from viewsphere.files import read_bytes, read_text

WEB = Path(__file__).parent / "web"
VENDOR = WEB / "vendor" / "vendor.min.js"


def page(title: str, data: Mapping[str, Any]) -> str:
    """The complete HTML text of a page in a file."""
    parts = {
        "server": "'none'",
        "pictures": "",
        "scripts": "'unsafe-inline' data:",
        "nonce": "",
        "style": read_text(WEB / "style.css"),
        "modules": json.dumps({"imports": _modules(WEB, "report")}),
        "main": "report/main.js",
        "vendor": read_text(VENDOR),
    }
    return _filled(title, data, parts)


def served_page(title: str, data: Mapping[str, Any], own: Path, vendor: str) -> str:
    """The complete HTML text of a page that loads more data from its server.

    `own` is a folder with a style and modules of that page: they are called `own/<file>`, and its `main.js` starts the page.
    The libraries are the module `own/vendor.js`, which is loaded from the path `vendor` when it is needed. Only the scripts
    of this text run, and the modules that they import.
    """
    nonce = secrets.token_urlsafe(16)
    modules = {**_modules(WEB, "report"), **_modules(own, "own"), "own/vendor.js": vendor}
    parts = {
        "server": "'self'",
        "pictures": "'self'",
        "scripts": f"'nonce-{nonce}'",
        "nonce": f' nonce="{nonce}"',
        "style": read_text(WEB / "style.css") + read_text(own / "style.css"),
        "modules": json.dumps({"imports": modules}),
        "main": "own/main.js",
        "vendor": "",
    }
    return _filled(title, data, parts)


def vendor_module() -> str:
    """The libraries as a module's text."""
    return f"{read_text(VENDOR)}\nglobalThis.viewsphereVendor = viewsphereVendor;"


def _filled(title: str, data: Mapping[str, Any], parts: Mapping[str, str]) -> str:
    licenses = read_text(WEB / "vendor" / "LICENSES.txt")
    parts = {**parts, "title": html.escape(title), "licenses": html.escape(licenses), "data": script_json(data)}
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], read_text(WEB / "page.html"))


def script_json(value: object) -> str:
    """JSON that is safe in a script element: no text in it can end the element or begin a comment."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _modules(folder: Path, name: str) -> dict[str, str]:
    """A folder's modules as data URLs, by the names under which they import one another."""
    files = (file for file in sorted(folder.rglob("*.js")) if VENDOR.parent not in file.parents)
    return {f"{name}/{file.relative_to(folder).as_posix()}": _data_url(read_bytes(file)) for file in files}


def _data_url(script: bytes) -> str:
    return "data:text/javascript;base64," + base64.b64encode(script).decode("ascii")
