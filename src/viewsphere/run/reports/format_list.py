"""The list of formats, with facts that help users choose a format."""

from __future__ import annotations

from dataclasses import dataclass

from viewsphere import plugins
from viewsphere.plugins.format import FormatSpec


@dataclass(frozen=True)
class Listed:
    """A format: its first sentence, the labels and passes that it always needs, its content, the tools that read it, its
    options, and whether it can be written and imported.
    """

    name: str
    summary: str
    needs: tuple[str, ...]
    holds: tuple[str, ...]
    read_by: tuple[str, ...]
    options: tuple[str, ...]
    writes: bool
    reads: bool


def listed() -> tuple[Listed, ...]:
    """Return all installed formats, sorted by name."""
    return tuple(_listed(name, spec) for name, spec in plugins.loadable(FormatSpec).items())


def _listed(name: str, spec: FormatSpec) -> Listed:
    return Listed(
        name=name,
        summary=(spec.about or "").strip().partition("\n\n")[0].replace("\n", " "),
        needs=spec.channels or (),
        holds=spec.holds,
        read_by=spec.read_by,
        options=tuple(spec.options.model_fields) if spec.options else (),
        writes=spec.writer is not None,
        reads=spec.read is not None,
    )
