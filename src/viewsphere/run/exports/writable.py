"""The formats for writing data sets."""

from __future__ import annotations

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.validation.errors import one_of


def writable_formats() -> tuple[str, ...]:
    """Names of the formats that can be written; other formats are only read."""
    return tuple(name for name, spec in plugins.loadable(FormatSpec).items() if spec.writer)


def writable(name: str, field: str = "format") -> FormatSpec:
    """The format of this name. Raises UserError for a format that does not work here, and, as an error of `field`, for a format
    that is unknown or only read.
    """
    spec = plugins.load(FormatSpec, name) if name in plugins.names("formats") else None
    if spec is None or spec.writer is None:
        raise UserError(f"{field}: {one_of(name, writable_formats())}")
    if spec.check is not None:
        spec.check()
    return spec
