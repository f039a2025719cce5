"""The loop: one JSON object a line in, one a line out.

Blender itself prints to file descriptor 1, so answers go out through a copy of that descriptor, made before bpy is imported.
Descriptor 1 is then redirected to the log, as 2 is. A separate thread reads the requests. When the other process ends, for
any reason, this thread reads the end of the file and ends this process, even during a render.
"""

from __future__ import annotations

import faulthandler
import json
import os
import shutil
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO

from .confine import few_cores

DEVICES = ("CPU", "CUDA", "OPTIX", "HIP", "METAL", "ONEAPI")
ONLINE = ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.sendto", "socket.sendmsg")


def _main(folder: Path, readable: list[str] | None = None, threads: int = 0) -> None:
    """Answer requests until the input ends, then remove `folder`, which contains the requests' arrays.

    With `readable`, the process reads only these folders and the system's, and writes only to `folder`, if the system can
    enforce it. Blender uses this many `threads`; 0: one per core.
    """
    if readable is not None:
        _bind(folder, readable)
    if threads:
        os.environ["LP_NUM_THREADS"] = str(threads)  # of Mesa's software OpenGL
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal; the process that asks decides
    answers = _own_output()
    faulthandler.enable()
    requests: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_read, args=(requests, folder), daemon=True).start()
    with suppress(Exception), few_cores(threads):  # the first request is answered with the error
        start_blender()
    while True:
        said = _answer(requests.get())
        try:
            answers.write(said + b"\n")
            answers.flush()
        except OSError:  # the parent is gone
            _leave(folder)


def _bind(folder: Path, readable: list[str]) -> None:
    """Restrict which files this process, and so Blender, may read and write from now on."""
    from .confine import confine, die_with_parent

    os.environ["TF_DEBUG"] = "SDF_LAYER"  # USD says in the log which files it opens
    die_with_parent()
    confine(readable, [str(folder)])


def _answer(request: bytes) -> bytes:
    """One request's answer: `{"ok": value}`, or `{"error": "one line", "trace": "..."}`."""
    try:
        told = json.loads(request)
        do = told.pop("do", None)
        if do not in REQUESTS:
            raise ValueError(f"do: expected one of {', '.join(REQUESTS)}; found {do!r}")
        start_blender()
        return json.dumps({"ok": REQUESTS[do](told)}).encode()
    except (Exception, SystemExit) as error:
        traceback.print_exc()
        said = " ".join(str(error).split())
        return json.dumps({"error": f"{type(error).__name__}: {said}", "trace": traceback.format_exc()}).encode()


@cache
def start_blender() -> None:
    """Import bpy and forbid files to run scripts or to use the network."""
    import bpy

    preferences = bpy.context.preferences
    preferences.filepaths.use_scripts_auto_execute = False
    preferences.system.use_online_access = False
    sys.addaudithook(_stay_offline)


def _stay_offline(event: str, _: tuple[Any, ...]) -> None:
    if event in ONLINE:
        raise PermissionError("Blender is kept off the network")


def _own_output() -> BinaryIO:
    """A stream for answers: a copy of standard output. From now on, everything else that is printed there goes to the log."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout.reconfigure(line_buffering=True)
    return answers


def _read(requests: SimpleQueue[bytes], folder: Path) -> None:
    while line := sys.stdin.buffer.readline():
        requests.put(line)
    _leave(folder)


def _leave(folder: Path) -> None:
    """Remove the folder and end at once, even during a render: Blender 4.5 can hang in its regular exit."""
    shutil.rmtree(folder, ignore_errors=True)
    sys.stdout.flush()
    os._exit(0)


def _hello(_: dict[str, Any]) -> dict[str, Any]:
    """The versions of Blender and numpy, and the devices of Cycles."""
    import bpy
    import numpy as np

    return {"version": bpy.app.version_string, "numpy": np.__version__, "devices": _devices()}


def _devices() -> list[dict[str, str]]:
    """Return every device of this machine that this Blender can compute on, as dicts with kind and name."""
    import _cycles

    found: list[dict[str, str]] = []
    for kind in DEVICES:
        with suppress(ValueError):  # a kind that this build does not know
            found += [{"kind": kind, "name": device[0]} for device in _cycles.available_devices(kind) if device[1] == kind]
    return found


def _memory(_: dict[str, Any]) -> dict[str, float | None]:
    """Resident memory of this process in megabytes: now on Linux, the peak on macOS, None on Windows."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return {"rss_mb": int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6}
    with suppress(ImportError):
        import resource

        return {"rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6}
    return {"rss_mb": None}


def _stage(told: dict[str, Any]) -> Any:
    from .scene.staging import stage

    return stage(told)


def _paint(told: dict[str, Any]) -> Any:
    from .scene.staging import paint

    return paint(told)


def _read_model(told: dict[str, Any]) -> Any:
    from .files.reading import read

    return read(told)


def _read_timeline(told: dict[str, Any]) -> Any:
    from .files.reading import read_timeline

    return read_timeline(told)


def _read_contents(told: dict[str, Any]) -> Any:
    from .files.contents import contents

    return contents(told)


def _read_cameras(told: dict[str, Any]) -> Any:
    from .files.cameras import read_cameras

    return read_cameras(told)


def _read_places(told: dict[str, Any]) -> Any:
    from .files.contents import places

    return places(told)


def _draw(told: dict[str, Any]) -> Any:
    from .rendering.renderers import try_drawing

    return try_drawing(told)


def _render(told: dict[str, Any]) -> Any:
    from .rendering.frames import render

    return render(told)


def _number(told: dict[str, Any]) -> Any:
    from .scene.settling import number

    return number(told)


def _save(told: dict[str, Any]) -> Any:
    from .scene.saving import save

    return save(told)


REQUESTS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "hello": _hello,
    "memory": _memory,
    "read": _read_model,
    "timeline": _read_timeline,
    "cameras": _read_cameras,
    "contents": _read_contents,
    "places": _read_places,
    "draw": _draw,
    "stage": _stage,
    "paint": _paint,
    "render": _render,
    "number": _number,
    "save": _save,
}

if __name__ == "__main__":
    _main(Path(sys.argv[1]), *map(json.loads, sys.argv[2:]))
