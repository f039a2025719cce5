"""Hits runs with real faults at random moments, many times, and writes what came of it into docs/reliability.md.

    benchmarks/faults [--share 1.0] [--seed 1]    # some 140 faults: half an hour on two cores
    benchmarks/faults --cost                      # frames a second with --durability fsync, as a share of those without
    benchmarks/faults --cache 400                 # so many kills of processes that fill one cache: five minutes

What a fault may not do is in tests/faults.py and tests/cache_kills.py, which the tests share. Status 1 where it did.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import statistics
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import cache_kills  # noqa: E402, which is found now
from faults import SIGNALS, WORKS, Course, Tally, make_stock, recipe  # noqa: E402

PAGE = ROOT / "docs" / "reliability.md"
TABLE = re.compile(r"(<!-- written by benchmarks/faults -->\n).*?(\n<!-- end -->)", re.DOTALL)
HEAD = """\
| fault | during | times | finished shots lost | files torn | equal bytes after | what it said |
|---|---|---:|---:|---:|---|---|
"""
TIMES = {
    ("SIGKILL of everything", "render"): 50,
    ("SIGKILL of everything", "append"): 10,
    ("SIGKILL of everything", "merge"): 10,
    ("SIGKILL of everything", "import"): 10,
    ("SIGKILL of everything", "export"): 10,
    ("SIGKILL of everything", "convert"): 20,
    ("SIGKILL of the parent", "render"): 15,
    ("SIGKILL of a worker", "render"): 15,
    ("SIGTERM", "render"): 6,
    ("Ctrl-C", "render"): 6,
    ("SIGSTOP, SIGCONT", "render"): 5,
    ("workers SIGSTOPped, Ctrl-C", "render"): 5,
}
"""The number of times that each fault hits each work."""


def campaign(share: float, seed: int) -> bool:
    """Apply the faults, write the table, and return whether all results are as expected."""
    rows: list[str] = []
    is_good = True
    with tempfile.TemporaryDirectory(prefix="viewsphere-faults-") as place:
        stock = Path(place, "stock")
        stock.mkdir()
        make_stock(stock)
        for (fault, work), times in TIMES.items():
            course = Course(WORKS[work], stock, Path(place, f"{fault} {work}"), random.Random(f"{seed} {fault} {work}"))
            course.suffer(SIGNALS[fault], max(round(share * times), 1))
            course.renew()
            rows.append(row(fault, work, course.tally))
            is_good &= course.tally.is_good
            print(rows[-1], *course.tally.untidy, sep="\n", flush=True)
            table = HEAD + "\n".join(rows)
            PAGE.write_text(TABLE.sub(lambda found, table=table: found[1] + table + found[2], PAGE.read_text("utf-8")), "utf-8")
    return is_good


def row(fault: str, work: str, tally: Tally) -> str:
    """A fault's line of the table."""
    said = "; ".join(
        dict.fromkeys(re.sub(r"\d+ of \d+ frames are kept|nothing was finished yet", "...", line) for line in tally.said)
    )
    equal = "yes" if not tally.unequal else f"no, {tally.unequal} times"
    return f"| {fault} | {work} | {tally.times} | {tally.lost} | {tally.torn} | {equal} | {said or 'nothing'} |"


def cost(turns: int = 5) -> None:
    """Print what durability costs, in pairs of runs that take turns: frames of 640 x 480, 16 a shot, by two workers."""
    from viewsphere.run.generate import generate
    from viewsphere.store.shots.moving import DURABILITY

    views = {"azimuth": {"start": 0, "stop": 351, "step": 9}, "elevation": [15, 40], "distance": 1.0}
    asked = recipe(viewpoints=views, camera={"size": [640, 480], "fov_deg": 35}, shot_frames=16, formats=[])
    seconds: dict[str, list[float]] = {"none": [], "fsync": []}
    with tempfile.TemporaryDirectory(prefix="viewsphere-faults-", dir=Path.cwd()) as place:
        for turn in range(turns):
            for what, taken in seconds.items():
                os.environ[DURABILITY] = what
                begun = time.monotonic()
                generate(asked, Path(place, f"{what} {turn}"), workers=2)
                taken.append(time.monotonic() - begun)
    ratios = [a / b for a, b in zip(seconds["none"], seconds["fsync"], strict=True)]
    print(
        f"frames a second with fsync: {statistics.median(ratios):.2f} of those without ({min(ratios):.2f} to {max(ratios):.2f})"
    )


def kill_writers(kills: int, seed: int) -> bool:
    """Kill so many processes that fill one cache, print the findings, and return whether they are as expected."""
    from viewsphere.kernels.entries import kernel_folder

    kernels = kernel_folder()
    with tempfile.TemporaryDirectory(prefix="viewsphere-faults-") as place:
        os.environ |= {"VIEWSPHERE_CACHE": str(Path(place, "cache")), "VIEWSPHERE_CACHE_LIMIT": str(cache_kills.LIMIT)}
        findings = cache_kills.campaign(Path(place, "stock"), kernels, kills, seed, longest=2.0)
    print(findings)
    return findings.is_good


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--share", type=float, default=1.0, help="of the faults")
    parser.add_argument("--seed", type=int, default=1, help="of the moments")
    parser.add_argument("--cost", action="store_true", help="measure what durability costs instead")
    parser.add_argument("--cache", type=int, metavar="KILLS", help="kill so many processes that fill one cache instead")
    options = parser.parse_args()
    if options.cost:
        cost()
    elif options.cache:
        sys.exit(0 if kill_writers(options.cache, options.seed) else 1)
    else:
        sys.exit(0 if campaign(options.share, options.seed) else 1)
