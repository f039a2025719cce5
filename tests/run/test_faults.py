"""Real faults, at moments drawn with a seed: nothing that was finished is lost or torn, and the work goes on to the same bytes.

benchmarks/faults does the same many times over, and writes the table in docs/reliability.md.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from command_line import Answer
from deadline import DEADLINE
from faults import SIGNALS, WORKS, Course, Tally, finished, make_stock, recipe, small_disk, torn, undisturbed, workers_of
from small import tree_hash
from viewsphere.run.generate import generate
from viewsphere.scratch import scratch_folder
from viewsphere.store import Store

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="signals, and /proc")]

OBEDIENT = ("setpriv", "--bounding-set=-dac_override,-dac_read_search", "--inh-caps=-all")
"""Before a command: even root may not write where the mode of a folder forbids it."""


@pytest.fixture(scope="module")
def stock(tmp_path_factory):
    return make_stock(tmp_path_factory.mktemp("stock"))


@pytest.fixture(scope="module")
def whole(stock):
    """The undisturbed tree of the work "render"."""
    return undisturbed(WORKS["render"], stock).model


@pytest.fixture(scope="module")
def mounts(tmp_path_factory):
    """Skips where no file system can be mounted: containers forbid it even to root."""
    try:
        with small_disk(tmp_path_factory.mktemp("probe"), size="64k") as change:
            change(ro="")
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"mounts a file system: {error}")


@pytest.fixture(scope="module")
def obedient():
    """Words before a command that has to obey the modes of folders; skips where root cannot be made to."""
    if os.geteuid() != 0:
        return ()
    if not shutil.which("setpriv") or subprocess.run([*OBEDIENT, "true"], capture_output=True).returncode:
        pytest.skip("needs setpriv that may take rights from root")
    return OBEDIENT


@pytest.mark.parametrize("work", WORKS)
def test_kills_at_any_moment(work, stock, tmp_path):
    source = tree_hash(stock / "small")
    course = Course(WORKS[work], stock, tmp_path, random.Random(f"kills {work}"), workers=2 if work == "render" else 1)
    course.suffer(SIGNALS["SIGKILL of everything"], 1)
    course.renew()
    assert course.tally.is_good, course.tally
    assert tree_hash(stock / "small") == source


@pytest.mark.parametrize("fault", [fault for fault in SIGNALS if fault != "SIGKILL of everything"])
def test_signals_at_any_moment(fault, stock, tmp_path):
    workers = 2 if "worker" in fault else 1  # a worker costs seconds: two where one dies beside another
    course = Course(WORKS["render"], stock, tmp_path, random.Random(f"signals {fault}"), workers)
    course.suffer(SIGNALS[fault], 1)
    course.renew()
    assert course.tally.is_good, course.tally
    if fault in ("SIGTERM", "Ctrl-C", "workers SIGSTOPped, Ctrl-C"):
        assert all("stopped; " in line and "to go on" in line for line in course.tally.said), course.tally
    else:
        assert not course.tally.said


def test_several_runs_on_one_output(stock, whole, tmp_path):
    started = [WORKS["render"].start(stock, tmp_path / "out", workers=workers) for workers in (0, 0, 1)]
    said = [process.communicate(timeout=DEADLINE)[1] for process in started]
    assert [process.returncode for process in started] == [0, 0, 0], said
    assert tree_hash(tmp_path / "out") == tree_hash(whole)


@pytest.mark.parametrize("work", ["convert", "export"])
def test_two_runs_that_write_the_same_exports(work, stock, tmp_path):
    out = tmp_path / "out"
    if WORKS[work].base:
        shutil.copytree(stock / WORKS[work].base, out)
    started = [WORKS[work].start(stock, out, workers=0) for _ in range(2)]
    said = [process.communicate(timeout=DEADLINE)[1] for process in started]
    assert [process.returncode for process in started] == [0, 0], said
    assert tree_hash(out) == undisturbed(WORKS[work], stock).whole


@pytest.mark.usefixtures("mounts")
def test_little_shared_memory(stock, whole, tmp_path):
    """Workers of a container whose shared memory has 1 MB."""
    mount = 'mount -t tmpfs -o size=1m tmpfs /dev/shm && exec "$@"'
    process = WORKS["render"].start(stock, tmp_path / "out", "unshare", "-m", "sh", "-c", mount, "sh")
    said = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 0, said
    assert tree_hash(tmp_path / "out") == tree_hash(whole)


def ended(run: subprocess.Popen[str] | Answer, words: str) -> None:
    """The run ended with a mistake, in one line that has these words."""
    said = run.stderr if isinstance(run, Answer) else run.communicate(timeout=DEADLINE)[1]
    lines = [line for line in said.splitlines() if line.startswith("viewsphere: ")]
    assert run.returncode == 2, said
    assert len(lines) == 1 and words in lines[0], said
    assert "Traceback" not in said


@pytest.mark.usefixtures("mounts")
@pytest.mark.parametrize(("what", "ample"), [("size", 1 << 26), ("nr_inodes", 20_000)], ids=["bytes", "inodes"])
def test_a_full_disk(what, ample, stock, whole, tmp_path):
    """It ends among the shots, again and again, and then there is room."""
    used = {part: [path.lstat() for path in (whole / "store" / part).rglob("*")] for part in ("models", "shots")}
    taken = {
        part: sum(512 * file.st_blocks for file in files) if what == "size" else len(files) for part, files in used.items()
    }
    with small_disk(tmp_path / "disk", **{what: f"{taken['models'] + taken['shots'] * 2 // 3}"}) as change:
        out = tmp_path / "disk" / "out"
        for run in (WORKS["render"].start if what == "size" else WORKS["render"].here, WORKS["render"].here):
            ended(run(stock, out), "No space left on device; what is finished is kept")
            assert not torn(out, whole)
        there = finished(out)
        assert there
        change(**{what: f"{ample}"})
        WORKS["render"].finish(stock, out)
        assert there <= finished(out)
        assert tree_hash(out) == tree_hash(whole)


@pytest.mark.usefixtures("mounts")
def test_a_disk_that_cannot_be_written_from_the_start(stock, whole, tmp_path):
    with small_disk(tmp_path / "disk", size="64m") as change:
        change(ro="")
        ended(
            WORKS["render"].here(stock, tmp_path / "disk" / "out"),
            "expected a writable output folder, found Read-only file system",
        )
        change(rw="")
        WORKS["render"].finish(stock, tmp_path / "disk" / "out")
        assert tree_hash(tmp_path / "disk" / "out") == tree_hash(whole)


def forbid(out: Path, mode: int) -> None:
    """Set the mode of all folders, but of those that a run removes meanwhile."""
    for folder, _, _ in os.walk(out):
        with suppress(FileNotFoundError):
            Path(folder).chmod(mode)


def test_a_folder_that_cannot_be_written_any_more(obedient, stock, whole, tmp_path):
    out = tmp_path / "out"
    process = WORKS["render"].start(stock, out, *obedient, workers=1)
    end = time.monotonic() + DEADLINE
    while len(finished(out)) < 2 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    there = finished(out)
    forbid(out, 0o555)
    ended(process, "Permission denied; what is finished is kept")
    assert there <= finished(out)
    process = WORKS["render"].start(stock, out, *obedient, workers=0)
    ended(process, "expected a writable output folder, found one that cannot be written")
    forbid(out, 0o755)
    assert not torn(out, whole)
    WORKS["render"].finish(stock, out)
    assert tree_hash(out) == tree_hash(whole)


def test_clocks_that_jump(stock, whole, tmp_path, monkeypatch):
    """By years, forth and back, while others are at work; and files of a time to come."""
    store, now, rng = Store(tmp_path / "out"), time.time, random.Random(5)
    monkeypatch.setattr(time, "time", lambda: now() + rng.uniform(-1e8, 1e8))

    def jump(progress):
        for path in store.folder.rglob("*"):
            moment = now() + rng.uniform(-1e8, 1e8)
            os.utime(path, (moment, moment))

    (store.folder / "writing").mkdir(parents=True)
    with scratch_folder(store.folder / "writing") as others:
        (others / "half").write_text("half")
        generate(recipe(), store.root, listener=jump)
        assert (others / "half").is_file()
    generate(recipe(), store.root)
    assert tree_hash(store.root) == tree_hash(whole)


WORKING = """
import time
from multiprocessing import get_context
worker = get_context("spawn").Process(target=time.sleep, args=(600,))
worker.start()
worker.join()
print(worker.exitcode)
"""


def test_faults_that_hit_nothing_do_not_count():
    """A run that has ended; and workers are waited for."""
    for fault in SIGNALS.values():
        process = subprocess.Popen(["true"], stderr=subprocess.PIPE, text=True, start_new_session=True)
        process.wait(DEADLINE)
        tally = Tally()
        tally.add(process, fault(process))
        assert tally.times == 0
    process = subprocess.Popen([sys.executable, "-c", WORKING], stdout=subprocess.PIPE, text=True)
    assert SIGNALS["SIGKILL of a worker"](process)
    assert process.communicate(timeout=DEADLINE)[0] == "-9\n"


def test_a_worker_that_ends_while_it_is_looked_at_is_left_out(tmp_path):
    for number, words in ((5, b"python\0-c\0spawn_main()"), (6, b"python\0-c\0other()")):
        process = tmp_path / f"{number}"
        process.mkdir()
        (process / "stat").write_text(f"{number} (a (b) c) S 1 2 3")
        (process / "cmdline").write_bytes(words)
    (tmp_path / "7").mkdir()
    assert workers_of(1, tmp_path) == [5]
    assert workers_of(2, tmp_path) == []


def test_a_tally_knows_bad_from_good(stock, whole, tmp_path):
    """What the other tests rest upon: each kind of loss is seen."""
    assert Tally().is_good and not Tally(lost=1).is_good
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    assert not torn(out, whole)
    half = next(out.glob("store/shots/*/*/depth/*"))
    half.write_bytes(half.read_bytes()[:-1])
    next(out.glob("coco/annotations/*")).write_text("{")
    (out / "store" / "plan.json").write_text("{")
    (out / f"{out.name}~").mkdir()
    assert len(torn(out, whole)) == 4
