"""The live page in headless Chromium. How long it takes is told (pytest -rP), not judged: machines differ."""

import math
import re
import shutil
import threading
from contextlib import contextmanager

import pytest
from large import FRAMES, large_dataset

from deadline import DEADLINE, until
from seen import differs, pixels
from small import small_recipe

pytestmark = pytest.mark.slow

TOKEN = "a-token_of-32-letters-and-digits"

CARDS = """() => [...document.querySelectorAll("#grid .card")].map(
    (card) => [Number(card.dataset.place), card.dataset.frame === undefined ? null : Number(card.dataset.frame)])"""


LOADS = """(url) => new Promise((told) =>
    Object.assign(new Image(), { onload: () => told(true), onerror: () => told(false), src: url }))"""


def cards(page):
    """Place and frame of each card; a card that waits for its frame has None."""
    return page.evaluate(CARDS)


def whole(page):
    """Return whether the wall has a card for each place in sight, and none waits."""
    found = cards(page)
    places = [place for place, _ in found]
    return bool(found) and places == [*range(places[0], places[-1] + 1)] and all(frame is not None for _, frame in found)


def in_order(page, first=None):
    """Return whether the pictures are those of the plan, in its order, with this frame at their head."""
    return whole(page) and all(place == frame for place, frame in cards(page)) and first in (None, cards(page)[0][1])


def told(page):
    """What stands over the pictures."""
    return page.inner_text("#matches")


def shares(page):
    """What is visible of the object of each card, in percent; NaN where a card does not say."""
    found = (re.search(r"([\d.]+) % visible", text) for text in page.locator(".card .about").all_inner_texts())
    return [float(share[1]) if share else math.nan for share in found]


def wheel(page, times):
    """Turn a mouse's wheel over the pictures."""
    page.locator("#grid").scroll_into_view_if_needed()
    page.locator("#grid").hover()
    before = page.evaluate("() => document.querySelector('#grid').scrollTop")
    for _ in range(times):
        page.mouse.wheel(0, 100)
    assert until(lambda: page.evaluate("() => document.querySelector('#grid').scrollTop") > before)


def work(session):
    """Seconds of work of the page's main thread so far."""
    found = {metric["name"]: metric["value"] for metric in session.send("Performance.getMetrics")["metrics"]}
    return found["TaskDuration"]


def test_a_data_set_of_273_600_frames(serve, small_run, tmp_path, open_view, capsys):
    server = serve(large_dataset(small_run, tmp_path / "large"))
    assert until(lambda: server.answers.answer("/state", {}).body.find(f'"finished":{FRAMES}'.encode()) > 0)
    page = open_view(server.url)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    paint = page.evaluate("() => performance.getEntriesByName('first-contentful-paint')[0].startTime")
    assert told(page).startswith("273,600 pictures")

    page.select_option("select[name=order]", "frame")
    assert until(lambda: in_order(page, 0))
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    before = work(session)
    wheel(page, 40)
    scrolled = work(session) - before
    assert until(lambda: in_order(page) and cards(page)[0][0] > 0)

    grid = page.locator("#grid")
    # Again and again: the wheel may still be turning.
    assert until(lambda: grid.press("End") or (whole(page) and cards(page)[-1] == [FRAMES - 1, FRAMES - 1]))
    wall, last = page.locator("#grid").bounding_box(), page.locator(".card").last.bounding_box()
    assert wall["y"] < last["y"] < last["y"] + last["height"] <= wall["y"] + wall["height"] + 1
    grid.press("Home")
    assert until(lambda: in_order(page, 0))
    page.evaluate("() => { const grid = document.querySelector('#grid'); grid.scrollTop = grid.scrollHeight / 2; }")
    assert until(lambda: whole(page) and abs(cards(page)[0][0] / FRAMES - 0.5) < 0.01)

    page.select_option("select[name=measure]", "visibility")
    page.fill("input[name=least]", "70")
    page.fill("input[name=most]", "80")
    assert until(lambda: re.match(r"[1-9][\d,]* pictures of [\d,]+ frames", told(page)) and whole(page))
    assert until(lambda: (found := shares(page)) and all(70 <= share <= 80 for share in found))

    assert len(cards(page)) < 60
    rows = [url for url in asked if "/rows?" in url]
    assert len(rows) < 60
    assert all("count=12" in url for url in rows)
    with capsys.disabled():
        print(f"\nfirst paint {paint:.0f} ms; {1000 * scrolled / 40:.1f} ms of work for each turn of the wheel")


@contextmanager
def running(recipe, root):
    """A run in a thread, which stops at its second frame, and a function that lets it go on to a later one."""
    from viewsphere import generate

    turn, finished = threading.Condition(), threading.Event()
    wanted = [2]

    def listen(progress):
        with turn:
            assert turn.wait_for(lambda: progress.phase != "frames" or progress.done < wanted[0], DEADLINE)

    def run():
        generate(recipe, root, keep_going=True, listener=listen)
        finished.set()

    def go_on_until(frames):
        with turn:
            wanted[0] = frames
            turn.notify()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield go_on_until
    finally:
        go_on_until(10**9)
        thread.join()
    assert finished.is_set()


def test_frames_arrive_while_one_looks(serve, tmp_path, open_view):
    (tmp_path / "bad.obj").write_text("v 0 0 0\n")
    good = {"source": "zoo:post_box", "category": "post box", "count": 2, "scale": {"length": 0.18}}
    bad = {"source": str(tmp_path / "bad.obj"), "category": "bad"}
    recipe = small_recipe(models=[good, bad], channels=["rgb"], formats=[])
    with running(recipe, tmp_path / "out") as go_on_until:
        assert until((tmp_path / "out" / "store" / "plan.json").is_file)
        page = open_view(serve(tmp_path / "out").url, awaited=".progress")
        assert until(lambda: "2 of 12 frames" in page.inner_text(".progress"))
        assert until(lambda: sorted(frame for _, frame in cards(page)) == [0, 1])
        assert page.input_value("select[name=order]") == "newest"
        for frames in (4, 6):
            go_on_until(frames)
            assert until(lambda frames=frames: len(cards(page)) == frames and whole(page))
        assert {0, 1} <= {frame for _, frame in cards(page)[-2:]}  # the newest come first
        assert "1 failure" in page.inner_text(".failures summary")
        page.click(".failures summary")
        assert "bad" in page.inner_text(".failures li")
        assert str(tmp_path) not in page.inner_text(".failures li")
        go_on_until(12)
        assert until(lambda: page.evaluate("() => document.documentElement.dataset.counted") == "12")
        assert len(cards(page)) == 12
        assert "All 12 frames are finished. 6 frames were left out." in page.inner_text(".progress")


def test_new_frames_do_not_move_what_one_reads(serve, small_run, tmp_path, open_view):
    from viewsphere import generate

    longer = small_recipe(formats=[], viewpoints={"azimuth": [60], "elevation": [15], "distance": 1.0})
    root = shutil.copytree(small_run, tmp_path / "out")
    page = open_view(serve(root).url, width=420)
    wheel(page, 8)
    assert until(lambda: cards(page)[0][0] > 0)
    before = cards(page)
    generate(longer, root, append=True)
    assert until(lambda: "Show 2 more" in told(page))
    assert cards(page) == before
    page.click("text=Show 2 more")
    assert until(lambda: told(page).startswith("14 pictures") and cards(page)[0][0] == 0)


@pytest.mark.parametrize("width", [1400, 420])
def test_the_page_fits_and_draws(serve, small_run, open_view, settle, width):
    page = open_view(serve(small_run).url, width=width)
    picture = page.locator(".card .picture").first
    page.click("#layers [data-layer=boxes]")
    settle(page)
    plain = pixels(picture)
    for name in ("masks", "depth"):
        page.click(f"#layers [data-layer={name}]")
        assert differs(picture, plain, 0.005), name
        page.click(f"#layers [data-layer={name}]")
    for name in ("viewpoints", "distributions", "models"):
        page.wait_for_selector(f"#{name}", state="visible")
        page.locator(f"#{name}").scroll_into_view_if_needed()
        page.wait_for_selector(f"#{name}:not(.empty-yet)")
    page.wait_for_selector("#provenance-pair table")
    assert page.evaluate("() => document.documentElement.scrollWidth") == width


def test_enlarged_and_turned_by_keys(serve, small_run, open_view):
    page = open_view(serve(small_run).url)
    page.select_option("select[name=order]", "frame")
    assert until(lambda: in_order(page, 0))
    page.locator(".card").first.click()
    title = page.locator("#lightbox-title")
    assert title.inner_text().startswith("Frame 0:")
    page.keyboard.press("ArrowRight")
    assert until(lambda: title.inner_text().startswith("Frame 1:"))
    page.keyboard.press("d")
    assert until(lambda: page.locator("#lightbox .ramp").last.inner_text().count(" m") >= 2)
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    assert until(lambda: title.inner_text().startswith("Frame 11:"))
    page.keyboard.press("Escape")
    focused = "() => document.activeElement.dataset.frame"
    assert until(lambda: page.evaluate(focused) == "11")
    page.keyboard.press("ArrowLeft")
    assert until(lambda: page.evaluate(focused) == "10")


def test_damage_is_shown_where_it_is(serve, small_dataset, open_view):
    store = small_dataset.store
    key = min(store.finished())
    (store.shot_folder(key) / "frames.json").write_bytes(b"[")
    page = open_view(serve(small_dataset.root).url)
    page.wait_for_selector(".failures:not([hidden])")
    assert page.locator(".card .missing").count() == 2
    assert "frames.json" in page.locator(".card .about.bad").first.inner_text()
    assert page.locator(".card img").count() == 10


def test_strangers_learn_nothing_and_run_nothing(serve, small_run, browser):
    server = serve(small_run, token=TOKEN)
    with browser.new_context() as context:
        stranger = context.new_page()
        stranger.set_default_timeout(1000 * DEADLINE)
        assert stranger.goto(server.url.partition("?")[0]).status == 403
        assert stranger.goto(server.url).status == 200
        stranger.wait_for_selector("html[data-ready=true]")
        assert "token" not in stranger.url
        stranger.evaluate("""() => {
            const script = document.createElement("script");
            script.textContent = "window.ran = true";
            document.body.append(script);
        }""")
        assert stranger.evaluate("() => window.ran") is None
        # Another server's page in the same browser, which has the cookie.
        other = serve(small_run)
        page = context.new_page()
        page.goto(other.url.replace("127.0.0.1", "localhost"))
        for origin in (server.url.partition("?")[0], other.url):
            for path in ("state", "picture?frame=0&layer=rgb", ""):
                assert page.evaluate("(url) => fetch(url).then(() => 'told', () => 'refused')", origin + path) == "refused"
            assert page.evaluate(LOADS, f"{origin}picture?frame=0&layer=rgb") is False
