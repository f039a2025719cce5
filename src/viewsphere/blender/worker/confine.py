"""Restricts the files that this process may read and write, by Linux's Landlock (kernel 5.13 and later).

https://docs.kernel.org/userspace-api/landlock.html. Threads and processes inherit the restrictions of the thread that starts
them, and nothing can loosen these. They are therefore set before bpy is imported, which starts threads.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

TASKS = Path("/proc/self/task")


CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
"""Numbers of Landlock's system calls, the same on every architecture."""
SET_NO_NEW_PRIVS = 38  # prctl(2)

EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
TRUNCATE, ALL = 1 << 14, (1 << 13) - 1
READ = EXECUTE | READ_FILE | READ_DIR
ONLY_FOR_FOLDERS = ALL & ~(EXECUTE | WRITE_FILE | READ_FILE)

SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/nix", "/proc", "/sys", "/run")
DEVICES = "/dev"


class _Ruleset(ctypes.Structure):
    _fields_ = [("handled", ctypes.c_uint64)]


class _Beneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = [("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32)]


def confine(readable: list[str], writable: list[str]) -> bool:
    """Let this process read only the `readable` folders, its Python and the system's folders, and write only to `writable`.

    Returns False, with nothing restricted, if the kernel has no Landlock.
    """
    if not sys.platform.startswith("linux"):
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(CREATE_RULESET, None, 0, 1)
    if version < 1:
        return False
    handled = ALL | (TRUNCATE if version >= 3 else 0)
    ruleset = libc.syscall(CREATE_RULESET, ctypes.byref(_Ruleset(handled)), ctypes.sizeof(ctypes.c_uint64), 0)
    if ruleset < 0:
        return False
    for place in (*readable, *SYSTEM, *_programs()):
        _allow(libc, ruleset, place, READ)
    for place in (*writable, DEVICES):
        _allow(libc, ruleset, place, handled)
    libc.prctl(SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    done = libc.syscall(RESTRICT_SELF, ruleset, 0) == 0
    os.close(ruleset)
    return done


def _allow(libc, ruleset: int, place: str, access: int) -> None:
    with suppress(OSError):  # a path that does not exist needs no rule
        parent = os.open(place, os.O_PATH | os.O_CLOEXEC)
        if not Path(place).is_dir():
            access &= ~ONLY_FOR_FOLDERS
        libc.syscall(ADD_RULE, ruleset, 1, ctypes.byref(_Beneath(access, parent)), 0)
        os.close(parent)


def _programs() -> set[str]:
    """Folders of this interpreter and of the modules that it imports."""
    places = {
        sys.prefix,
        sys.base_prefix,
        sys.exec_prefix,
        sys.base_exec_prefix,
        str(Path(os.__file__).resolve().parent),
    }
    places |= {entry for entry in sys.path if entry}
    return places | {str(Path(place).resolve()) for place in places}


def die_with_parent() -> None:
    """Have the kernel kill this process when the thread that started it ends, even while Blender lets no other thread run."""
    if sys.platform.startswith("linux"):
        set_death_signal, kill = 1, 9  # prctl(2), signal(7)
        ctypes.CDLL(None).prctl(set_death_signal, kill, 0, 0, 0)


@contextmanager
def few_cores(count: int) -> Iterator[None]:
    """Show this many cores to libraries that are loaded in the context, if the system supports it (Linux); 0: all.

    The cores follow from this process's id, so that processes that start at the same time use different ones. Afterwards all
    threads may run on any core again.
    """
    if not count or not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    with suppress(OSError):
        os.sched_setaffinity(0, some_of(cores, count, os.getpid()))
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, cores)
        with suppress(OSError):  # where the system lists no threads, other threads keep the few
            for task in TASKS.iterdir():
                with suppress(OSError):
                    os.sched_setaffinity(int(task.name), cores)


def some_of(cores: set[int], count: int, number: int) -> set[int]:
    """`count` of the cores, or all if there are fewer. Consecutive numbers get different cores while there are enough."""
    line = sorted(cores)
    first = number * count % len(line)
    return set((line * 2)[first : first + min(count, len(line))])
