"""Polygons to triangles: areas by the shoelace, and which points the triangles cover."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polygons import comb, is_inside, shoelace, star, turned
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.dae.mesh import without_holes
from viewsphere.assets.readers.shared.polygon_proof import cut_polygons

SEEDS = st.integers(0, 2**32 - 1)


def cut(points, ring):
    """Areas of the triangles of a ring, and the warnings."""
    folder = ModelFolder(Path("a.obj"))
    triangles, _ = cut_polygons(folder, points, ring, np.array([len(ring)]))
    a, b, c = (points[ring[triangles[:, i]]] for i in range(3))
    return ring[triangles], np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, folder.warnings


def covers(flat, triangles, points):
    """How many triangles lie over each point."""
    return sum(is_inside(flat[triangle], points).astype(int) for triangle in triangles)


@given(SEEDS, st.integers(4, 40))
def test_stars_in_any_plane_are_covered_once(seed, corners):
    rng = np.random.default_rng(seed)
    flat = star(rng, corners)
    triangles, areas, warnings = cut(turned(rng, flat), np.arange(corners))
    assert areas.sum() == pytest.approx(shoelace(flat), rel=1e-9)
    probes = rng.uniform(-1, 1, (200, 2))
    np.testing.assert_array_equal(covers(flat, triangles, probes), is_inside(flat, probes))
    assert not warnings


@given(SEEDS, st.integers(1, 8), st.integers(0, 33), st.booleans())
def test_combs_are_covered_once(seed, teeth, shift, is_backwards):
    """No fan of any corner covers them, whichever comes first and whichever way they turn."""
    rng = np.random.default_rng(seed)
    flat = np.roll(comb(teeth), shift, axis=0)
    flat = flat[::-1] if is_backwards else flat
    _, areas, warnings = cut(turned(rng, flat), np.arange(len(flat)))
    assert areas.sum() == pytest.approx(abs(shoelace(flat)), rel=1e-9)
    assert areas.sum() == pytest.approx(2 * teeth + 2 * teeth - 1)
    assert not warnings


@given(SEEDS, st.integers(1, 3), st.floats(0.2, 1.0))
def test_holes_stay_open(seed, side, share):
    """Holes of a grid that turn either way, in a star-shaped outline in any plane."""
    rng = np.random.default_rng(seed)
    outline = 10 * star(rng, 30, least=0.9)
    step = 11 / (2 * side + 1)
    centers = [np.array([i, j]) * step for i in range(-side, side + 1) for j in range(-side, side + 1)]
    holes = [c + 0.45 * step * star(rng, int(rng.integers(3, 10))) for c in centers if rng.random() < share]
    holes = [hole[:: rng.choice([-1, 1])] for hole in holes]
    flat = np.concatenate([outline, *holes])
    ends = np.cumsum([0, len(outline), *map(len, holes)])
    points = turned(rng, flat)
    ring = without_holes(points, [np.arange(start, end) for start, end in pairwise(ends)])
    assert len(ring) == len(flat) + 2 * len(holes)
    triangles, areas, warnings = cut(points, ring)
    assert areas.sum() == pytest.approx(shoelace(outline) - sum(abs(shoelace(hole)) for hole in holes), rel=1e-9)
    probes = rng.uniform(-10, 10, (100, 2))
    inside = is_inside(outline, probes) & ~np.any([is_inside(hole, probes) for hole in holes] or [np.zeros(100, bool)], axis=0)
    np.testing.assert_array_equal(covers(flat, triangles, probes), inside)
    assert not warnings


@pytest.mark.parametrize(
    ("points", "warning"),
    [
        (
            [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],
            "1 polygon of 1 with more than 3 corners crosses",
        ),
        ([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 2, 0)], "crosses or overlaps itself"),
        ([(0, 0, 0), (1, 0, 0.5), (1, 1, 0), (0, 1, 0.5)], "is far from flat"),
        ([(0, 0, 0), (1, 0, 0.1), (1, 1, 0), (0, 1, 0.1)], None),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], None),
        ([(0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], None),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], None),
    ],
)
def test_what_triangles_do_not_fill_is_a_warning(points, warning):
    _, _, warnings = cut(np.array(points, float), np.arange(len(points)))
    assert [warning in line for line in warnings] == ([] if warning is None else [True])
