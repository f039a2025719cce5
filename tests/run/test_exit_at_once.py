"""A process that ends at once does all that Python's own end does for those outside of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from deadline import DEADLINE

ENDING = """
import atexit, os, sys, threading, time
from viewsphere.run.workers.exit_at_once import exit_at_once

class Slow:
    def __del__(self):
        os.write(1, b"taken apart;")

kept = Slow()
atexit.register(print, "first registered", end=";")
atexit.register(print, "last registered", end=";")
threading.Thread(target=lambda: (time.sleep(0.05), print("thread", end=";"))).start()
print("printed", end=";")
exit_at_once(int(sys.argv[1]))
"""
PRINTING = """
from viewsphere.run.workers.exit_at_once import exit_at_once
print("left in the buffer")
exit_at_once(0)
"""
COMMAND = """
import sys
from viewsphere import cli
from viewsphere.cli import commands
def app(standalone_mode):
    {0}
commands.app = app
cli.program()
"""


def ended(script, *words, **options):
    return subprocess.run([sys.executable, "-c", script, *words], stdout=-1, stderr=-1, text=True, timeout=DEADLINE, **options)


@pytest.mark.parametrize("status", ["0", "7"])
def test_what_was_to_be_done_is_done_and_nothing_is_taken_apart(status):
    run = ended(ENDING, status)
    assert (run.returncode, run.stdout, run.stderr) == (int(status), "printed;thread;last registered;first registered;", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_output_that_nobody_takes_is_no_success():
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with Path("/dev/full").open("w") as full:
        run = subprocess.run([sys.executable, "-c", PRINTING], stdout=full, stderr=-1, timeout=DEADLINE, env=buffered)
    assert (run.returncode, run.stderr) == (2, b"")


@pytest.mark.skipif(os.name != "posix", reason="a shell of POSIX's")
@pytest.mark.parametrize("stream", ["1", "2"])
def test_a_process_without_a_stream_that_it_does_not_need_succeeds(stream):
    script = "from viewsphere.run.workers.exit_at_once import exit_at_once; exit_at_once(0)"
    command = f"'{sys.executable}' -c '{script}' {stream}>&-"
    assert subprocess.run(command, shell=True, timeout=DEADLINE).returncode == 0


@pytest.mark.parametrize(
    ("does", "status"),
    [("return None", 0), ("return 130", 130), ("sys.exit()", 0), ("sys.exit(3)", 3), ("return False", 0)],
)
def test_the_exit_status_of_a_command(does, status):
    assert ended(COMMAND.format(does)).returncode == status


def test_an_error_of_ours_keeps_its_traceback():
    run = ended(COMMAND.format("raise KeyError('lost')"))
    assert run.returncode == 1
    assert run.stderr.rstrip().endswith("KeyError: 'lost'")
