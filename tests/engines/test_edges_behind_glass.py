"""Outlines seen through something are as smooth as those in front."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from test_raster import CARD_UV, box, camera, card, mesh_of, picture, stage_of, unlit

from quick import quick
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.codecs.srgb import linear as linear_light
from viewsphere.engines.raster.antialiasing.samples import differs_behind, edge_samples, layers
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.scene import Background, Finish, Scene, ViewTransform
from viewsphere.truth.raster.visibility import rasterize

SIZE, FINE = 48, 8
GREY = Background(color=(0.6, 0.6, 0.6))
LIGHT = Scene(sun=None, finish=Finish(background=GREY, view=ViewTransform(transform="raw")))
WALL = unlit(color=(0.7, 0.7, 0.7, 1.0))
DARK = unlit(color=(0.05, 0.05, 0.05, 1.0))
FILM = unlit(color=(0.1, 0.2, 0.4, 0.5), alpha_mode="BLEND")
PANE = Material(base_color=(0.9, 0.95, 0.9, 1.0), transmission=1.0, roughness=0.3)
LENSES = {
    "pinhole": None,
    "barrel": lens_parameters("brown_conrady", coefficients=(-0.2, 0.05, 0.001, -0.002)),
    "fisheye": lens_parameters("fisheye", coefficients=(0.02, -0.01, 0.0, 0.0)),
}

NAMES = ("box", "open", "sheet", "hole", "decal")
PAIRS = [(name, (FILM, PANE)[(i + j) % 2], lens) for i, name in enumerate(NAMES) for j, lens in enumerate(LENSES)]
"""Each scene with each pane and each lens, each pane with each lens."""


def scene_of(*surfaces, **fields):
    """One mesh of several surfaces: of each its triangles (T, 3, 3) and its material."""
    mesh = mesh_of(np.concatenate([triangles for triangles, _ in surfaces]), **fields)
    numbers = np.repeat(np.arange(len(surfaces)), [len(triangles) for triangles, _ in surfaces])
    return replace(mesh, triangle_material=numbers.astype(np.int32), materials=tuple(m for _, m in surfaces))


def turned(triangles, degrees):
    """Around the line of sight."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.asarray(triangles) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def behind(pane):
    """What there is behind a pane that covers the picture: a dark slanted box before a wall or before nothing, a see-through
    sheet that ends, a sheet with a hole; and a see-through sheet that lies on the wall, without the pane.
    """
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[2:6, 2:6, 3] = 0
    holed = replace(DARK, base_color_texture=Texture(0, nearest=True), alpha_mode="MASK")
    wall, front = card(40, 40, y=4.0), card(40, 40, y=-1.0)
    slanted = turned(box((-0.7, 0, -0.9), (0.7, 1.0, 0.9)), 17)
    return {
        "box": scene_of((wall, WALL), (slanted, DARK), (front, pane)),
        "open": scene_of((slanted, DARK), (front, pane)),
        "sheet": scene_of((wall, WALL), (turned(card(1.5, 1.9), 17), FILM), (front, pane)),
        "hole": scene_of(
            (turned(card(3.0, 3.0), 17), holed),
            (wall, WALL),
            (front, pane),
            uv0=np.concatenate([CARD_UV, CARD_UV * 0, CARD_UV * 0]),
            images=(Image("hole", pixels),),
        ),
        "decal": scene_of((card(40, 40), WALL), (turned(card(1.5, 1.9), 17), FILM)),
    }


def view_of(lens, scale=1):
    return camera(SIZE * scale, SIZE * scale, 40.0 * scale, distance=3.0, distortion=lens)


def light_of(mesh, lens, scale, antialias):
    """The picture's green, linear."""
    return linear_light(picture(mesh, LIGHT, view_of(lens, scale), antialias=antialias)[..., 1] / 255)


def errors(mesh, lens):
    """By how much of the step between both sides pixels on an edge differ from one of 64 samples a pixel: those of the
    picture with anti-aliasing, and without.
    """
    fine = light_of(mesh, lens, FINE, 1)
    blocks = fine.reshape(SIZE, FINE, SIZE, FINE)
    step = blocks.max(axis=(1, 3)) - blocks.min(axis=(1, 3))
    is_edge = step > 0.5 * (fine.max() - fine.min())
    assert is_edge.sum() > 60
    mean, step = blocks.mean(axis=(1, 3))[is_edge], step[is_edge]
    return tuple(np.abs(light_of(mesh, lens, 1, antialias)[is_edge] - mean) / step for antialias in (4, 1))


@pytest.mark.parametrize(("name", "pane", "lens"), quick(PAIRS, *PAIRS[::2]))
@pytest.mark.slow
def test_outlines_behind_a_pane_are_smooth(name, pane, lens):
    """Of a straight edge's coverage four samples know 0.09 or so, and at worst 0.25; one sample 0.25 and 0.5."""
    smooth, jagged = errors(behind(pane)[name], LENSES[lens])
    assert smooth.max() <= 0.3
    assert smooth.mean() <= 0.11
    assert jagged.max() > 0.48
    assert jagged.mean() > 0.2


@pytest.mark.parametrize("name", ["box", "sheet"])
def test_other_pixels_stay_as_they_are(name):
    """Away from outlines pixels are those of the picture without anti-aliasing, to the byte."""
    mesh = behind(PANE)[name]
    smooth, plain = (picture(mesh, LIGHT, view_of(None), antialias=antialias) for antialias in (4, 1))
    is_on_edge = np.zeros((SIZE, SIZE), bool)
    for axis in (0, 1):
        differs = (np.abs(np.diff(plain.astype(int), axis=axis)) > 3).any(axis=-1)
        for side in (0, 1):
            place = [slice(None)] * 2
            place[axis] = slice(side, side + SIZE - 1)
            is_on_edge[tuple(place)] |= differs
    assert 100 < is_on_edge.sum() < 300
    assert np.array_equal(smooth[~is_on_edge], plain[~is_on_edge])


def marked(mesh, radiance):
    """The stage, what is visible, and the marks, where these are the pixels' colours."""
    baked, view = stage_of(mesh, LIGHT).baked(0), view_of(None)
    visibility = rasterize(baked.geometry, view)
    shown = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    stack = layers(baked.blended, view, *shown, baked.see_through)
    marks = differs_behind(visibility, stack, baked.owner, baked.geometry.triangle_normals, radiance)
    return baked, visibility, marks


@pytest.mark.parametrize(("has_pane", "size"), [(True, SIZE**2), (False, 0)])
def test_nothing_is_marked_where_all_is_even(has_pane, size):
    """A wall behind a pane has no outlines, whatever its colours, and a scene without the pane is not looked at."""
    surfaces = [(card(40, 40, y=4.0), WALL), (card(40, 40, y=-1.0), PANE)]
    colors = np.random.default_rng(0).uniform(0, 1, (SIZE**2, 4)).astype(np.float32)
    baked, visibility, marks = marked(scene_of(*surfaces[: 1 + has_pane]), colors)
    assert len(marks) == size
    assert not marks.any()
    assert edge_samples(baked.geometry, view_of(None), visibility, baked.owner, marks) is None


@pytest.mark.parametrize("name", NAMES)
def test_an_outline_of_which_nothing_shows_is_not_marked(name):
    """All colours may be the same behind what is nearly opaque; where they differ, both sides of the outline are marked."""
    colors = np.random.default_rng(0).uniform(0, 1, (SIZE**2, 4)).astype(np.float32)
    baked, visibility, marks = marked(behind(FILM)[name], colors)
    assert 100 < np.count_nonzero(marks) < 600
    samples = edge_samples(baked.geometry, view_of(None), visibility, baked.owner, marks)
    assert np.array_equal(np.sort(samples.pixels), np.flatnonzero(marks))
    assert not marked(behind(FILM)[name], 0.5 + 0.005 * colors)[2].any()
