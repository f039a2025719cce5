"""The page docs/lens-proofs.md: tables of docs/lenses.json, which benchmarks/measure_lenses writes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from viewsphere import plugins
from viewsphere.plugins.lens import LensSpec

HEAD = """# Proofs of lenses

This page is for you if you need to trust the labels of a lens. At its end you know the largest error of each label for each
lens, and which formats hold the lens.

## Labels

An independent program finds each pixel's surface, and computes all labels from there (`benchmarks/measure_lenses`). Its rays
come from each lens's published formula, inverted by Newton's method in float64. Embree finds the surface; brute force
decides along edges and wherever the two disagree. The program shares only the triangles, their poses, and the camera's R, t and
K with viewsphere. The tables compare the labels that a data set stores.

Two scenes of the zoo are a street with a moving car ({triangles}), and chairs, a table and a moving post box on the ground.
Two downloaded models are a guitar and a car. Each scene has two instants, in pictures of about {pixels:,} pixels.

A cell is the largest error. *Refused* means that viewsphere refuses the label for the lens. Errors of distances beyond 10 m are
as at 10 m, and flow above 10 pixels is as at 10 pixels, because float32 stores a share of the number.
"""
PIXELS = {
    "projection": "projection, px",
    "instances": "wrong pixels",
    "depth": "depth, m",
    "depth_ray": "depth_ray, m",
    "position": "position, m",
    "coordinates": "coordinates, m",
    "nocs": "nocs",
    "barycentrics": "barycentrics, m",
    "normals": "normals",
    "normals_geometric": "normals_geometric",
    "flow": "flow, px",
    "disparity": "disparity, px",
}
OBJECTS = {
    "mask": "mask, px",
    "box2d": "box2d, px",
    "box2d_projected": "box2d_projected, px",
    "amodal": "amodal, px",
    "visibility": "visibility",
    "keypoints": "keypoints, px",
    "keypoint_states": "wrong states",
}
COUNTED = ("instances", "keypoint_states", "mask", "amodal")
"""Labels whose cell is a number of wrong values, with the number of ties if there are any."""

PIXELS_HEAD = """
### Labels of pixels

*Wrong pixels* counts pixels with the wrong object, class, triangle or distance. Of surfaces in one place, the first in the
scene's order is right. A *tie* is a pixel whose ray passes an edge within 1e-9 of the triangle's size.

"""
OBJECTS_HEAD = """
### Labels of objects

`visibility` includes the truncated share. The last column compares the pictures of ids with Cycles' own pass of object ids, in
lenses that Blender has. Cycles computes in float32, so pixels at outlines may differ.

"""
FORMATS_HEAD = """
## Formats

Each format holds a lens, or refuses it in one line before rendering.

Lenses: {lenses}.

| formats | lenses that they hold | refusals expect |
|---|---|---|
"""


def lens_page(known: dict[str, Any], agree: Callable[[str, Collection[str], Collection[str]], None]) -> str:
    """The page of these figures; `agree` stops where they are those of other lenses or formats."""
    rows, formats = known["rows"], known["formats"]
    specs = plugins.loadable(LensSpec)
    own = {name for name, spec in specs.items() if not spec.is_scan and not plugins.is_third_party("lenses", name)}
    agree("lenses.json: rows", {row["lens"] for row in rows}, own)
    agree("lenses.json: formats", formats, set(plugins.names("formats")) - {"tapvid"})
    text = HEAD.format(pixels=known["size"][0] * known["size"][1], triangles="340,000 triangles")
    text += PIXELS_HEAD + table(rows, PIXELS) + OBJECTS_HEAD + table(rows, OBJECTS, {"Cycles": cycles})
    return text + FORMATS_HEAD.format(lenses=", ".join(row["words"] for row in rows)) + format_rows(formats)


def table(rows: list[dict[str, Any]], heads: dict[str, str], more: dict[str, Callable[[Any], str]] | None = None) -> str:
    """A row for each lens."""
    named = more or {}
    text = f"| lens | {' | '.join((*heads.values(), *named))} |\n|---{'|---' * (len(heads) + len(named))}|\n"
    for row in rows:
        cells = (cell(row, label) for label in heads)
        text += f"| {row['words']} | {' | '.join((*cells, *(make(row) for make in named.values())))} |\n"
    return text


def cell(row: dict[str, Any], label: str) -> str:
    """The figure of a label."""
    if label in row["refused"] or label not in row["cells"]:
        return "refused"
    found = row["cells"][label]
    if label in COUNTED:
        ties = f", {found['ties']:,} ties" if found["ties"] else ""
        return f"{found['wrong']:,} of {found['compared']:,}{ties}"
    return f"{found['error']:g}" + (f", {found['wrong']:,} wrong" if found["wrong"] else "")


def cycles(row: dict[str, Any]) -> str:
    """The comparison with Blender."""
    found = row["cycles"]
    if found is None:
        return "resampled"
    return f"{found['beyond']:,} px; at outlines {found['edges']:,}"


def format_rows(formats: dict[str, dict[str, str | None]]) -> str:
    """A row for formats of equal answers: the lenses that they hold, and what they expect of others."""
    groups = dict[tuple[str, str], list[str]]()
    for name, answers in formats.items():
        held = [words for words, reason in answers.items() if reason is None]
        expected = dict.fromkeys(short(name, reason) for reason in answers.values() if reason is not None)
        groups.setdefault(("all" if not expected else ", ".join(held), "<br>".join(expected)), []).append(f"`{name}`")
    return "".join(f"| {', '.join(names)} | {held} | {expected} |\n" for (held, expected), names in groups.items())


def short(name: str, reason: str) -> str:
    """The part of a refusal that says what the format expects."""
    return reason.removeprefix(f"formats: format {name}: expected ").partition("; found")[0]
