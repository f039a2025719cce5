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


def page(title: str, data: Mapping[str, Any]) -> str:
    """The whole HTML text."""
    parts = {
        "title": html.escape(title),
        "style": (WEB / "style.css").read_text("utf-8"),
        "modules": json.dumps({"imports": _modules()}),
        "vendor": VENDOR.read_text("utf-8"),
        "licenses": html.escape((WEB / "vendor" / "LICENSES.txt").read_text("utf-8")),
        "data": script_json(data),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], (WEB / "page.html").read_text("utf-8"))


def script_json(value: object) -> str:
    """JSON that is safe in a script element: no text in it can end the element or begin a comment."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _modules() -> dict[str, str]:
    """The page's own modules as data URLs, by the names under which they import one another."""
    scripts = sorted(WEB.glob("*.js"))
    return {
        f"report/{file.name}": "data:text/javascript;base64," + base64.b64encode(file.read_bytes()).decode("ascii")
        for file in scripts
    }
