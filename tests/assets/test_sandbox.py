"""A reader that crashes, hangs or floods the memory costs one message, and leaves nothing behind."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from deadline import DEADLINE, until
from viewsphere.assets.cache import PREFIX, cache_folder, load, load_normalised
from viewsphere.assets.mesh_file import ARRAYS
from viewsphere.assets.sandbox import server as reader_process
from viewsphere.assets.sandbox import worker as reader_program
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.assets.sandbox.server import ReaderProcess, Setting
from viewsphere.assets.sandbox.worker import Job
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.scratch import of_this_process, scratch_folder

CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 2) for z in (0, 3)) + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\n"

PATCH = """
import sys
if "-m" in sys.orig_argv and "viewsphere.assets.sandbox.worker" in sys.orig_argv:
    import viewsphere.assets.load as load
    from types import SimpleNamespace
    def read(folder):
{body}
    load._reader = lambda path: SimpleNamespace(read=read)
"""
"""A `sitecustomize` that puts another reader into the child."""


IDLE = """
import sys
if "-m" in sys.orig_argv and "viewsphere.assets.sandbox.worker" in sys.orig_argv:
    import select
    wait = select.select
    select.select = lambda *files: wait(*files[:3], min(files[3], 0.05))
"""
"""A `sitecustomize` by which a reader soon stops waiting for jobs."""

forks = pytest.mark.skipif(sys.platform != "linux", reason="a program reads one file there")


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.fixture(autouse=True)
def apart(monkeypatch, tmp_path):
    """Models are read in processes of their own, and cached below the test's folder."""
    monkeypatch.delenv(READ_HERE)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    yield
    reader_process._close_all(reader_process._idle_readers(os.getpid()), os.getpid())


@pytest.fixture
def spec(write):
    return ModelSpec(key="a", source=str(write("models/cube.obj", CUBE)), category="thing", category_id=1)


@pytest.fixture
def reader(monkeypatch, write, tmp_path):
    """Replace the child's reader by these statements."""

    def replace(*lines):
        write("patch/sitecustomize.py", PATCH.format(body="\n".join(f"        {line}" for line in lines)))
        monkeypatch.syspath_prepend(tmp_path / "patch")

    return replace


def refusal(spec):
    """The one line by which a model is refused; nothing may stay in the cache."""
    with pytest.raises(ModelError) as error:
        load_normalised(spec)
    text = str(error.value)
    assert text.startswith(spec.source + ": ")
    assert "\n" not in text
    assert list(cache_folder().iterdir()) == []
    return text.removeprefix(spec.source + ": ")


def test_apart_and_here_are_equal_bit_for_bit(spec, monkeypatch, tmp_path):
    mesh, facts = load(spec, folder=tmp_path / "one")
    monkeypatch.setenv(READ_HERE, "1")
    other, other_facts = load(spec, folder=tmp_path / "two")
    for name in ARRAYS:
        a, b = getattr(mesh, name), getattr(other, name)
        assert (a is None) == (b is None)
        assert a is None or a.tobytes() == b.tobytes()
    assert facts == other_facts
    assert (facts.format, facts.up, facts.size) == ("obj", "+y", (1, 2, 3))
    names = {tuple(sorted(p.name for p in (tmp_path / where).iterdir())) for where in ("one", "two")}
    assert len(names) == 1


def test_a_known_model_starts_no_process(spec, monkeypatch):
    first = load_normalised(spec)
    monkeypatch.setattr(subprocess, "Popen", None)
    second = load_normalised(spec)
    assert first.vertices.tobytes() == second.vertices.tobytes()


def test_a_reader_says_what_is_wrong(spec, write):
    write("models/cube.obj", CUBE + "f 1 2 99\n")
    assert refusal(spec) == "a face names vertex 99, expected 1 to 8; the file may be truncated"


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize(
    ("body", "said"),
    [
        pytest.param("import os; os.abort()", "reading it crashed (SIGABRT)", marks=pytest.mark.slow),
        ("import ctypes; ctypes.string_at(0)", "reading it crashed (SIGSEGV)"),
        pytest.param(
            "import os; os.kill(os.getpid(), 9)",
            "reads it ended unexpectedly: it was killed (SIGKILL), perhaps",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "import os; os.kill(os.getpid(), 15)", "try again with more memory free, or fewer --workers", marks=pytest.mark.slow
        ),
        pytest.param("import os; os._exit(3)", "reading it crashed (exit code 3)", marks=pytest.mark.slow),
        pytest.param("raise SystemExit('no\\nmore')", "the process that reads it failed (more)", marks=pytest.mark.slow),
        pytest.param("raise TypeError('a\\nb')", "its reader failed (TypeError: a b)", marks=pytest.mark.slow),
        pytest.param("f = lambda x: f(x) + 1; f(0)", "within one another (recursion)", marks=pytest.mark.slow),
    ],
)
def test_a_crash_costs_one_message(spec, reader, body, said):
    reader(body)
    assert said in refusal(spec)


@pytest.mark.slow
def test_an_endless_loop_is_stopped(spec, reader, monkeypatch):
    reader("while True: pass")
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_SECONDS", str(1.0))
    assert "within 1 s (limit MAX_READ_SECONDS)" in refusal(spec)


@pytest.mark.slow
def test_a_loop_that_keeps_the_interpreter_to_itself_is_stopped(spec, reader, monkeypatch):
    reader("import re; re.match(r'(a+)+b', 'a' * 60)")
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_SECONDS", "1")
    assert "within 1 s (limit MAX_READ_SECONDS)" in refusal(spec)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not enforce it")
@pytest.mark.parametrize(
    "body",
    [
        "import numpy; numpy.ones(1 << 40)",
        pytest.param("x = [bytearray(1 << 20) for _ in range(1 << 20)]", marks=pytest.mark.slow),
    ],
)
def test_a_flood_of_memory_is_stopped(spec, reader, monkeypatch, body):
    reader(body)
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_BYTES", str(1 << 30))
    assert "more than 1,073,741,824 bytes of memory (limit MAX_READ_BYTES)" in refusal(spec)


@pytest.mark.skipif(sys.platform == "win32", reason="it has no such limits")
def test_processor_time_is_bounded_by_the_cores_that_a_reader_uses(monkeypatch):
    import resource

    given: dict[int, int] = {}
    monkeypatch.setattr(resource, "setrlimit", lambda kind, limits: given.update({kind: limits[0]}))
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    seconds: list[int] = []
    for by_blender in (False, True):
        reader_program._limit(Job({}, "", 10.0, 1 << 30, by_blender))
        seconds.append(given[resource.RLIMIT_CPU])
    assert seconds == [21, 161]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not enforce it")
def test_too_little_memory_for_the_reader_itself_is_said(spec, reader, monkeypatch):
    reader("import numpy; numpy.ones(1 << 24)")
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_BYTES", str(1 << 24))
    assert "limit MAX_READ_BYTES" in refusal(spec)


def test_without_processes_the_error_says_so(spec, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    said = refusal(spec)
    assert "none can be started" in said
    assert f"{READ_HERE}=1" in said
    monkeypatch.setenv(READ_HERE, "1")
    assert len(load_normalised(spec).triangles) == 6


@pytest.mark.slow
def test_zoo_models_stay_here(spec, monkeypatch):
    monkeypatch.setattr(subprocess, "Popen", None)
    assert load_normalised(spec.model_copy(update={"source": "zoo:mug", "seed": 1})).triangles.size


@pytest.mark.slow
def test_what_was_left_behind_is_swept(spec):
    folder = cache_folder()
    killed = folder / f"{PREFIX}{of_this_process()}x"
    killed.mkdir(parents=True)
    (killed / "mesh.arrays").write_bytes(b"half")
    with scratch_folder(folder, PREFIX) as alive:
        load_normalised(spec)
        assert {p.name for p in folder.iterdir() if p.is_dir()} == {alive.name}


PARENT = """
import sys
from viewsphere.assets.cache import load_normalised
from viewsphere.model.model_spec import ModelSpec
load_normalised(ModelSpec(key="a", source=sys.argv[1], category="x", category_id=1))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(
    "how", [signal.SIGKILL, *(pytest.param(way, marks=pytest.mark.slow) for way in (signal.SIGTERM, signal.SIGINT))]
)
def test_no_child_outlives_its_parent(spec, reader, tmp_path, how):
    pid_file = tmp_path / "pid"
    reader("import os, pathlib, re", f"pathlib.Path({str(pid_file)!r}).write_text(str(os.getpid()))", "while True: pass")
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "patch")}
    parent = subprocess.Popen([sys.executable, "-c", PARENT, spec.source], env=environment, stderr=subprocess.DEVNULL)
    try:
        assert until(lambda: pid_file.exists() and pid_file.read_text())
        child = int(pid_file.read_text())
        assert alive(child)
        parent.send_signal(how)
        parent.wait(DEADLINE)
        assert until(lambda: not alive(child))
    finally:
        parent.kill()
        parent.wait()


@pytest.mark.slow
def test_a_reader_and_its_child_end_when_standard_input_does(spec, reader, tmp_path):
    pid_file = tmp_path / "pid"
    reader(
        "import os, pathlib, re",
        f"pathlib.Path({str(pid_file)!r}).write_text(str(os.getpid()))",
        "re.match(r'(a+)+b', 'a' * 60)",
    )
    job = Job(spec.model_dump(mode="json"), str(tmp_path), 2.0 * DEADLINE, 1 << 32)
    started = ReaderProcess.start(Setting.current(), tmp_path / "log.txt")
    try:
        started.process.stdin.write(job.to_json().encode() + b"\n")
        started.process.stdin.flush()
        assert until(lambda: pid_file.exists() and pid_file.read_text())
        started.process.stdin.close()
        assert started.process.wait(DEADLINE) == 1
        assert until(lambda: not alive(int(pid_file.read_text())))
    finally:
        started.close()


def waiting():
    """The readers of this process that wait for a job."""
    return reader_process._idle_readers(os.getpid())


@forks
def test_a_reader_reads_many_files(spec, write):
    load_normalised(spec)
    (kept,) = waiting()
    other = write("models/other.obj", CUBE.replace("v 1", "v 9"))
    assert load_normalised(spec.model_copy(update={"source": str(other)})).vertices.max() == 4.5
    assert waiting() == [kept]
    assert kept.process.poll() is None


STATE = """
import hashlib, os, resource, signal, sys, threading
import numpy
state = [
    *(getattr(module, "left", None) for module in (load, numpy, sys)),
    *(os.environ.get("LEFT"), os.getcwd(), os.umask(0o77), sorted(sys.modules), sys.path, sys.getrecursionlimit()),
    *(signal.getsignal(kind) for kind in (signal.SIGUSR1, signal.SIGCHLD, signal.SIGINT)),
    *(resource.getrlimit(kind) for kind in (resource.RLIMIT_NOFILE, resource.RLIMIT_AS, resource.RLIMIT_CPU)),
    *([file for file in range(64) if os.path.exists(f"/proc/self/fd/{file}")], os.readlink("/proc/self/fd/0")),
    *(numpy.geterr(), threading.active_count(), load.KNOWN, os.getpgid(0) == os.getppid()),
]
""".strip().splitlines()
"""The state that a file could leave behind for the next, as a reader sees it."""

SPOIL = """
load.left = numpy.left = sys.left = os.environ["LEFT"] = "left"
load.KNOWN = {}
os.chdir("/")
sys.path.append("/left")
sys.setrecursionlimit(400)
signal.signal(signal.SIGUSR1, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_NOFILE, (50, 50))
numpy.seterr(all="raise")
import wave
for file in range(64):
    try:
        os.write(file, b"0\\n1\\n")
    except OSError:
        pass
os.dup2(0, 40)
""".strip().splitlines()


@forks
@pytest.mark.parametrize(
    "end",
    ["os._exit(0)", *(pytest.param(end, marks=pytest.mark.slow) for end in ("raise ValueError", "os.kill(os.getpid(), 9)"))],
)
def test_a_file_leaves_nothing_for_the_next(spec, write, reader, end):
    answer = "raise ValueError(hashlib.sha256(repr(state).encode()).hexdigest())"
    reader(*STATE, "if folder.model.name == 'cube.obj':", *(f"    {line}" for line in (*SPOIL, end)), answer)
    other = spec.model_copy(update={"source": str(write("models/other.obj", CUBE))})
    before = refusal(other)
    (kept,) = waiting()
    assert "its reader failed (ValueError" in before
    assert refusal(spec) != before
    assert refusal(other) == before
    assert waiting() == [kept]


@forks
@pytest.mark.slow
def test_a_reader_that_was_killed_harms_no_other_file(spec, write):
    load_normalised(spec)
    waiting()[0].process.kill()
    waiting()[0].process.wait()
    other = write("models/other.obj", CUBE)
    assert len(load_normalised(spec.model_copy(update={"source": str(other)})).triangles) == 6


@forks
@pytest.mark.slow
def test_a_child_that_kills_its_reader_costs_one_message(spec, write, reader):
    reader("import os", "os.kill(os.getppid(), 9)", "import time; time.sleep(60)")
    for _ in range(2):
        assert "it was killed (SIGKILL)" in refusal(spec)
    assert waiting() == []


@forks
@pytest.mark.slow
def test_an_idle_reader_ends_and_the_next_file_starts_another(spec, write, monkeypatch, tmp_path):
    write("patch/sitecustomize.py", IDLE)
    monkeypatch.syspath_prepend(tmp_path / "patch")
    load_normalised(spec)
    (first,) = waiting()
    assert first.process.wait(DEADLINE) == 0
    other = write("models/other.obj", CUBE)
    assert len(load_normalised(spec.model_copy(update={"source": str(other)})).triangles) == 6
    assert waiting() != [first]


@forks
@pytest.mark.slow
def test_threads_read_side_by_side(spec, write):
    sources = [write(f"models/m{i}.obj", CUBE.replace("v 1", f"v {i + 1}")) for i in range(6)]
    specs = [spec.model_copy(update={"source": str(source)}) for source in sources]
    with ThreadPoolExecutor(3) as pool:
        widths = [mesh.vertices[:, 0].max() for mesh in pool.map(load_normalised, specs)]
    assert widths == sorted(set(widths))
    assert 1 <= len(waiting()) <= 3


@pytest.mark.slow
def test_a_daemonic_pool_worker_may_read(spec):
    from multiprocessing import get_context

    context = get_context("spawn")
    ours, theirs = context.Pipe()
    worker = context.Process(target=_work, args=(theirs, spec.model_dump_json()), daemon=True)
    worker.start()
    assert ours.poll(DEADLINE)
    assert ours.recv() == 6
    worker.join()


def _work(pipe, text):
    pipe.send(len(load_normalised(ModelSpec.model_validate_json(text)).triangles))


@pytest.mark.slow
def test_the_reader_writes_nothing_elsewhere(spec, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = {p for p in tmp_path.rglob("*") if "cache" not in p.parts}
    load_normalised(spec)
    assert {p for p in tmp_path.rglob("*") if "cache" not in p.parts} == before
    assert {p.suffix for p in cache_folder().iterdir()} == {".arrays"}
    assert reader_program.LOG not in {p.name for p in cache_folder().rglob("*")}
