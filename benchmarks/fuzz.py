"""Damages small files of every kind that viewsphere reads: each has to be read, or refused by an error of viewsphere's own.

    benchmarks/fuzz [TARGET ...] [--inputs 1000] [--first 0] [--jobs 1]    # status 1 where there are findings
    benchmarks/fuzz gltf --keep 1234 FOLDER                                # the files of one input, to look at

Foreign exceptions, crashes, inputs that take over 20 seconds of the processor or a gigabyte are findings, told once for each
cause with the seed that makes them again. Inputs run in processes of their own (Linux); one that dies goes on behind the input
that ended it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from select import select
from typing import Any

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "fuzz")]

from campaign import make  # noqa: E402
from targets import TARGETS  # noqa: E402

SILENCE = 600
"""Seconds without a word until a process is ended: of foreign code that cannot be interrupted, or has no processor."""


def told(target: str, first: int, stop: int) -> Iterator[dict[str, Any] | int]:
    """Seeds of a target's inputs as they are begun, and findings."""
    while first < stop:
        command = [sys.executable, str(TESTS / "fuzz" / "campaign.py"), target, str(first), str(stop)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace") as process:
            assert process.stdout is not None
            last, errors = None, ""
            while True:
                is_silent = not select([process.stdout], [], [], SILENCE)[0]
                line = "" if is_silent else process.stdout.readline()
                if is_silent:
                    process.kill()
                if not line:
                    break
                one = json.loads(line)
                last = one if isinstance(one, int) else last
                yield one
            code = process.wait()
            assert process.stderr is not None
            errors = process.stderr.read()
        if last is None:
            raise SystemExit(f"{target}: its process ended before its first input:\n{errors[-2000:]}")
        if last == stop - 1 and code == 0:
            return
        how = f"silent for {SILENCE} s" if is_silent else f"its process ended with {code}"
        yield {"target": target, "seed": last, "what": f"{how}: {errors.strip()[-150:]}", "where": how}
        first = last + 1


def campaign(target: str, first: int, stop: int) -> tuple[str, int, list[dict[str, Any]], float]:
    """All inputs of a target: how many, what was found, and the seconds."""
    count, found, seen, begun = 0, list[dict[str, Any]](), Counter[str](), time.monotonic()
    for one in told(target, first, stop):
        if isinstance(one, int):
            count += 1
        else:
            cause = f"{one['where']} {one['what'].partition(':')[0]}"
            seen[cause] += 1
            if seen[cause] == 1:
                found.append(one | {"cause": cause})
                print(f"{target} {one['seed']}: {one['what']} ({one['where']})", flush=True)
    return target, count, [one | {"times": seen[one["cause"]]} for one in found], time.monotonic() - begun


def main() -> None:
    """Run the targets of the arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"any of {', '.join(TARGETS)}; all by default")
    parser.add_argument("--inputs", type=int, default=1000, help="of each target")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--jobs", type=int, default=1, help="targets at a time")
    parser.add_argument("--keep", nargs=2, metavar=("SEED", "FOLDER"), help="only write the files of one input")
    given = parser.parse_args()
    chosen = given.targets or list(TARGETS)
    if unknown := set(chosen) - set(TARGETS):
        parser.error(f"expected targets among {', '.join(TARGETS)}; found {', '.join(unknown)}")
    if given.keep:
        folder = Path(given.keep[1])
        folder.mkdir(parents=True)
        print(folder / make(chosen[0], int(given.keep[0]), folder))
        return
    with ThreadPoolExecutor(given.jobs) as pool:
        done = list(pool.map(lambda one: campaign(one, given.first, given.first + given.inputs), chosen))
    for target, count, found, seconds in done:
        print(f"{target:10} {count:>9,} inputs in {seconds:,.0f} s, {len(found)} findings")
    sys.exit(any(found for _, _, found, _ in done))


if __name__ == "__main__":
    main()
