"""The page in headless Chromium: toggles, filters, pages, keyboard, 3D, themes, narrow and wide."""

import numpy as np
import pytest

from deadline import until
from seen import differs, equals, looks, pixels

MAPS = ("coordinates", "nocs", "position", "semantic", "panoptic", "parts", "materials")
LAYERS = ("boxes", "boxes3d", "masks", "depth", "normals", *MAPS)


@pytest.mark.slow
def test_every_toggle_changes_the_picture_and_back(page, settle):
    """Boxes are drawn at first."""
    assert page.get_attribute("#layers [data-layer=boxes]", "aria-pressed") == "true"
    picture = page.locator(".card .picture").first
    drawn = pixels(picture)
    page.click("#layers [data-layer=boxes]")
    assert differs(picture, drawn, 0.005)
    settle(page)
    plain = pixels(picture)
    for name in LAYERS:
        button = f"#layers [data-layer={name}]"
        page.click(button)
        assert page.get_attribute(button, "aria-pressed") == "true"
        assert differs(picture, plain, 0.005), name
        page.click(button)
        assert equals(picture, plain, 0.002), name
    page.click("#layers [data-layer=boxes]")
    assert equals(picture, drawn, 0.002)


@pytest.mark.slow
def test_3d_models_are_drawn_at_two_pixels_for_one(page):
    """Their edges are smooth where the browser does not multisample."""
    page.locator("#models").scroll_into_view_if_needed()
    widths = "[...document.querySelectorAll('#models canvas')].map((c) => [c.width, c.clientWidth])"
    assert page.evaluate(widths)
    assert until(lambda: all(drawn >= 2 * shown > 0 for drawn, shown in page.evaluate(widths)))


@pytest.mark.slow
def test_surface_layers_exclude_one_another(page):
    page.click("#layers [data-layer=depth]")
    page.click("#layers [data-layer=normals]")
    assert page.get_attribute("#layers [data-layer=depth]", "aria-pressed") == "false"
    assert page.get_attribute("#layers [data-layer=normals]", "aria-pressed") == "true"
    page.click("#layers [data-layer=normals]")


@pytest.mark.slow
def test_still_pictures_have_no_player(page):
    assert page.is_hidden("#sequences")
    assert page.is_hidden("#to-sequences")


@pytest.mark.slow
def test_the_mask_is_the_stored_one(page, small_dataset):
    """RLE decoded by the page is the mask that Python decodes."""
    rle = small_dataset[0].objects[0].rle
    ones = page.evaluate(
        """async ([code, rows, columns]) => {
            const { decodeRle } = await import("report/rle.js");
            return [...decodeRle(code, rows, columns)];
        }""",
        [rle.counts, rle.height, rle.width],
    )
    mask = small_dataset[0].objects[0].mask
    assert np.array_equal(np.array(ones, bool).reshape(rle.width, rle.height).T, mask)
    assert mask.any()


@pytest.mark.slow
def test_filters_and_reset(page):
    cards = page.locator(".card")
    assert cards.count() == 12
    page.select_option("select[name=category]", index=2)
    assert cards.count() == 6
    assert all("odd" in text for text in page.locator(".card .title").all_inner_texts())
    page.select_option("select[name=pose]", "front-above")
    assert cards.count() == 1
    assert page.inner_text("#matches").startswith("1 picture of 12")
    page.click("text=Reset")
    assert cards.count() == 12
    page.evaluate("""() => {
        const input = document.querySelector("input[name=high]");
        input.value = 0;
        input.dispatchEvent(new Event("input"));
    }""")
    assert cards.count() == 0
    page.click("text=Show all")
    assert cards.count() == 12


@pytest.mark.slow
def test_cells_and_sides_filter_the_pictures(page):
    page.locator(".map rect.cell").first.click()
    assert page.locator(".card").count() == 2
    page.click(".chip")
    assert page.locator(".card").count() == 12
    page.click("#sides button >> nth=0")
    assert page.locator(".card").count() == 2
    page.click("text=Reset")
    assert page.locator(".card").count() == 12


@pytest.mark.slow
def test_pages_turn(browser, small_dataset, tmp_path, open_page):
    import json
    import re

    text = (small_dataset.root / "report.html").read_text("utf-8")
    found = re.search(r'(<script type="application/json" id="data">)(.*?)(</script>)', text, re.DOTALL)
    data = json.loads(found[2])
    data["shown"] = [{**frame, "index": i * 12 + frame["index"]} for i in range(5) for frame in data["shown"]]
    file = tmp_path / "many.html"
    file.write_text(text[: found.start(2)] + json.dumps(data).replace("<", "\\u003c") + text[found.end(2) :], "utf-8")
    page = open_page(file=file)
    seen = []
    for number in (1, 2, 3):
        assert f"Page {number} of 3" in page.inner_text("#pages")
        seen += page.evaluate("[...document.querySelectorAll('.card')].map((c) => c.dataset.frame)")
        if number < 3:
            page.click("#pages >> text=Next")
    assert len(seen) == len(set(seen)) == 60
    assert page.is_disabled("#pages >> text=Next")


@pytest.mark.slow
def test_keyboard_and_enlarged_view(page, settle):
    page.locator(".card").first.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    assert page.locator("#lightbox").evaluate("d => d.open")
    title = page.inner_text("#lightbox-title")
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#lightbox-title") != title
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#lightbox-title") == title
    settle(page)
    picture = page.locator("#lightbox .picture").first
    plain = pixels(picture)
    page.keyboard.press("d")
    assert differs(picture, plain, 0.05)
    assert "m" in page.inner_text("#lightbox .ramp")
    for word in ("Azimuth", "Camera matrix K", "Visible share", "2D box"):
        assert word in page.inner_text("#lightbox aside")
    page.keyboard.press("d")
    page.keyboard.press("Escape")
    assert not page.locator("#lightbox").evaluate("d => d.open")


@pytest.mark.slow
def test_three_canvases_show_something_and_turn(page, settle):
    page.locator("#models").scroll_into_view_if_needed()
    for i in range(3):
        stage = page.locator(".stage").nth(i)
        stage.scroll_into_view_if_needed()
        settle(page)
        assert looks(stage, lambda seen: len(np.unique(seen.reshape(-1, 3), axis=0)) > 20)
        before = pixels(stage)
        page.locator(".stage canvas").nth(i).focus()
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        assert differs(stage, before, 0.002)
    name = page.inner_text("#model-facts")
    page.click("[aria-label='Next model']")
    assert page.inner_text("#model-facts") != name


FRUSTUM = "([frame, size]) => import('report/scenes/frustum.js').then((m) => m.frustumLines(frame, size))"


@pytest.mark.slow
def test_a_camera_s_frustum_is_a_pyramid_a_box_or_the_lens_s_own_lines(page):
    K = [[2, 0, 2], [0, 2, 1], [0, 0, 1]]
    lines = [[0, 0, 1, 0, 0.5, 0.75, 0, 1, 0], [1, 0, 0, 0, 0, 0]]
    pinhole, parallel, bent = (
        page.evaluate(FRUSTUM, [{"size": [4, 2], "camera": {"K": K, **lens}}, 3])
        for lens in ({"lines": None, "parallel": False}, {"lines": None, "parallel": True}, {"lines": lines, "parallel": False})
    )
    assert pinhole[:4] == [[0, 0, 0], [-3, -1.5, 3], [-3, -1.5, 3], [3, -1.5, 3]] and len(pinhole) == 16
    assert parallel[:6] == [[-1, -0.5, 0], [-1, -0.5, 3], [-1, -0.5, 3], [1, -0.5, 3], [-1, -0.5, 0], [1, -0.5, 0]]
    assert bent == [[0, 0, 3], [0, 1.5, 2.25], [0, 1.5, 2.25], [0, 3, 0], [3, 0, 0], [0, 0, 0]]


@pytest.mark.slow
@pytest.mark.parametrize(("width", "scheme"), [(390, "dark"), (1440, "light")])
def test_no_sideways_scrolling_and_themes(open_page, width, scheme):
    page = open_page(width=width, scheme=scheme)
    page.click("#recipe summary")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    paper = "getComputedStyle(document.body).backgroundColor"
    first = page.evaluate(paper)
    assert (sum(map(int, first[4:-1].split(","))) < 200) == (scheme == "dark")
    page.click("#theme")
    page.click("#theme")
    if scheme == "dark":
        page.click("#theme")
        page.click("#theme")
    assert page.evaluate(paper) != first
    page.locator(".card").first.click()
    assert page.locator("#lightbox").evaluate("d => d.scrollWidth") <= width


def test_names_are_text_and_findings_are_shown(page):
    assert "</script><!--<b>" in page.inner_text("#shares")
    assert page.locator("main b").count() == 0
    assert "1 finding" in page.inner_text(".badge")
    assert "expected <b>this</b>" in page.inner_text("#provenance")
    assert page.locator("img:not([alt])").count() == 0
