"""Output for the user: progress, summaries, errors; and files that commands write besides data sets."""

from __future__ import annotations

import math
import os
import sys
import time
from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from viewsphere.errors import UserError, ViewsphereError
from viewsphere.kernels.garbage import importing
from viewsphere.printable import printable
from viewsphere.scratch import write_whole
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.check import Report
    from viewsphere.planning.plan import Plan
    from viewsphere.run.estimate import Estimate
    from viewsphere.run.generate import Summary, Warnings
    from viewsphere.run.progress import Listener, Progress
    from viewsphere.run.reports.format_list import Listed
    from viewsphere.run.reports.plugin_list import Installed
    from viewsphere.run.status import Status
    from viewsphere.store.shots.heartbeat import Heartbeat

MOST_FINDINGS = 20
"""Largest number of lines of findings; `--json` lists all."""

CLOSED = 141
"""Exit status of a command whose output has no reader any more, as for SIGPIPE in a shell."""


def say(line: str, *, err: bool = False) -> None:
    """Print a line, its control characters escaped; all commands print through it.

    Raises UserError if the output accepts no more, as on a full disk; ends quietly if its reader has ended.
    """
    try:
        typer.echo(printable(line), err=err)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2 if err else 1)  # Python writes the rest of its buffer at its end
        if isinstance(error, BrokenPipeError):
            sys.exit(CLOSED)
        stream = "standard error" if err else "standard output"
        raise UserError(f"{stream}: expected a place to write, found: {error.strerror or error}. Free some space") from None


def complain(error: ViewsphereError, status: int) -> None:
    """Print an error, one line for each problem, and exit with this status."""
    with suppress(UserError):  # a standard error that takes nothing
        for line in str(error).split("\n"):
            say(f"viewsphere: {line}", err=True)
    sys.exit(status)


def write_picture(file: Path, picture: Any) -> None:
    """Write (H, W, 3) uint8 as PNG; UserError for a file of another ending."""
    _check_picture(file)
    from viewsphere.codecs.png_tiff import encode_png

    write_whole(file, encode_png(picture))


def _check_picture(file: Path) -> None:
    """Raise UserError for a file name without the ending of a PNG."""
    if file.suffix.lower() != ".png":
        raise UserError(f"--output: expected a picture that ends in .png; found {file}: {file.with_suffix('.png')}?")


def print_json(value: object) -> None:
    """Print a value as JSON, for scripts."""
    import json

    for line in json.dumps(value, indent=2).replace("\x7f", "\\u007f").split("\n"):
        say(line)


def print_plan(planned: Plan) -> None:
    """Print the counts of a plan, and its warnings."""
    splits = ", ".join(f"{name} {count:,}" for name, count in planned.split_counts.items())
    say(f"{planned.recipe.name}: {planned.factors} = {quantity(planned.frames, 'frame')} ({splits})")
    for warning in planned.warnings:
        say(f"warning: {warning}", err=True)


def print_estimate(cost: Estimate) -> None:
    """Print the estimated time and size of a whole data set."""
    crew = f"{cost.workers} worker{'s' if cost.workers > 1 else ''}"
    say(f"about {_duration(cost.seconds)} with {crew}, {_size(cost.bytes)} on disk")
    if cost.unused:
        say(f"note: {cost.unused}")


def _duration(seconds: float) -> str:
    """A duration in at most two units: 40 s, 12 min, 6 h 20 min, 3 d 4 h."""
    if seconds < 90:
        return f"{math.ceil(seconds)} s"
    minutes = round(seconds / 60)
    hours, minutes = divmod(minutes, 60)
    days, rest = divmod(hours, 24)
    if days:
        return f"{days} d {rest} h"
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def _size(count: float) -> str:
    """A size in bytes, in decimal units, as on disks: 45 GB, 1.3 GB, 320 MB."""
    unit, name = (1e9, "GB") if count >= 1e9 else (1e6, "MB")
    return f"{count / unit:.1f} {name}" if 1e9 <= count < 1e10 else f"{math.ceil(count / unit)} {name}"


def print_report(report: Report, repaired: Sequence[str] = ()) -> None:
    """Print the outcome of `check`, after a line for each repair."""
    for line in repaired:
        say(f"repaired: {line}")
    failed = Counter(finding.check for finding in report.findings)
    for name, count in report.checked.items():
        outcome = quantity(failed[name], "finding") if failed[name] else "ok"
        say(f"{name:17} {outcome:14} {count:,} checked")
    for name, reason in report.not_run.items():
        say(f"not run: {name}: {reason}")
    for note in report.notes:
        say(f"note: {note}")
    for finding in report.findings[:MOST_FINDINGS]:
        say(f"failed: {finding}", err=True)
    if len(report.findings) > MOST_FINDINGS:
        say(f"and {quantity(len(report.findings) - MOST_FINDINGS, 'finding')} more; --json lists all", err=True)
    say(report.verdict)


def _print_warnings(warnings: Warnings) -> None:
    """Print warnings; one that several models or files share is printed once."""
    lines = [*_shared("file", warnings.files), *_shared("model", warnings.models)]
    for line in lines[:MOST_FINDINGS]:
        say(f"warning: {line}", err=True)
    if len(lines) > MOST_FINDINGS:
        say(f"and {quantity(len(lines) - MOST_FINDINGS, 'warning')} more; --json lists all", err=True)


def _shared(what: str, warnings: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Each warning once, after the names that it is about."""
    keys_of: dict[str, list[str]] = {}
    for key, messages in warnings.items():
        for warning in messages:
            keys_of.setdefault(warning, []).append(key)
    for warning, (key, *others) in keys_of.items():
        more = f" and {len(others):,} more" if others else ""
        yield f"{what} {key}{more}: {warning.removeprefix(f'{key}: ')}"


def print_summary(summary: Summary, as_json: bool) -> None:
    """Print the summary of a run."""
    if as_json:
        print_json({**asdict(summary), "root": str(summary.root)})
        return
    for key, why in summary.skipped.items():
        say(f"left out {key}: {why}", err=True)
    _print_warnings(summary.warnings)
    for note in summary.notes:
        say(note)
    rate = f" at {_rate(summary.rendered, summary.seconds)}, models and formats included" if summary.rendered else ""
    formats = ", ".join(summary.formats) or "no format asked for"
    say(f"{summary.root}: {quantity(summary.frames, 'frame')} ({summary.rendered:,} new{rate}); {formats}")


def print_formats(found: Sequence[Listed]) -> None:
    """Print a paragraph for each format."""
    for format_ in found:
        does = " and ".join(word for word, can in (("written", format_.writes), ("imported", format_.reads)) if can)
        say(f"{format_.name} ({does}): {format_.summary}")
        options = tuple(f"{format_.name}.{name}" for name in format_.options)
        parts = (("holds", format_.holds), ("needs", format_.needs), ("read by", format_.read_by), ("options", options))
        for what, names in parts:
            if names:
                say(f"    {what}: {', '.join(names)}")


def print_plugins(found: Sequence[Installed]) -> None:
    """Print the plug-ins of each kind and distribution in a paragraph, and those that cannot be loaded, a line each."""
    for kind in dict.fromkeys(plugin.kind for plugin in found):
        say(f"{kind}:")
        working = [plugin for plugin in found if plugin.kind == kind and plugin.error is None]
        for distribution in dict.fromkeys(plugin.distribution for plugin in working):
            listed = ", ".join(plugin.name for plugin in working if plugin.distribution == distribution)
            say(f"    {distribution}: {listed}")
        for plugin in found:
            if plugin.kind == kind and plugin.error is not None:
                say(f"    {plugin.distribution}: {plugin.name} cannot be loaded:")
                for line in plugin.error.splitlines():
                    say(f"        {line}")


def print_status(found: Status) -> None:
    """Print the progress of a data set, and the active runs."""
    counts = f"{found.finished:,} finished, {found.under_way:,} under way, {found.left_out:,} left out"
    waiting = found.missing - found.under_way
    say(f"{found.root}: {quantity(found.frames, 'frame')}: {counts}, {waiting:,} missing{_share_done(found)}")
    if found.models:
        say(f"models to be made: {_some(found.models)}")
    for run in found.runs:
        what = run.told.phase
        if run.told.total:
            what += f" {run.told.done + run.told.under_way:,} of {run.told.total:,}"
        rate = f", {_rate(1, 1 / run.told.rate)}" if run.told.rate and run.state == "running" else ""
        shots = f"; {_some(run.told.working_on)}" if run.told.working_on else ""
        gone = "" if run.state == "running" or found.complete else ": run it again"
        heard = f"heard of {_duration(run.seconds_ago)} ago"
        say(f"{run.state}: {_who(run.told)}: {what}{rate}, {heard}{shots}{gone}")
    for failure in found.failed:
        say(f"failed: {_who(failure)}: {failure.error}")
    if found.seconds_left is not None:
        say(f"{_rate(1, 1 / found.rate)}, about {_duration(found.seconds_left)} left")


def _some(names: Sequence[str]) -> str:
    """The first few names, and the number of the others."""
    left = len(names) - MOST_FINDINGS
    return ", ".join(names[:MOST_FINDINGS]) + (f" and {left:,} more" if left > 0 else "")


def _share_done(found: Status) -> str:
    return f" ({found.finished / found.frames:.1%} done)" if found.frames else ""


def _who(told: Heartbeat) -> str:
    """A run by its machine and process, and by its shard if it has one."""
    number, of = told.shard
    return f"{told.host} (pid {told.pid})" + (f", shard {number}/{of}" if of > 1 else "")


def _rate(frames: int, seconds: float) -> str:
    """Frames a second, with two digits if below one."""
    rate = frames / seconds
    return f"{rate:.1f} frames/s" if rate >= 1 else f"{rate:.2g} frames/s"


def _say_target() -> None:
    """Print why kernels are compiled only for this processor, if they are."""
    from viewsphere.kernels import build

    if build.TARGET.note:
        say(build.TARGET.note, err=True)


KERNELS_S = 1.5
"""Seconds between lines about kernels if no bar can be drawn."""


@contextmanager
def waiting(what: str, quiet: bool = False) -> Generator[None]:
    """Show on a terminal, below everything printed, that the program is at work, and for how long."""
    if quiet or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        shown.add_task(what, total=None)
        yield


class ProgressBar:
    """A line for each phase: work done, frames a second, time left."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._bars: dict[str, Any] = {}
        self._rich: Any = None
        self._said = 0.0

    def __enter__(self) -> ProgressBar:
        if not self._quiet:
            with importing():
                from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._rich = Progress(
                TextColumn("{task.description:8}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
            )
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Leave the terminal as it was."""
        if self._bars:
            self._rich.stop()

    @property
    def show(self) -> Listener:
        """A listener for `generate`."""

        def listen(progress: Progress) -> None:
            if self._rich is None:
                return
            if progress.phase == "kernels" and not progress.done:
                _say_target()
            if progress.phase == "kernels" and not self._rich.console.is_terminal:
                self._say_kernels(progress)
                return
            if progress.phase not in self._bars:
                self._rich.start()
                self._bars[progress.phase] = self._rich.add_task(progress.phase, total=progress.total, rate="")
            bar = self._bars[progress.phase]
            elapsed = self._rich.tasks[bar].elapsed or 0.0
            seen = progress.done + progress.under_way
            rendered = seen - progress.resumed
            rate = _rate(rendered, elapsed) if progress.phase == "frames" and rendered and elapsed else ""
            if progress.nodes is not None:
                rate = ", ".join(filter(None, (rate, f"{progress.nodes} node{'' if progress.nodes == 1 else 's'}")))
            self._rich.update(bar, completed=seen, total=progress.total, rate=rate)

        return listen

    def _say_kernels(self, progress: Progress) -> None:
        """Print a line from time to time, because compiling takes long and finishes no frames to count."""
        now = time.monotonic()
        if progress.done in (0, progress.total) or now >= self._said + KERNELS_S:
            self._said = now
            say(f"compiling kernels, once on this machine: {progress.done} of {progress.total}", err=True)
