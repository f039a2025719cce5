"""The command line: recipes in, data sets out.

Worker processes import the main program again, so commands are imported only when one of them runs.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
from io import TextIOWrapper
from typing import NoReturn

from viewsphere.errors import CheckFailedError, UserError, ViewsphereError
from viewsphere.kernels.garbage import importing, spare_imports

ONE_BLAS_THREAD = ("OPENBLAS_NUM_THREADS", "1")
"""One thread for numpy's matrix library. Other threads spin while they wait, 50 ms of CPU for each core at each start, also of
workers. No stage of a frame multiplies large matrices, and sums keep their order on any number of cores.
"""


def program() -> NoReturn:
    """Run the command line as the main program of a process, which ends at once."""
    from viewsphere.run.workers.exit_at_once import exit_at_once

    spare_imports()
    os.environ.setdefault(*ONE_BLAS_THREAD)
    try:
        main()
    except SystemExit as end:
        if isinstance(end.code, str):  # which Python prints
            raise
        exit_at_once(end.code or 0)
    exit_at_once(0)


def main() -> None:
    """Run the command line; the user's mistakes are one line and exit status 2, never a traceback."""
    with importing():
        import typer

        from viewsphere.cli import completion
        from viewsphere.cli.commands import UsageError, app, explain
        from viewsphere.cli.terminal import complain, say
        from viewsphere.run.workers.allocator import keep_freed_memory

    _print_anything()
    signal.signal(signal.SIGTERM, _stop)
    try:
        if os.environ.get("_VIEWSPHERE_COMPLETE") == completion.BASH:
            completion.in_bash(app, os.environ)
        keep_freed_memory()
        sys.exit(app(standalone_mode=False))
    except UsageError as error:
        explain(error)
    except (typer.Abort, KeyboardInterrupt):
        say("stopped; what is finished is kept: run the same command to go on", err=True)
        sys.exit(130)
    except CheckFailedError as error:
        complain(error, 1)
    except UserError as error:
        complain(error, 2)
    except ViewsphereError as error:
        complain(error, 3)
    except OSError as error:
        if error.errno not in {errno.ENAMETOOLONG, errno.ELOOP}:
            raise
        problem = f"expected a path that the file system takes, found: {error.strerror}: choose another"
        complain(UserError(f"{error.filename}: {problem}"), 2)


def _stop(*_: object) -> NoReturn:
    """End as Ctrl-C does, with its message, on a signal from the system or a cluster."""
    raise KeyboardInterrupt


def _print_anything() -> None:
    """Make output print characters missing from its encoding by their numbers, as is often needed for Windows pipes."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
