"""Words in capitals of round strokes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.household.canvas import Canvas, line

_GLYPHS = {
    "A": "002640 1232",
    "B": "00063645443303 3342413000",
    "C": "4536160501103041",
    "D": "00062644422000",
    "E": "40000646 0333",
    "F": "000646 0333",
    "G": "45361605011030414323",
    "H": "0006 4046 0343",
    "I": "2026",
    "J": "4641301001",
    "K": "0006 460340",
    "L": "060040",
    "M": "0006234640",
    "N": "00064046",
    "O": "100105163645413010",
    "P": "00063645443303",
    "Q": "100105163645413010 2240",
    "R": "00063645443303 2340",
    "S": "453616050413334241301001",
    "T": "2026 0646",
    "U": "060110304146",
    "V": "062046",
    "W": "0610233046",
    "X": "0046 0640",
    "Y": "062346 2320",
    "Z": "06460040",
    "0": "100105163645413010",
    "1": "152620",
    "2": "05163645440040",
    "3": "0516364544331333424130100133",
    "4": "3036010141",
    "5": "460603334241301001",
    "6": "3616050110304142331302",
    "7": "064610",
    "8": "1304051636454433130201103041423313",
    "9": "4333130405163645413010",
    "-": "1333",
    ".": "2020",
}
"""Strokes of each letter: pairs of digits are points, x 0..4 and y 0..6."""


def advance(letter: str) -> float:
    """Return the advance width of a letter, as a share of its height."""
    return {" ": 0.5, "I": 0.5, "1": 0.6, ".": 0.4}.get(letter, 0.92)


def length(text: str, height: float) -> float:
    """The width of a word, metres."""
    return height * sum(advance(letter) for letter in text)


def fitted(text: str, height: float, width: float) -> float:
    """This height, or the largest at which the word fits this width."""
    return min(height, width / length(text, 1.0))


def write(c: Canvas, text: str, x: float, y: float, height: float, color: ArrayLike, weight: float = 0.17) -> None:
    """Capitals about a point; weight: a stroke's width as a share of the height."""
    at = x - length(text, height) / 2
    for letter in text:
        step = advance(letter) * height
        if letter != " ":
            _letter(c, letter, at + step / 2 - height / 3, y - height / 2, height, color, weight)
        at += step


def _letter(c: Canvas, letter: str, x: float, y: float, height: float, color: ArrayLike, weight: float) -> None:
    margin = weight * height
    part = c.window((x - margin, y - margin), (x + height + margin, y + height + margin))
    for stroke in _GLYPHS[letter].split():
        points = [(x + int(a) * height / 6, y + int(b) * height / 6) for a, b in zip(stroke[::2], stroke[1::2], strict=True)]
        part.paint(line(part, points, weight * height), color)


def body_text(
    c: Canvas,
    low: tuple[float, float],
    high: tuple[float, float],
    lines: int,
    color: ArrayLike,
    ends: ArrayLike,
    fill: float = 0.5,
) -> None:
    """Small print that no one can read, from the top down; ends: how far lines reach, 0..1, one for all or (lines,)."""
    step = (high[1] - low[1]) / lines
    for k, end in enumerate(np.broadcast_to(ends, lines).tolist()):
        y = high[1] - (k + 0.5) * step
        part = c.window((low[0], y - step / 2), (low[0] + (high[0] - low[0]) * end, y + step / 2))
        words = ((part.x - low[0]) / (2.6 * step) + 0.37 * k) % 1.0
        part.paint(abs(part.y - y) - fill * step / 2 + (words < 0.16) * step, color)
