"""One Blender: it is asked, it dies, it hangs, it is never left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from fake_blender import fake_blender, interpreter

from deadline import until
from viewsphere.blender.process import BlenderProcess
from viewsphere.errors import BlenderDied, BlenderError

HOLDER = """
import sys
from pathlib import Path
from viewsphere.blender.process import BlenderProcess
process = BlenderProcess(Path(sys.argv[1]))
if sys.argv[2] != "starting":
    process.ask("hello")
print(process.pid, process.folder, flush=True)
process.ask("stage", 100.0) if sys.argv[2] == "busy" else input()
"""


@pytest.fixture
def fake(tmp_path):
    return fake_blender(tmp_path)


@pytest.fixture(params=["fake", pytest.param("blender", marks=pytest.mark.slow)])
def python(request):
    return request.getfixturevalue(request.param)


def is_alive(pid):
    with suppress(OSError):
        os.kill(pid, 0)
        return True
    return False


def test_hello(python):
    with BlenderProcess(python) as process:
        told = process.ask("hello")
        assert int(told["version"].split(".")[0]) >= 4
        assert "CPU" in {device["kind"] for device in told["devices"]}
        assert process.ask("memory")["rss_mb"] > 5


def test_devices_are_named_once(fake):
    with BlenderProcess(fake) as process:
        expected = [{"kind": "CPU", "name": "A processor"}, {"kind": "CUDA", "name": "A card"}]
        assert process.ask("hello")["devices"] == expected


def test_noise_is_no_answer(fake, tmp_path):
    with BlenderProcess(fake, tmp_path / "log") as process:
        assert process.ask("hello")["version"] == "9.8.7"
        noise = (tmp_path / "log").read_text()
        assert "noise of Python" in noise
        assert "noise of a library" in noise


def test_an_error_leaves_it_alive(python):
    with BlenderProcess(python) as process:
        with pytest.raises(BlenderError, match=r"expected one of hello.*found 'nonsense'") as caught:
            process.ask("nonsense")
        assert "\n" not in str(caught.value)
        assert "Traceback" in caught.value.__notes__[0]
        assert process.ask("hello")["version"]


@pytest.mark.parametrize("how", ["SIGKILL", "SIGSEGV"])
@pytest.mark.slow
def test_death_is_told_and_another_can_be_started(python, how, tmp_path):
    log = tmp_path / "log"
    log.write_text("of another process\n")
    with BlenderProcess(python, log) as process:
        process.ask("hello")
        with pytest.raises(BlenderError):
            process.ask("nonsense")
        os.kill(process.pid, signal.Signals[how])
        with pytest.raises(BlenderDied, match=how) as caught:
            process.ask("hello")
        assert "of another process" not in str(caught.value)
        if how == "SIGKILL":
            assert "found 'nonsense'" in str(caught.value)
        else:
            assert "Segmentation fault" in log.read_text()
        assert "\n" not in str(caught.value)
        with pytest.raises(BlenderDied):
            process.ask("hello")
    with BlenderProcess(python, log) as process:
        assert process.ask("hello")["version"]


def test_a_hang_is_ended(fake):
    with BlenderProcess(fake) as process:
        process.ask("hello")
        with pytest.raises(BlenderDied, match=r"hung \(no answer in 0.5 s\) of `stage`"):
            process.ask("stage", 0.5)
        assert not is_alive(process.pid)


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="children are found in /proc")
def test_a_script_that_starts_an_interpreter_ends_with_it(fake):
    fake.write_text(fake.read_text().replace("exec ", "") + "\nexit $?")
    with BlenderProcess(fake) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        process.ask("hello")
        (child,) = map(int, children.read_text().split())
        with pytest.raises(BlenderDied, match="hung"):
            process.ask("stage", 0.5)
    assert until(lambda: not is_alive(child))


def test_one_that_does_not_even_listen_is_ended(fake):
    with BlenderProcess(fake) as process:
        process.ask("hello")
        os.kill(process.pid, signal.SIGSTOP)
        with pytest.raises(BlenderDied, match="hung"):
            process.ask("hello", 0.5, much="x" * 5_000_000)
        assert not is_alive(process.pid)


@pytest.mark.slow
def test_one_that_is_stopped_is_closed(fake):
    process = BlenderProcess(fake)
    process.ask("hello")
    os.kill(process.pid, signal.SIGSTOP)
    process.close()
    assert not is_alive(process.pid)
    assert not process.folder.exists()


def test_an_interrupted_answer_is_not_taken_for_the_next(fake, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    with BlenderProcess(fake) as process:
        monkeypatch.setattr("json.loads", interrupted)
        with pytest.raises(KeyboardInterrupt):
            process.ask("hello")
        monkeypatch.undo()
        with pytest.raises(BlenderDied):
            process.ask("memory")


def test_ctrl_c_is_for_the_one_who_asks(fake):
    with BlenderProcess(fake) as process:
        process.ask("hello")
        os.kill(process.pid, signal.SIGINT)
        assert process.ask("hello")["version"] == "9.8.7"


def test_closed_and_forgotten_ones_end(fake):
    closed, forgotten = BlenderProcess(fake), BlenderProcess(fake)
    ends = [(process.pid, process.folder) for process in (closed, forgotten)]
    assert all(folder.is_dir() and folder.stat().st_mode & 0o77 == 0 for _, folder in ends)
    closed.close()
    closed.close()
    with pytest.raises(BlenderDied, match="ended"):
        closed.ask("hello")
    del forgotten
    assert not any(is_alive(pid) or folder.exists() for pid, folder in ends)


@pytest.mark.slow
@pytest.mark.parametrize("state", ["starting", "idle", "busy"])
def test_it_does_not_outlive_the_one_who_started_it(fake, state):
    with subprocess.Popen([sys.executable, "-c", HOLDER, fake, state], stdin=-1, stdout=-1, text=True) as holder:
        pid, place = holder.stdout.readline().split()
        folder = Path(place)
        if state == "busy":
            time.sleep(0.3)  # the request is under way
        assert folder.is_dir()
        holder.kill()
    assert until(lambda: not is_alive(int(pid)) and not folder.exists())


def test_arrays_last_until_they_are_read(fake):
    with BlenderProcess(fake) as process:
        arrays = [np.arange(6, dtype=np.float32).reshape(2, 3), np.zeros((0, 3), np.int32)]
        files = [process.put(array) for array in arrays]
        for array, file in zip(arrays, files, strict=True):
            assert np.array_equal(np.load(file), array)
        process.ask("hello")
        assert not any(Path(file).exists() for file in files)


def test_what_cannot_be_started_or_does_not_speak(tmp_path):
    with pytest.raises(BlenderDied, match="cannot be started"):
        BlenderProcess(tmp_path / "nothing")
    silent = interpreter(tmp_path, "echo no such option >&2; exit 3")
    with BlenderProcess(silent) as process, pytest.raises(BlenderDied, match=r"exit status 3.*no such option"):
        process.ask("hello")


def test_nothing_of_the_users_blender_is_taken(tmp_path, monkeypatch):
    python = interpreter(tmp_path, f'env > {tmp_path}/env; exec "$python" "$@"')
    for name in ("BLENDER_USER_SCRIPTS", "BLENDER_SYSTEM_SCRIPTS", "PYTHONPATH", "PYTHONSTARTUP", "PYTHONHOME"):
        monkeypatch.setenv(name, "/of/the/user")
    with BlenderProcess(python) as process, suppress(BlenderError):
        process.ask("hello")
    assert "/of/the/user" not in (tmp_path / "env").read_text()
