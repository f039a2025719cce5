"""Pictures that screens show: windows, an editor, a page, charts, a landscape; and the lit panel that shows them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere_zoo.household.canvas import Canvas, blank, disc, line, polygon, rect
from viewsphere_zoo.household.draws import pick
from viewsphere_zoo.household.lettering import body_text, write
from viewsphere_zoo.household.patterns import extent
from viewsphere_zoo.shapes.paint import Color

Show = Callable[[Canvas, np.random.Generator], None]
HUES: tuple[Color, ...] = (
    (0.2, 0.45, 0.85), (0.85, 0.35, 0.25), (0.25, 0.65, 0.45), (0.92, 0.7, 0.2), (0.55, 0.35, 0.75), (0.2, 0.65, 0.75),
)  # fmt: skip


def lit(name: str, image: int, strength: float = 0.75) -> Material:
    """A panel under glass that shines with a picture."""
    glow = (strength, strength, strength)
    return Material(
        name, (0.012, 0.012, 0.014, 1), roughness=0.3, emissive=glow, emissive_texture=Texture(image), clearcoat=0.3
    )


def picture(show: str, width: float, height: float, rng: np.random.Generator) -> Image:
    """One of `SHOWS` for a panel of this size, metres."""
    c = blank(width, height, (0.1, 0.1, 0.12))
    SHOWS[show](c, rng)
    return c.image("screen")


def _wallpaper(c: Canvas, rng: np.random.Generator) -> None:
    """Soft waves of two colours, or hills under a sky."""
    w, h = extent(c)
    a, b = np.array(pick(rng, HUES)), np.array(pick(rng, HUES))
    share = (c.y / h)[..., None]
    c.rgb[:] = (0.35 + 0.5 * a) * share + 0.55 * b * (1 - share)
    for k in range(4):
        swing = h * (0.62 - 0.17 * k) + 0.1 * h * np.sin(2 * np.pi * c.x / w * rng.uniform(0.6, 1.6) + rng.uniform(0, 6.3))
        c.paint(c.y - swing, b * (0.85 - 0.16 * k) + 0.08, 0.55)


def _landscape(c: Canvas, rng: np.random.Generator) -> None:
    """Mountains in front of a low sun."""
    w, h = extent(c)
    share = np.clip(c.y / h, 0, 1)[..., None]
    c.rgb[:] = np.array((0.25, 0.45, 0.75)) * share + np.array((0.98, 0.75, 0.5)) * (1 - share)
    c.paint(disc(c, rng.uniform(0.3, 0.7) * w, 0.55 * h, 0.08 * h), (1.0, 0.95, 0.8))
    for k, tone in enumerate(((0.45, 0.5, 0.65), (0.3, 0.38, 0.5), (0.16, 0.28, 0.3), (0.1, 0.2, 0.16))):
        at, phase = 2 * np.pi * c.x / w, rng.uniform(0, 6.3, 3)
        ridge = (
            np.abs(np.sin(at * (0.9 + 0.2 * k) + phase[0]))
            + 0.3 * np.abs(np.sin(3.1 * at + phase[1]))
            + 0.1 * np.abs(np.sin(9 * at + phase[2]))
        )
        c.paint(c.y - h * (0.5 - 0.14 * k + 0.16 * (ridge - 0.7)), tone)


def _bar(c: Canvas, rng: np.random.Generator) -> None:
    """A task bar along the lower edge, with symbols and a clock."""
    w, h = extent(c)
    c.paint(c.y - 0.065 * h, (0.1, 0.11, 0.14), 0.85)
    count = int(rng.integers(6, 10))
    for k in range(count):
        x, s = w * (0.5 + 0.032 * (k - count / 2)), 0.02 * h
        c.paint(rect(c, (x - s, 0.032 * h - s), (x + s, 0.032 * h + s), 0.4 * s), HUES[k % len(HUES)])
    write(c, f"{int(rng.integers(8, 20))}.{int(rng.integers(10, 60))}", 0.95 * w, 0.033 * h, 0.025 * h, (0.9, 0.9, 0.92))


def _icons(c: Canvas, rng: np.random.Generator) -> None:
    """Symbols in a column at the left."""
    w, h = extent(c)
    for k in range(int(rng.integers(3, 6))):
        x, y, s = 0.045 * w, h * (0.9 - 0.13 * k), 0.035 * h
        c.paint(rect(c, (x - s, y - s), (x + s, y + s), 0.3 * s), HUES[int(rng.integers(len(HUES)))])
        c.paint(rect(c, (x - s, y - 1.7 * s), (x + s, y - 1.4 * s)), (0.95, 0.95, 0.95))


def _frame(
    c: Canvas, low: tuple[float, float], high: tuple[float, float], rng: np.random.Generator, dark: bool = False
) -> None:
    """A window: title bar with buttons, an empty page."""
    _, h = extent(c)
    bar = 0.045 * h
    c.paint(
        rect(c, (low[0] + 0.008 * h, low[1] - 0.012 * h), (high[0] + 0.008 * h, high[1] - 0.012 * h), 0.012 * h),
        (0, 0, 0),
        0.35,
    )
    c.paint(rect(c, low, high, 0.012 * h), (0.13, 0.14, 0.17) if dark else (0.97, 0.97, 0.97))
    c.paint(rect(c, (low[0], high[1] - bar), high, 0.012 * h), (0.22, 0.23, 0.27) if dark else (0.84, 0.85, 0.88))
    for k, tone in enumerate(((0.9, 0.35, 0.3), (0.93, 0.75, 0.25), (0.35, 0.75, 0.35))):
        c.paint(disc(c, low[0] + bar * (0.6 + 0.62 * k), high[1] - bar / 2, 0.2 * bar), tone)


def _inside(c: Canvas, low: tuple[float, float], high: tuple[float, float]) -> tuple[tuple[float, float], tuple[float, float]]:
    """The page of a window, with a margin."""
    _, h = extent(c)
    return (low[0] + 0.03 * h, low[1] + 0.03 * h), (high[0] - 0.03 * h, high[1] - 0.075 * h)


def _code_lines(c: Canvas, low: tuple[float, float], high: tuple[float, float], rng: np.random.Generator) -> None:
    """Coloured words, indented."""
    step = 0.032 * extent(c)[1]
    indent = 0
    for k in range(int((high[1] - low[1]) / step)):
        y = high[1] - (k + 0.5) * step
        number = c.window((low[0], y - 0.2 * step), (low[0] + 0.7 * step, y + 0.2 * step))
        number.rgb[:] = (0.4, 0.42, 0.46)
        indent = int(np.clip(indent + rng.integers(-1, 2), 0, 4))
        x = low[0] + step * (1.6 + 1.3 * indent)
        for _ in range(int(rng.integers(0, 6))):
            wide = step * rng.uniform(0.8, 3.2)
            if x + wide > high[0]:
                break
            tone = pick(rng, ((0.85, 0.86, 0.88), (0.55, 0.75, 0.95), (0.75, 0.55, 0.9), (0.6, 0.85, 0.55), (0.95, 0.65, 0.4)))
            part = c.window((x, y - step / 2), (x + wide, y + step / 2))
            part.paint(np.abs(part.y - y) - 0.24 * step, tone)
            x += wide + 0.5 * step


def _desktop(c: Canvas, rng: np.random.Generator) -> None:
    """Windows on a wallpaper."""
    w, h = extent(c)
    _wallpaper(c, rng)
    _icons(c, rng)
    for k in range(int(rng.integers(1, 3))):
        x, y = w * (0.14 + 0.3 * k + rng.uniform(0, 0.08)), h * (0.16 + 0.08 * k + rng.uniform(0, 0.08))
        low, high = (x, y), (min(x + w * rng.uniform(0.42, 0.55), 0.96 * w), min(y + h * rng.uniform(0.5, 0.66), 0.95 * h))
        dark = bool(rng.random() < 0.4)
        _frame(c, low, high, rng, dark)
        a, b = _inside(c, low, high)
        if dark:
            _code_lines(c, a, b, rng)
        else:
            _page(c, a, b, rng)
    _bar(c, rng)


def _page(c: Canvas, low: tuple[float, float], high: tuple[float, float], rng: np.random.Generator) -> None:
    """A heading, a picture, lines."""
    h = high[1] - low[1]
    c.paint(rect(c, (low[0], high[1] - 0.09 * h), (low[0] + 0.5 * (high[0] - low[0]), high[1] - 0.02 * h)), (0.2, 0.22, 0.28))
    middle = low[0] + 0.42 * (high[0] - low[0])
    c.paint(rect(c, (low[0], low[1] + 0.42 * h), (middle, high[1] - 0.16 * h)), pick(rng, HUES))
    body_text(
        c, (middle + 0.04 * h, low[1] + 0.42 * h), (high[0], high[1] - 0.16 * h), 7, (0.45, 0.46, 0.5), rng.uniform(0.7, 1, 7)
    )
    body_text(c, low, (high[0], low[1] + 0.36 * h), 6, (0.45, 0.46, 0.5), rng.uniform(0.6, 1, 6))


def _editor(c: Canvas, rng: np.random.Generator) -> None:
    """An editor over the whole screen: files at the left, code, a terminal below."""
    w, h = extent(c)
    c.rgb[:] = (0.12, 0.13, 0.16)
    c.paint(c.x - 0.17 * w, (0.16, 0.17, 0.21))
    c.paint(0.95 * h - c.y, (0.24, 0.25, 0.3))
    body_text(c, (0.015 * w, 0.25 * h), (0.15 * w, 0.92 * h), 20, (0.6, 0.62, 0.66), rng.uniform(0.4, 0.9, 20), 0.4)
    _code_lines(c, (0.19 * w, 0.27 * h), (0.97 * w, 0.93 * h), rng)
    c.paint(rect(c, (0.17 * w, 0.03 * h), (w, 0.25 * h)), (0.08, 0.09, 0.1))
    body_text(c, (0.19 * w, 0.05 * h), (0.9 * w, 0.23 * h), 6, (0.5, 0.8, 0.5), rng.uniform(0.2, 0.8, 6), 0.45)
    c.paint(c.y - 0.03 * h, (0.2, 0.45, 0.8))


def _browser(c: Canvas, rng: np.random.Generator) -> None:
    """A page of news over the whole screen."""
    w, h = extent(c)
    c.rgb[:] = (0.97, 0.97, 0.97)
    c.paint(0.9 * h - c.y, (0.86, 0.87, 0.9))
    c.paint(rect(c, (0.1 * w, 0.915 * h), (0.8 * w, 0.955 * h), 0.02 * h), (1, 1, 1))
    c.paint(rect(c, (0, 0.8 * h), (w, 0.9 * h)), pick(rng, HUES))
    write(c, pick(rng, ("NEWS", "SHOP", "TRAVEL", "MAIL", "WEATHER")), 0.15 * w, 0.85 * h, 0.05 * h, (1, 1, 1))
    for k in range(6):
        x, y = w * (0.05 + 0.31 * (k % 3)), h * (0.44 - 0.36 * (k // 3))
        c.paint(rect(c, (x, y + 0.1 * h), (x + 0.28 * w, y + 0.32 * h)), rng.uniform(0.2, 0.85, 3))
        body_text(c, (x, y), (x + 0.28 * w, y + 0.09 * h), 3, (0.35, 0.36, 0.4), rng.uniform(0.6, 1, 3))
    _bar(c, rng)


def _charts(c: Canvas, rng: np.random.Generator) -> None:
    """Tables, bars and lines on cards."""
    w, h = extent(c)
    c.rgb[:] = (0.92, 0.93, 0.95)
    c.paint(0.92 * h - c.y, (0.16, 0.2, 0.32))
    for k in range(4):
        low = (w * (0.03 + 0.49 * (k % 2)), h * (0.1 + 0.42 * (k // 2)))
        high = (low[0] + 0.46 * w, low[1] + 0.38 * h)
        c.paint(rect(c, low, high, 0.01 * h), (1, 1, 1))
        x = np.linspace(low[0] + 0.03 * w, high[0] - 0.03 * w, 9)
        rise = low[1] + h * (0.06 + 0.26 * rng.random(9))
        if k % 3 == 0:
            for a, b in zip(x, rise, strict=True):
                c.paint(rect(c, (a - 0.015 * w, low[1] + 0.03 * h), (a + 0.015 * w, b)), HUES[k])
        elif k == 1:
            for row in range(2):
                c.paint(line(c, np.column_stack([x, np.roll(rise, row)]), 0.008 * h), HUES[row])
        else:
            body_text(
                c, (low[0] + 0.02 * w, low[1] + 0.03 * h), (high[0] - 0.02 * w, high[1] - 0.03 * h), 9, (0.4, 0.42, 0.5), 1.0
            )
    _bar(c, rng)


def _photo(c: Canvas, rng: np.random.Generator) -> None:
    """A landscape as wallpaper, with icons and the bar."""
    _landscape(c, rng)
    _icons(c, rng)
    _bar(c, rng)


def _player(c: Canvas, rng: np.random.Generator) -> None:
    """A film with the player's controls."""
    w, h = extent(c)
    _landscape(c, rng)
    c.paint(0.44 * h - np.abs(c.y - 0.5 * h), (0.02, 0.02, 0.02))
    c.paint(rect(c, (0.06 * w, 0.1 * h), (0.94 * w, 0.108 * h)), (0.7, 0.7, 0.72))
    c.paint(rect(c, (0.06 * w, 0.1 * h), (rng.uniform(0.2, 0.8) * w, 0.108 * h)), (0.9, 0.2, 0.2))
    s = 0.06 * h
    c.paint(disc(c, w / 2, h / 2, 1.6 * s), (0, 0, 0), 0.5)
    c.paint(polygon(c, [(w / 2 - 0.6 * s, h / 2 - 0.9 * s), (w / 2 + s, h / 2), (w / 2 - 0.6 * s, h / 2 + 0.9 * s)]), (1, 1, 1))


SHOWS: dict[str, Show] = {
    "desktop": _desktop, "editor": _editor, "browser": _browser, "charts": _charts, "photo": _photo, "player": _player,
}  # fmt: skip
"""The contents of screens, by name."""
