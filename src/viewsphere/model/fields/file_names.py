"""Names of files and folders that are valid on every file system, so that data sets can be copied between systems."""

from __future__ import annotations

RESERVED = frozenset({"con", "prn", "aux", "nul", "conin$", "conout$"}) | {
    f"{port}{number}" for port in ("com", "lpt") for number in "0123456789¹²³"
}
"""Names that Windows gives to devices, whatever their letters' case and whatever follows a dot.

https://learn.microsoft.com/en-us/windows/win32/fileio/naming-a-file
"""


def is_reserved(name: str) -> bool:
    """Return whether Windows treats a name, with any ending, as a device."""
    return name.partition(".")[0].rstrip(" ").lower() in RESERVED
