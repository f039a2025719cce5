"""Fixtures: the small recipe's data set, Blender, and a headless browser where there is one."""

from __future__ import annotations

import gc
import os
import shutil
import signal
from collections import Counter

import pytest
from hypothesis import settings

from deadline import DEADLINE
from small import small_recipe
from viewsphere.kernels.garbage import spares_imports

EXAMPLES = 100 if os.environ.get("CI") == "true" else 10
"""That each property is tried with, but where it says so itself; CI has the time for more."""

ARGUMENTS = (
    "--no-sandbox",
    "--disable-background-networking",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)

SETTLED = """async () => {
    for (let i = 0; i < 4; i++) await new Promise(requestAnimationFrame);  // layout, then what waits for its sizes
    return [...document.querySelectorAll("canvas")].every((canvas) => canvas.drawing === canvas.drawn)
        && [...document.images].every((image) => image.complete || image.loading === "lazy");
}"""

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as a shell's jobs in the background have it, and all that they start
    signal.signal(signal.SIGINT, signal.default_int_handler)

# A process for each model file takes half a second to two of them; tests of the protection itself take this away.
os.environ.setdefault("VIEWSPHERE_READ_HERE", "1")

settings.register_profile("repeatable", derandomize=True, database=None, deadline=None, max_examples=EXAMPLES)
settings.load_profile("repeatable")


WEIGHT = {"slow": 10, "shipped": 30}
"""Of a test with this mark, beside one without: rough shares of CPU seconds, estimated."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark what starts Blender as slow: the default suite has no room for hundreds of starts. The files that take longest come
    first, so that no process of pytest-xdist is left with one of them at the end.
    """
    weights = Counter()
    for item in items:
        if "blender" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)
        weights[item.path] += max((WEIGHT.get(mark.name, 1) for mark in item.iter_markers()), default=1)
    items.sort(key=lambda item: -weights[item.path])  # within a file their order stays


def pytest_collection_finish():
    """What thousands of tests are made of stays to the end: the garbage collector need not look at it again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _keeps_no_garbage():
    """No test leaves this process keeping all garbage, as viewsphere's own processes do: 12 GB at the end of a suite."""
    yield
    assert not spares_imports()


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    """An undisturbed run of the small recipe in this process; do not change it."""
    from viewsphere import generate

    out = tmp_path_factory.mktemp("small") / "out"
    generate(small_recipe(), out)
    return out


@pytest.fixture
def small_dataset(small_run, tmp_path):
    """A copy of the small run's data set, free to be spoilt."""
    import shutil

    from viewsphere import Dataset

    return Dataset(shutil.copytree(small_run, tmp_path / "small"))


@pytest.fixture(scope="session")
def blender():
    """A Python that has Blender."""
    from viewsphere.blender.interpreter import find_blender
    from viewsphere.errors import MissingExtraError

    try:
        return find_blender()
    except MissingExtraError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def drawing(blender):
    """A Python that has a Blender that draws here."""
    from viewsphere.blender.interpreter import probe

    graphics = probe(blender).graphics
    if graphics is None or graphics.problem:
        pytest.skip(f"{blender}: {graphics and graphics.problem}")
    return blender


@pytest.fixture(scope="session")
def settle():
    """A function that waits until a page has drawn everything that it was asked for."""
    return lambda page: page.wait_for_function(SETTLED)


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium: the one on the path, else Playwright's own; skips where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("chromium-browser") or playwright.chromium.executable_path
        if not os.path.exists(path):  # noqa: PTH110
            pytest.skip("no Chromium: apt-get install chromium, or playwright install chromium")
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS), timeout=1000 * DEADLINE)
        yield browser
        browser.close()
