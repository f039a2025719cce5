"""The activity of a run, passed on to its listener and to its heartbeat in the store."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from viewsphere.run.executors import Crew, Job, Outcome, Work
from viewsphere.run.progress import Listener, Progress
from viewsphere.store.shots.heartbeat import Pulse


def heard(pulse: Pulse, listener: Listener) -> Listener:
    """A listener that passes on what it hears, to the heartbeat first."""

    def listen(progress: Progress) -> None:
        pulse.enters(progress.phase)
        counts = {"done": progress.done, "total": progress.total, "resumed": progress.resumed}
        pulse.now = replace(pulse.now, **counts, under_way=progress.under_way)
        listener(progress)

    return listen


def watched(crew: Crew, work: Work, pulse: Pulse, heard: Callable[[], None]) -> Iterator[Outcome]:
    """Yield the outcomes of `crew.run`; meanwhile the heartbeat reports the jobs that are handed out and not done."""
    for outcome in crew.run(_Told(work, pulse.working_on), heard):
        pulse.working_on.pop(outcome.key, None)
        yield outcome


@dataclass(frozen=True)
class _Told:
    """Work whose jobs are noted when they are handed out."""

    work: Work
    working_on: dict[str, None]

    def lines(self) -> Iterable[tuple[str, int]]:
        """Return the lines of the work."""
        return self.work.lines()

    def jobs(self, line: str) -> Iterator[Job]:
        """Yield the jobs of a line of the work."""
        for job in self.work.jobs(line):
            self.working_on[job.key] = None
            yield job
