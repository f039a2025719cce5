"""A server of a data set, and its page in a headless browser."""

from __future__ import annotations

import threading
from contextlib import ExitStack, contextmanager

import pytest

from deadline import DEADLINE
from viewsphere.view import Address, Live, Server


@contextmanager
def serving(root, address):
    """A server, in threads of this process."""
    live = Live(root)
    with Server(live, address) as server:
        live.start()
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()
            live.stop()


@pytest.fixture
def serve():
    """A function that serves a data set until the test ends."""
    with ExitStack() as stack:
        yield lambda root, **address: stack.enter_context(serving(root, Address(**{"port": 0, **address})))


@pytest.fixture
def open_view(browser, settle):
    """A function that opens a page; at the end no error may have come up, and no request may have gone elsewhere."""
    troubles = []
    with ExitStack() as stack:

        def open_(url, width=1400, height=900, awaited=".card[data-frame]"):
            context = stack.enter_context(browser.new_context(viewport={"width": width, "height": height}))
            page = context.new_page()
            page.on("console", lambda m: troubles.append(m.text) if m.type == "error" else None)
            page.on("pageerror", lambda e: troubles.append(str(e)))
            page.on(
                "request",
                lambda r: None if r.url.startswith((url.partition("?")[0], "data:", "blob:")) else troubles.append(r.url),
            )
            page.set_default_timeout(1000 * DEADLINE)
            page.goto(url)
            page.wait_for_selector("html[data-ready=true]")
            page.wait_for_selector(awaited)
            settle(page)
            return page

        yield open_
    assert troubles == []
