"""The executor for a Ray cluster: an actor on each CPU, which does one job at a time. No other module uses Ray.

Every actor is bound to a machine. This identifies the machine that lost a job, and machines that cannot be used. Ray's own
retries are off: a lost job is handed out again, as in `local`.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viewsphere.errors import MissingExtraError, StoreError, UserError, ViewsphereError
from viewsphere.run.executors._jobs import Job, Outcome, Queue, Work, answer, ignored

try:
    import ray
    from ray.exceptions import RayError, RayTaskError
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy
except ImportError:
    raise MissingExtraError("--ray: expected the package ray, found none: pip install 'viewsphere[ray]'") from None

if TYPE_CHECKING:
    from viewsphere.planning.extension import DatasetPart
    from viewsphere.run.shots.tasks import Worker

TICK = 1.0
"""Seconds between two checks of the available machines and of the workers' progress."""

STARTS = 3
"""Number of workers in a row that may die at their start before their machine is left out."""

CALLS = 3
"""Number of attempts to reach a cluster whose port is open; a busy cluster may be too slow for the first."""

GRACE = 10.0
"""Seconds for a cluster to answer when a run begins, and for its workers to be gone when the run ends."""

OF_A_MACHINE = frozenset({"VIEWSPHERE_CACHE", "VIEWSPHERE_BLENDER_PYTHON"})
"""Environment variables with paths that are valid on one machine only."""


class RayPool:
    """Workers on at most the given number of a cluster's CPUs, on all if 0; machines that join later also get workers."""

    def __init__(self, root: Path, portion: DatasetPart, most: int, address: str) -> None:
        if address != "auto" and ":" not in address:
            raise UserError(f"--ray: expected auto, HOST:PORT or ray://HOST:PORT; found {address!r}")
        self._root = root.absolute()
        self._portion = portion
        self._most = most
        self._address = address
        self._begun: dict[str, int] = {}
        self._pool: list[_Worker] = []
        self._failures: Counter[str] = Counter()
        self._unfit: dict[str, str] = {}
        self._looked = 0.0

    def __enter__(self) -> RayPool:
        self._connected_here = not ray.is_initialized()
        if self._connected_here:
            _connect(self._address)
        self._shared = ray.put((self._root, self._portion, os.getcwd(), _settings()))  # noqa: PTH109, pickled
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(RayError, ConnectionError):  # a cluster that is gone has no workers left
            for worker in self._pool:
                ray.kill(worker.actor)
            refs = [worker.ref for worker in self._pool]
            if refs:
                ray.wait(refs, num_returns=len(refs), timeout=GRACE)
        self._pool.clear()
        if self._connected_here:
            ray.shutdown()

    @property
    def under_way(self) -> int:
        """See `WorkerPool`."""
        return sum(self._begun.values())

    @property
    def nodes(self) -> int:
        """See `WorkerPool`."""
        return len({worker.node for worker in self._pool if worker.is_ready})

    @property
    def notes(self) -> tuple[str, ...]:
        """The machines that were left out, with the reasons."""
        return tuple(f"left out {why}" for why in self._unfit.values())

    def run(self, work: Work, report: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Like `WorkerPool.run`; `report` is called from time to time. Raises ViewsphereError if the cluster is gone."""
        try:
            yield from self._run(work, report)
        except ConnectionError as error:
            raise ViewsphereError(
                f"--ray {self._address}: expected a Ray cluster, found it gone: {_first_line(error)}"
            ) from None

    def _run(self, work: Work, report: Callable[[], None]) -> Iterator[Outcome]:
        queue = Queue(work, [worker.line for worker in self._pool])
        self._looked = 0.0
        while True:
            for worker in [worker for worker in self._pool if worker.is_idle and worker.line in queue]:
                self._give(worker, queue)
            for worker in [worker for worker in self._pool if worker.is_idle]:
                self._give(worker, queue)
            if queue.is_done and not any(worker.job for worker in self._pool):
                return
            if time.monotonic() - self._looked > TICK:
                self._look(queue.left)
                report()
            for worker in self._answering():
                yield from self._receive(worker, queue)

    def _give(self, worker: _Worker, queue: Queue) -> None:
        job = queue.next(worker.line)
        if job is None and not any(other.job for other in self._pool if other.node == worker.node):
            job = queue.last()
        if job is not None:
            worker.give(job)

    def _look(self, left: int) -> None:
        """Query the workers' progress, and start workers on free CPUs, but no more than there are jobs left."""
        self._looked = time.monotonic()
        for worker in self._pool:
            worker.ask()
        for worker in _ready([worker for worker in self._pool if worker.asked is not None], "asked"):
            key, frames = worker.answer()
            if worker.job is not None and worker.job.key == key:
                self._begun[key] = frames
        there = _nodes()
        nodes = {node: about for node, about in there.items() if node not in self._unfit}
        if there and not nodes and not self._pool:
            raise ViewsphereError("\n".join(self._unfit[node] for node in there))
        taken = Counter(worker.node for worker in self._pool)
        places = [(i, node) for node, (_, cpus) in nodes.items() for i in range(taken[node], cpus)]
        wanted = left - sum(not worker.is_ready for worker in self._pool)
        if self._most:
            wanted = min(wanted, self._most - len(self._pool))
        for _, node in sorted(places)[: max(wanted, 0)]:  # alternating between machines
            self._pool.append(_Worker(node, nodes[node][0], self._shared))

    def _answering(self) -> list[_Worker]:
        """Return the workers with an answer, and the dead ones; waits briefly for the first."""
        awaited = [worker for worker in self._pool if not worker.is_idle]
        if not awaited:
            time.sleep(TICK)  # until a machine joins
        return _ready(awaited, "ref", TICK)

    def _receive(self, worker: _Worker, queue: Queue) -> Iterator[Outcome]:
        """Receive one answer, or handle a worker's death."""
        job, worker.job = worker.job, None
        if job is not None:
            self._begun.pop(job.key, None)
        try:
            news: Outcome | str = ray.get(worker.ref)
        except RayError as error:
            self._lose(worker)
            if job is None:
                self._suspect(worker, error)
            elif told := queue.again(
                job, f"last on node {worker.address}: {_first_line(error)}", alone=worker.node in _nodes()
            ):
                yield told
            return
        if job is None:
            worker.is_ready = True
            self._failures[worker.node] = 0
        elif isinstance(news, str):
            raise ViewsphereError(f"{job.key}: a worker failed\n{news}")
        else:
            queue.ended()
            yield news

    def _lose(self, worker: _Worker) -> None:
        """Give up a worker that is gone or unreachable."""
        self._pool.remove(worker)
        with suppress(RayError):
            ray.kill(worker.actor)

    def _suspect(self, worker: _Worker, error: RayError) -> None:
        """Leave out a machine that is available but on which workers cannot start."""
        if worker.node not in _nodes():
            return
        self._failures[worker.node] += 1
        if isinstance(error, RayTaskError) or self._failures[worker.node] >= STARTS:
            self._unfit[worker.node] = f"node {worker.address}: {_first_line(error)}"


class _Worker:
    """This process's handle for one worker; `ref` is its next answer, at first that it is ready."""

    def __init__(self, node: str, address: str, shared: Any) -> None:
        self.node, self.address = node, address
        self.actor: Any = _ACTOR.options(scheduling_strategy=NodeAffinitySchedulingStrategy(node, soft=False)).remote(shared)
        self.ref: Any = self.actor.ready.remote()
        self.asked: Any = None
        self.is_ready = False
        self.line = ""
        self.job: Job | None = None

    @property
    def is_idle(self) -> bool:
        """Return whether it has started and has no job."""
        return self.job is None and self.is_ready

    def give(self, job: Job) -> None:
        """Give it a job."""
        self.job, self.line = job, job.line
        self.ref = self.actor.do.remote(job)

    def ask(self) -> None:
        """Query its progress with its job, unless the last query has no answer yet."""
        if self.job is not None and self.asked is None:
            self.asked = self.actor.begun.remote()

    def answer(self) -> tuple[str, int]:
        """Return the worker's answer: the key of a job, and the number of its finished frames."""
        ref, self.asked = self.asked, None
        try:
            return ray.get(ref)
        except RayError:  # its death is reported with its job
            return "", 0


class _Actor:
    """A worker, on a machine of the cluster."""

    def __init__(self, shared: tuple[Path, DatasetPart, str, dict[str, str]]) -> None:
        self._root, self._portion, self._folder, self._settings = shared
        self._key, self._frames = "", 0
        self._worker: Worker | None = None
        self._is_compiled = False

    def ready(self) -> None:
        """Start. Raises StoreError for a machine without the data set, or whose viewsphere would render a
        different data set.
        """
        from viewsphere.run.opening import check_whether_same
        from viewsphere.run.shots.tasks import Worker
        from viewsphere.run.workers.allocator import keep_freed_memory
        from viewsphere.store import Store

        with suppress(OSError):  # a folder of the machine that began the run; names of files may count from it
            os.chdir(self._folder)
        os.environ.update(self._settings)
        store = Store(self._root)
        if not store.plan_file.is_file():
            raise StoreError(f"{self._root}: expected a folder that all machines of the cluster share; found none here")
        check_whether_same(store, self._portion.part)
        store.make_ready()  # clears what dead workers of this machine left
        keep_freed_memory()
        self._worker = Worker(self._root, self._portion)

    def do(self, job: Job) -> Outcome | str:
        """Do a job; if a machine has no kernels yet, one of its workers compiles them."""
        from viewsphere.store import Row

        assert self._worker is not None
        self._key, self._frames = job.key, 0
        if isinstance(job.task, Row) and not self._is_compiled:
            with suppress(UserError):  # which the job itself reports
                self._worker.compile_for(job.task)
            self._is_compiled = True
        return answer(self._worker, job, self._count)

    def _count(self, frames: int) -> None:
        self._frames = frames

    @ray.method(concurrency_group="asking")
    def begun(self) -> tuple[str, int]:
        """Return the progress: the key of the current job, and the number of its finished frames."""
        return self._key, self._frames


_remote: Any = ray.remote  # its types lack concurrency groups
_ACTOR: Any = _remote(num_cpus=1, max_restarts=0, max_task_retries=0, concurrency_groups={"asking": 1})(_Actor)


def _connect(address: str) -> None:
    """Connect to a cluster. Raises UserError if no cluster answers, MissingExtraError if a part of Ray is not installed."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        if address != "auto":
            _reach(address)
        for left in reversed(range(CALLS)):
            try:
                with warnings.catch_warnings(action="ignore"):  # about future changes in Ray
                    ray.init(address, log_to_driver=False, logging_level=logging.ERROR)
                return
            except ConnectionError:
                if not left:
                    raise
                ray.shutdown()
    except ImportError as error:
        raise MissingExtraError(f"--ray {address}: {_first_line(error)}: pip install 'viewsphere[ray]'") from None
    except (OSError, OverflowError, RuntimeError, ValueError, RayError) as error:
        raise UserError(
            f"--ray {address}: expected a Ray cluster that answers; found: {_first_line(error)}: start one with "
            "`ray start --head`, or check the address"
        ) from None
    finally:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, before)  # Ray puts its own in its place


def _reach(address: str) -> None:
    """Raise OSError, OverflowError or ValueError if no server listens there, which Ray itself would not notice for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    socket.create_connection((host.strip("[]"), int(port)), timeout=GRACE).close()


def _nodes() -> dict[str, tuple[str, int]]:
    """The address and the number of CPUs of each machine of the cluster with CPUs, by its id."""
    found = ((node, int(node["Resources"].get("CPU", 0))) for node in ray.nodes() if node["Alive"])
    return {node["NodeID"]: (str(node["NodeManagerAddress"]), cpus) for node, cpus in found if cpus}


def _ready(workers: list[_Worker], which: str, seconds: float = 0.0) -> list[_Worker]:
    """Return the workers whose answer has arrived; waits up to this many seconds for the first answer."""
    worker_of = {getattr(worker, which): worker for worker in workers}
    if not worker_of:
        return []
    refs = list(worker_of)
    if seconds:
        ray.wait(refs, num_returns=1, timeout=seconds)
    found, _ = ray.wait(refs, num_returns=len(refs), timeout=0)
    return [worker_of[ref] for ref in found]


def _settings() -> dict[str, str]:
    """Return the user's settings from environment variables: limits, scripts, durability."""
    return {name: value for name, value in os.environ.items() if name.startswith("VIEWSPHERE_") and name not in OF_A_MACHINE}


def _first_line(error: BaseException) -> str:
    """The first line of an error, or of the error that Ray wraps. If it ends with a colon, the last line is added."""
    cause = getattr(error, "cause", None)
    lines = [line.strip() for line in str(cause if isinstance(cause, Exception) else error).splitlines() if line.strip()]
    if not lines:
        return type(error).__name__
    return f"{lines[0]} {lines[-1]}" if lines[0].endswith(":") else lines[0].rstrip(".")
