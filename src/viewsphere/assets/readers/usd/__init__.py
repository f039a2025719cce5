"""USD files (usd, usda, usdc, usdz), read by the package usd-core of the extra `usd`: https://openusd.org."""

from __future__ import annotations

from importlib.util import find_spec


def is_available() -> bool:
    """Return whether the package that reads USD is installed."""
    return find_spec("pxr") is not None
