"""The drawings of docs/conventions.md, from the conventions, and of docs/performance.md, from benchmarks/history.json."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import orbit_rotation

Points = NDArray[np.float64]

INK, PALE, RED, GREEN, BLUE, FACE = "#263238", "#b0bec5", "#c62828", "#2e7d32", "#1565c0", "#80cbc4"
AXES = ((RED, "x"), (GREEN, "y"), (BLUE, "z"))
BOX = Box3d.between((-1, -1, -1), (1, 1, 1)).corners
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
FRONT = (1, 5, 6, 2)


def svg(width: int, height: int, parts: Iterable[str]) -> str:
    """A whole file, on white, so that it can be read on dark pages."""
    size = f'viewBox="0 0 {width} {height}" width="{width}" font-family="sans-serif" font-size="14"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    tip = '<path d="M0 0L8 4L0 8z" fill="context-stroke"/>'
    arrow = f'<marker id="tip" orient="auto" refX="7" refY="4" markerWidth="6" markerHeight="6">{tip}</marker>'
    back = f'<rect width="{width}" height="{height}" rx="8" fill="white"/>'
    return "\n".join([head, f"<defs>{arrow}</defs>", back, *parts, "</svg>"]) + "\n"


def line(a: Sequence[float], b: Sequence[float], color: str = INK, width: float = 1.5, more: str = "") -> str:
    x0, y0, x1, y1 = (f"{value:.1f}" for value in (*a, *b))
    return f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="{color}" stroke-width="{width:g}" {more}/>'


def arrow(a: Sequence[float], b: Sequence[float], color: str) -> str:
    return line(a, b, color, 2.5, 'marker-end="url(#tip)"')


def words(at: Sequence[float], text: str, color: str = INK, anchor: str = "middle", shift: Sequence[float] = (0, 0)) -> str:
    x, y = at[0] + shift[0], at[1] + shift[1]
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" text-anchor="{anchor}">{text}</text>'


def dot(at: Sequence[float], color: str = INK) -> str:
    return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="4" fill="{color}"/>'


def polygon(points: Iterable[Sequence[float]], color: str) -> str:
    return f'<polygon points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" fill="{color}" fill-opacity="0.5"/>'


def rotation(azimuth: float, elevation: float) -> Points:
    """World to camera for a viewpoint in degrees: rows are the camera's x right, y down, z forward."""
    return orbit_rotation(*np.radians((azimuth, elevation)))


def seen(
    points: NDArray[np.float64], azimuth: float, elevation: float, scale: float, at: Sequence[float]
) -> NDArray[np.float64]:
    """Points on paper, seen from far away."""
    return (np.atleast_2d(points) @ rotation(azimuth, elevation).T)[:, :2] * scale + np.array(at)


def box() -> str:
    """The 3D box: vertices, faces and the object's axes."""
    size = np.array([0.8, 1.5, 0.7])
    on = lambda points: seen(np.asarray(points, float), 35, 25, 110, (270, 190))  # noqa: E731
    corners = on(BOX * size)
    parts = [polygon(corners[list(FRONT)], FACE)]
    parts += [line(corners[a], corners[b]) for a, b in EDGES]
    centre = corners.mean(axis=0)
    for i, corner in enumerate(corners):
        away = (corner - centre) / np.linalg.norm(corner - centre)
        parts += [dot(corner), words(corner + away * 16, str(i), shift=(0, 5))]
    origin = on([(0, 0, 0)])[0]
    for (color, name), axis in zip(AXES, np.eye(3), strict=True):
        tip = on([axis * 0.75])[0]
        parts += [arrow(origin, tip, color), words(tip, name, color, shift=(12, 2))]
    parts.append(words(corners[list(FRONT)].mean(axis=0), "front", shift=(0, 5)))
    parts.append(words((270, 385), "front 1562 (faces -Y), back 4037, left 0451, right 2673, bottom 0123, top 4765"))
    return svg(560, 400, parts)


def axes() -> str:
    """World, object and camera: azimuth from the front, elevation from the horizon."""
    on = lambda points: seen(np.asarray(points, float), -25, 22, 85, (230, 215))  # noqa: E731
    origin = on([(0, 0, 0)])[0]
    turn, rise, far = np.radians(60), np.radians(32), 4.0
    camera = far * np.array([np.cos(rise) * np.sin(turn), -np.cos(rise) * np.cos(turn), np.sin(rise)])
    below = camera * (1, 1, 0)
    size = np.array([0.35, 0.7, 0.3])
    corners = on(BOX * size)
    parts = [polygon(corners[list(FRONT)], FACE), *(line(corners[a], corners[b], PALE) for a, b in EDGES)]
    for (color, name), axis in zip(AXES, np.eye(3), strict=True):
        tip = on([axis * 1.6])[0]
        parts += [arrow(origin, tip, color), words(tip, f"world {name}", color, "start", (12, 2))]
    front = on([(0, -2.6, 0)])[0]
    dashed = 'stroke-dasharray="5 4"'
    parts += [line(origin, front, INK, 1, dashed), line(origin, on([below])[0], INK, 1, dashed)]
    parts += [line(on([below])[0], on([camera])[0], INK, 1, dashed), line(origin, on([camera])[0], INK, 1, dashed)]
    parts.append(words(front, "front: -Y, azimuth 0", shift=(0, 18)))
    parts += curve(on([1.9 * np.array([np.sin(t), -np.cos(t), 0]) for t in np.linspace(0, turn, 12)]), "azimuth", (0, 20))
    level = below / np.linalg.norm(below)
    rising = [1.7 * (level * np.cos(t) + np.array([0, 0, np.sin(t)])) for t in np.linspace(0, rise, 12)]
    parts += curve(on(rising), "elevation", (44, -14))
    for (color, name), axis in zip(AXES, rotation(np.degrees(turn), np.degrees(rise)), strict=True):
        start, tip = on([camera, camera + axis * 0.9])
        meaning = {"x": "x right", "y": "y down", "z": "z forward"}[name]
        parts += [arrow(start, tip, color), words(tip, meaning, color, shift=(0, 18 if name == "y" else -10))]
    parts += [dot(on([camera])[0]), words(on([camera])[0], "camera", shift=(38, 4))]
    return svg(640, 330, parts)


def curve(points: Points, name: str, shift: Sequence[float]) -> list[str]:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return [
        f'<polyline points="{path}" fill="none" stroke="{INK}" stroke-width="1.5"/>',
        words(points[6] + np.array(shift), name),
    ]


def pixels() -> str:
    """A picture of 5 x 3 pixels: its corners, the pixels' centres, a half-open box."""
    step, left, top = 80, 90, 60
    at = lambda x, y: (left + x * step, top + y * step)  # noqa: E731
    parts = [polygon([at(1, 1), at(3, 1), at(3, 2), at(1, 2)], FACE)]
    parts += [line(at(x, 0), at(x, 3), PALE) for x in range(6)] + [line(at(0, y), at(5, y), PALE) for y in range(4)]
    parts += [line(at(*a), at(*b), INK, 2) for a, b in (((0, 0), (5, 0)), ((5, 0), (5, 3)), ((5, 3), (0, 3)), ((0, 3), (0, 0)))]
    parts += [dot(at(x + 0.5, y + 0.5), PALE) for x in range(5) for y in range(3)]
    parts += [dot(at(0, 0), RED), words((left, top - 12), "(0, 0)", RED)]
    parts += [dot(at(5, 3), RED), words(at(5, 3.3), "(W, H) = (5, 3)", RED)]
    parts += [dot(at(0.5, 0.5), BLUE), words((left + 40, top + 62), "(0.5, 0.5)", BLUE)]
    parts += [dot(at(2.5, 1.5), GREEN), words(at(2.62, 1.38), "(cx, cy) = (W/2, H/2)", GREEN, "start")]
    parts.append(words(at(1.62, 1.9), "box (1, 1, 3, 2)"))
    parts.append(
        words(
            (left + 230, 350), "blue: the centre of the first pixel, which OpenCV calls (0, 0): add 0.5 to the corners it finds"
        )
    )
    return svg(640, 365, parts)


HISTORY = Path(__file__).parent.parent / "benchmarks" / "history.json"


def history() -> str:
    """A column for each release: a whole frame without and with smooth edges, in units of Embree's time."""
    releases = json.loads(HISTORY.read_text("utf-8"))
    left, base, step, unit = 110, 250, 150, 130
    width = left + step * len(releases) + 20
    parts = [words((left - 10, base - level * unit + 5), f"{level:g}", anchor="end") for level in (0, 0.5, 1, 1.5)]
    parts += [line((left, base - level * unit), (width - 20, base - level * unit), PALE) for level in (0, 0.5, 1, 1.5)]
    parts += [words((20, base - unit + 5), "Embree", anchor="start"), words((left, 30), "CPU time of a frame", anchor="start")]
    parts += [
        words((left + 210, 30), "plain", BLUE, "start"),
        words((left + 260, 30), "4x edges", GREEN, "start"),
    ]
    for column, release in enumerate(releases):
        x = left + step * (column + 0.5)
        parts.append(words((x, base + 25), release["version"]))
        measured = [(color, release[name]) for color, name in ((BLUE, "frame"), (GREEN, "smooth_frame")) if name in release]
        for color, ratio in measured:
            at = (x, base - ratio * unit)
            parts += [dot(at, color), words(at, f"{ratio:.2f}", color, "start", (10, 5))]
        if not measured:
            parts.append(words((x, base - 10), "not measured"))
    return svg(width, 290, parts)


FIGURES = {"images/axes.svg": axes, "images/box.svg": box, "images/pixels.svg": pixels, "images/history.svg": history}
