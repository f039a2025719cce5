"""A small data set and its report, and a headless browser where there is one."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from deadline import DEADLINE
from small import small_recipe

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


@pytest.fixture(scope="session")
def settle():
    """A function that waits until a page has drawn everything that it was asked for."""
    return lambda page: page.wait_for_function(SETTLED)


@pytest.fixture(scope="session")
def small_dataset(tmp_path_factory):
    """Two post boxes x six poses; one of a category whose name would end a script."""
    from viewsphere.run.generate import generate
    from viewsphere.store import Dataset

    models = [
        {"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.18}},
        {"source": "zoo:post_box", "category": "</script><!--<b>", "name": "odd", "scale": {"length": 0.18}},
    ]
    root = tmp_path_factory.mktemp("report") / "out"
    generate(small_recipe(models=models, formats=[]), root)
    return Dataset(root)


@pytest.fixture(scope="session")
def page_file(small_dataset) -> Path:
    from viewsphere.report import Proof, write_report

    file = small_dataset.root / "report.html"
    write_report(small_dataset, file, proof=Proof(False, {"boxes": 12}, ("boxes: frame 3: expected <b>this</b>",), ("a note",)))
    return file


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


@pytest.fixture
def open_page(browser, page_file, settle):
    """A function that opens the report; at the end no error, warning or request may have come up."""
    contexts, troubles = [], []

    def open_(width=1440, height=900, scheme="light", file=page_file):
        context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: troubles.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda e: troubles.append(str(e)))
        page.on("request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else troubles.append(r.url))
        page.set_default_timeout(1000 * DEADLINE)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready=true]")
        settle(page)
        return page

    yield open_
    for context in contexts:
        context.close()
    assert troubles == []
