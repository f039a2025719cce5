"""A large run, simulated: workers of a cluster take shots, upload them, die with their nodes and come back.

Events are the only moments at which anything changes (discrete-event simulation). Three things are taken in turns by all
workers: the one process that hands out shots, the store's requests and its bytes a second; a worker that has made a shot waits
until the shot is stored before it takes the next one.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

LOOKED_AHEAD = 65_536
"""The number of random numbers drawn at a time."""


@dataclass(frozen=True)
class Load:
    """The work: so many shots, of `frames` each, whose `seconds` on one core are drawn from those measured. Each
    is stored as so many `objects` of together so many `bytes`.
    """

    shots: int
    frames: float
    seconds: Sequence[float]
    objects: float
    bytes: float

    @property
    def core_hours(self) -> float:
        """The hours that the shots take on one core that never fails."""
        return self.shots * sum(self.seconds) / len(self.seconds) / 3600


@dataclass(frozen=True)
class Cluster:
    """Nodes with `cores` workers each, and what they share.

    A worker takes `start_s` seconds to be ready. A node fails once in `mtbf_h` hours in the mean (exponentially distributed)
    and is back after `repair_s`. A share `slow` of the nodes takes `slow_factor` times as long. One shot is handed out each
    `handout_s`; the store takes so many requests and bytes a second.
    """

    nodes: int
    cores: int = 16
    start_s: float = 0.0
    mtbf_h: float = math.inf
    repair_s: float = 0.0
    slow: float = 0.0
    slow_factor: float = 1.0
    handout_s: float = 0.0
    requests_per_s: float = math.inf
    bytes_per_s: float = math.inf


@dataclass(frozen=True)
class Outcome:
    """The outcome of a run: its makespan in seconds; shots finished and lost (made again); the seconds for which workers made
    shots that were finished; the core seconds there were.
    """

    makespan: float
    finished: int
    lost: int
    useful: float
    available: float

    @property
    def efficiency(self) -> float:
        """The useful share of the core seconds that there were."""
        return self.useful / self.available


def simulate(load: Load, cluster: Cluster, seed: int = 0) -> Outcome:
    """One run of a load on a cluster; the same for the same seed."""
    return _Run(load, cluster, np.random.default_rng(seed)).outcome()


IDLE, MADE, STORED, FAILED = range(4)
"""The events: a worker requests a shot, has made it, has it stored; a node fails."""


class _Run:
    """The state of a run between two events; an event is (second, number, what, worker or node, life of the node)."""

    def __init__(self, load: Load, cluster: Cluster, rng: np.random.Generator) -> None:
        self.load, self.cluster, self.rng = load, cluster, rng
        slow = round(cluster.slow * cluster.nodes)
        self.factors = [cluster.slow_factor] * slow + [1.0] * (cluster.nodes - slow)
        self.seconds = self._drawn(np.asarray(load.seconds, float))
        self.storing = max(load.objects / cluster.requests_per_s, load.bytes / cluster.bytes_per_s)
        self.events: list[tuple[float, int, int, int, int]] = []
        self.lives = [0] * cluster.nodes
        self.at_work: dict[int, float] = {}
        self.waiting: list[int] = []
        self.left, self.finished, self.lost, self.useful = load.shots, 0, 0, 0.0
        self.now = self.handing = self.store = 0.0
        self.number = 0

    def outcome(self) -> Outcome:
        """Let everything happen until all shots are stored."""
        cluster = self.cluster
        for node in range(cluster.nodes):
            self._fail_later(node)
        for core in range(cluster.cores):  # nodes in turns
            for node in range(cluster.nodes):
                self._plan(cluster.start_s, IDLE, node * cluster.cores + core)
        while self.finished < self.load.shots:
            self.now, _, what, who, life = heapq.heappop(self.events)
            if what == FAILED:
                self._fail(who)
            elif life == self.lives[who // cluster.cores]:
                (self._hand_out, self._store, self._finish)[what](who)
        return Outcome(self.now, self.finished, self.lost, self.useful, self.now * cluster.nodes * cluster.cores)

    def _drawn(self, seconds: np.ndarray) -> Iterator[float]:
        while True:
            yield from self.rng.choice(seconds, LOOKED_AHEAD).tolist()

    def _plan(self, second: float, what: int, worker: int) -> None:
        self.number += 1
        heapq.heappush(self.events, (second, self.number, what, worker, self.lives[worker // self.cluster.cores]))

    def _hand_out(self, worker: int) -> None:
        if not self.left:
            self.waiting.append(worker)
            return
        self.left -= 1
        self.handing = max(self.handing, self.now) + self.cluster.handout_s
        taken = next(self.seconds) * self.factors[worker // self.cluster.cores]
        self.at_work[worker] = taken
        self._plan(self.handing + taken, MADE, worker)

    def _store(self, worker: int) -> None:
        self.store = max(self.store, self.now) + self.storing
        self._plan(self.store, STORED, worker)

    def _finish(self, worker: int) -> None:
        self.finished += 1
        self.useful += self.at_work.pop(worker)
        self._hand_out(worker)

    def _fail_later(self, node: int) -> None:
        if math.isfinite(self.cluster.mtbf_h):
            self.number += 1
            second = self.now + self.rng.exponential(self.cluster.mtbf_h * 3600)
            heapq.heappush(self.events, (second, self.number, FAILED, node, 0))

    def _fail(self, node: int) -> None:
        """All workers of a node lose what they are at, and come back later."""
        self.lives[node] += 1
        own = range(node * self.cluster.cores, (node + 1) * self.cluster.cores)
        self.waiting = [worker for worker in self.waiting if worker not in own]
        back = self.now + self.cluster.repair_s + self.cluster.start_s
        for worker in own:
            if self.at_work.pop(worker, None) is not None:
                self.lost += 1
                self.left += 1
            self._plan(back, IDLE, worker)
        for _ in range(min(self.left, len(self.waiting))):
            self._plan(self.now, IDLE, self.waiting.pop())
        self._fail_later(node)
