"""A small data set and its report."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

import pytest

from deadline import DEADLINE
from small import small_recipe


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
    write_report(
        small_dataset,
        file,
        proof=Proof(False, {"boxes": 12}, ("boxes: frame 3: expected <b>this</b>",), ("a note",), "1 finding", {"rays": "why"}),
    )
    return file


@contextmanager
def opening(browser, page_file, settle):
    """A function that opens the report; at the end no error, warning or request may have come up."""
    contexts, troubles = [], []

    def open_(width=1440, height=900, scheme="light", file=page_file):
        # A click waits until its button lies still; a page that scrolls smoothly may still carry the button away from under it.
        context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce")
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


@pytest.fixture
def open_page(browser, page_file, settle):
    """A function that opens the report, until the test ends."""
    with opening(browser, page_file, settle) as open_:
        yield open_


@pytest.fixture(scope="module")
def open_for_all(browser, page_file, settle):
    """A function that opens the report, which takes seconds, until all tests of a file have ended."""
    with opening(browser, page_file, settle) as open_:
        yield open_


@pytest.fixture(scope="module")
def page(open_for_all):
    """The report, opened once: whoever clicks leaves it as it was."""
    return open_for_all()
