"""The result of `check`: findings, the proofs that ran, and those that did not, with the reason."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from viewsphere.validation.quantity import quantity


@dataclass(frozen=True)
class Finding:
    """A contradiction or damage; `frame` is the frame's index in the plan, None for the data set as a whole."""

    check: str
    frame: int | None
    message: str

    def __str__(self) -> str:
        where = "" if self.frame is None else f"frame {self.frame}: "
        return f"{self.check}: {where}{self.message}"


@dataclass(frozen=True)
class Report:
    """The outcome of all proofs.

    `checked` counts the frames, files or models in each proof. `not_run` gives the reason why a proof did not run, or ran only
    on a part. `coverage` has (proved, of, words) for proofs that check only some frames. `notes` are remarks on the data.
    """

    checked: dict[str, int]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...] = ()
    not_run: dict[str, str] = field(default_factory=dict[str, str])
    coverage: tuple[tuple[int, int, str], ...] = ()

    @property
    def ok(self) -> bool:
        """Return whether there is no finding."""
        return not self.findings

    @property
    def verdict(self) -> str:
        """One line: the number of findings, or of proofs that hold, with the proofs that did not run and the frames covered."""
        held = [name for name, count in self.checked.items() if count and name not in self.not_run]
        text = f"{quantity(len(held), 'proof')} hold{'s' if len(held) == 1 else ''}" if self.not_run else "all proofs hold"
        if not self.ok:
            text = quantity(len(self.findings), "finding")
        parts = [text, *([f"{len(self.not_run)} not run: {_reasons(self.not_run)}"] if self.not_run else [])]
        return "; ".join([", ".join(parts), *(f"{done:,} of {of:,} {words}" for done, of, words in self.coverage)])

    def to_json(self) -> dict[str, Any]:
        """The report as plain data."""
        return {"ok": self.ok, "verdict": self.verdict, **asdict(self)}


def joined(reports: Iterable[Report]) -> Report:
    """Reports of several parts of one data set as one."""
    checked, not_run = dict[str, int](), dict[str, str]()
    findings, notes = list[Finding](), list[str]()
    for report in reports:
        checked |= {name: checked.get(name, 0) + count for name, count in report.checked.items()}
        not_run |= {name: reason for name, reason in report.not_run.items() if name not in not_run}
        findings += report.findings
        notes += (note for note in report.notes if note not in notes)
    return Report(checked, tuple(findings), tuple(notes), not_run)


def in_short(reasons: Iterable[str]) -> str:
    """The first of several reasons, each once, and the number of others."""
    first, *others = dict.fromkeys(reasons) or ("",)
    return f"{first}; and {len(others):,} more" if others else first


def _reasons(not_run: Mapping[str, str]) -> str:
    """Names of proofs, grouped by reason, with each reason in parentheses."""
    names_of: dict[str, list[str]] = {}
    for name, reason in not_run.items():
        names_of.setdefault(reason, []).append(name)
    return ", ".join(f"{', '.join(names)} ({reason})" for reason, names in names_of.items())
