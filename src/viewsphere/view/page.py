"""The page that a server gives: the report's, with modules of its own that ask for what they show."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from viewsphere.report.page import served_page

WEB = Path(__file__).parent / "web"

VENDOR = "/vendor.js"
"""The path of the libraries."""


def live_page(title: str, data: Mapping[str, Any]) -> str:
    """The whole HTML text."""
    return served_page(title, data, WEB, VENDOR)
