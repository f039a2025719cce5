"""Raised letters for signs: capitals and digits on a grid of 5 x 7, in as few boxes as their strokes need."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere_zoo.shapes.solids import Solid, join
from viewsphere_zoo.townscape.surfaces import cuboid

_GLYPHS = {
    "A": "01110 10001 10001 11111 10001 10001 10001",
    "B": "11110 10001 10001 11110 10001 10001 11110",
    "C": "01111 10000 10000 10000 10000 10000 01111",
    "D": "11110 10001 10001 10001 10001 10001 11110",
    "E": "11111 10000 10000 11110 10000 10000 11111",
    "F": "11111 10000 10000 11110 10000 10000 10000",
    "G": "01111 10000 10000 10011 10001 10001 01111",
    "H": "10001 10001 10001 11111 10001 10001 10001",
    "I": "01110 00100 00100 00100 00100 00100 01110",
    "J": "00111 00010 00010 00010 00010 10010 01100",
    "K": "10001 10010 10100 11000 10100 10010 10001",
    "L": "10000 10000 10000 10000 10000 10000 11111",
    "M": "10001 11011 10101 10101 10001 10001 10001",
    "N": "10001 11001 11001 10101 10011 10011 10001",
    "O": "01110 10001 10001 10001 10001 10001 01110",
    "P": "11110 10001 10001 11110 10000 10000 10000",
    "R": "11110 10001 10001 11110 10100 10010 10001",
    "S": "01111 10000 10000 01110 00001 00001 11110",
    "T": "11111 00100 00100 00100 00100 00100 00100",
    "U": "10001 10001 10001 10001 10001 10001 01110",
    "V": "10001 10001 10001 10001 10001 01010 00100",
    "W": "10001 10001 10001 10101 10101 11011 10001",
    "X": "10001 10001 01010 00100 01010 10001 10001",
    "Y": "10001 10001 01010 00100 00100 00100 00100",
    "0": "01110 10001 10001 10001 10001 10001 01110",
    "1": "00100 01100 00100 00100 00100 00100 01110",
    "2": "01110 10001 00001 00110 01000 10000 11111",
    "3": "11110 00001 00001 01110 00001 00001 11110",
    "4": "10010 10010 10010 11111 00010 00010 00010",
    "5": "11111 10000 11110 00001 00001 00001 11110",
    "6": "01110 10000 10000 11110 10001 10001 01110",
    "7": "11111 00001 00010 00010 00100 00100 00100",
    "8": "01110 10001 10001 01110 10001 10001 01110",
    "9": "01110 10001 10001 01111 00001 00001 01110",
    " ": "000 000 000 000 000 000 000",
}


def lettering(text: str, height: float, depth: float = 0.02, most: float = np.inf) -> Solid:
    """The text in the plane y = 0, its middle at the origin, raised towards -Y; narrower letters if it exceeds `most`."""
    rows = np.hstack([np.hstack([_glyph(c), np.zeros((7, 1), bool)]) for c in text])[:, :-1]
    tall = height / 7
    wide = min(tall, most / rows.shape[1])
    middle = np.array([rows.shape[1] / 2, 3.5])
    boxes: list[Solid] = []
    for top, bottom, left, right in _rectangles(rows):
        x, z = (np.array([left, right]) - middle[0]) * wide, (middle[1] - np.array([bottom, top])) * tall
        boxes.append(cuboid((x[0], -depth, z[0]), (x[1], 0.002, z[1])))
    return join(*boxes)


def _glyph(letter: str) -> NDArray[np.bool_]:
    return np.array([[c == "1" for c in row] for row in _GLYPHS[letter].split()])


def _rectangles(cells: NDArray[np.bool_]) -> list[tuple[int, int, int, int]]:
    """(top, bottom, left, right) of rectangles that cover all set cells once, the longer way first."""
    left = cells.copy()
    found: list[tuple[int, int, int, int]] = []
    for i, j in np.argwhere(cells):
        if not left[i, j]:
            continue
        down, right = i, j
        while down < len(left) and left[down, j]:
            down += 1
        while right < left.shape[1] and left[i, right]:
            right += 1
        a, b = (down, j + 1) if down - i >= right - j else (i + 1, right)
        left[i:a, j:b] = False
        found.append((int(i), int(a), int(j), int(b)))
    return found
