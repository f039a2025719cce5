"""The page: one HTML file that holds its style, scripts, libraries, pictures and numbers, and asks nothing of a network."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

WEB = Path(__file__).parent / "web"
VENDOR = WEB / "vendor" / "vendor.min.js"


def page(title: str, data: Mapping[str, Any], own: Path | None = None) -> str:
    """The whole HTML text. `own` is a folder with a style and modules of another page, which asks its server for more than
    the data; they are called `own/<file>`, and its `main.js` begins. The libraries are its module `own/vendor.js`, which runs
    when it is asked for.
    """
    style, modules = (WEB / "style.css").read_text("utf-8"), _modules(WEB, "report")
    vendor = VENDOR.read_text("utf-8")
    if own is not None:
        style, modules = style + (own / "style.css").read_text("utf-8"), modules | _modules(own, "own")
        modules["own/vendor.js"] = _data_url(f"{vendor}\nglobalThis.viewsphereVendor = viewsphereVendor;".encode())
        vendor = ""
    parts = {
        "title": html.escape(title),
        "server": "'none'" if own is None else "'self'",
        "pictures": "" if own is None else "'self'",
        "style": style,
        "modules": json.dumps({"imports": modules}),
        "main": "report/main.js" if own is None else "own/main.js",
        "vendor": vendor,
        "licenses": html.escape((WEB / "vendor" / "LICENSES.txt").read_text("utf-8")),
        "data": script_json(data),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], (WEB / "page.html").read_text("utf-8"))


def script_json(value: object) -> str:
    """JSON that is safe in a script element: no text in it can end the element or begin a comment."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _modules(folder: Path, name: str) -> dict[str, str]:
    """A folder's modules as data URLs, by the names under which they import one another."""
    return {f"{name}/{file.name}": _data_url(file.read_bytes()) for file in sorted(folder.glob("*.js"))}


def _data_url(script: bytes) -> str:
    return "data:text/javascript;base64," + base64.b64encode(script).decode("ascii")
