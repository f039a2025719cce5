"""Voxels as a picture: from behind the camera, above and to the left."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.model.annotations.classes import class_colors
from viewsphere.model.annotations.voxels import OCCLUDED, OUTSIDE
from viewsphere.model.sample import Sample

Picture = NDArray[np.uint8]
Float = NDArray[np.float64]

BACKGROUND = np.array([24, 26, 32])
TURN, RISE = math.radians(25), math.radians(30)
INTO = np.array([math.cos(RISE) * math.cos(TURN), -math.sin(RISE), math.cos(RISE) * math.sin(TURN)])
ACROSS = np.array([-math.sin(TURN), 0.0, math.cos(TURN)])
DOWN = np.array([-math.sin(RISE) * math.cos(TURN), -math.cos(RISE), -math.sin(RISE) * math.sin(TURN)])
"""Directions of the picture among the grid's axes ahead, up and right."""

FACES = ((1, 1, 1.0), (0, -1, 0.75), (2, -1, 0.55))
"""The visible sides of cells: axis, direction that they face, brightness."""

MARGIN = 0.96
"""Share of the picture that the voxels fill."""


def drawn(sample: Sample) -> Picture:
    """Return a picture (H, W, 3) of the cells that are not empty. Objects have their own colours, stuff has the colours of
    `semantic`. Cells that the camera does not see are darker, and cells outside of its picture are pale.
    """
    grid = sample.voxel_grid
    light = _light(grid.classes > 0)
    where = np.nonzero(light)
    cells = np.column_stack(where).astype(np.float64)
    out = np.full((sample.height, sample.width, 3), BACKGROUND, np.uint8)
    if not len(cells):
        return out
    classes, instances, state = grid.classes[where], grid.instances[where], grid.state[where]
    color = class_colors(int(classes.max()) + 1)[classes].astype(np.float64)
    for i in np.unique(instances[instances > 0]).tolist():
        color[instances == i] = color_of(i)
    color *= light[where][:, None]
    color[state == OCCLUDED] *= 0.6
    color[state == OUTSIDE] = 0.4 * color[state == OUTSIDE] + 0.6 * BACKGROUND
    _put(out, cells, color.astype(np.uint8))
    return out


def _light(full: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the brightness of each cell, on the first of its sides that nothing covers; 0 for covered and empty cells."""
    out = np.zeros(full.shape, np.float32)
    for axis, way, light in FACES:
        beside = np.zeros_like(full)
        here, there = [slice(None)] * 3, [slice(None)] * 3
        here[axis], there[axis] = (slice(None, -1), slice(1, None)) if way > 0 else (slice(1, None), slice(None, -1))
        beside[tuple(here)] = full[tuple(there)]
        out[(out == 0) & full & ~beside] = light
    return out


def _put(out: Picture, cells: Float, color: Picture) -> None:
    """Paint cells (N, 3), far cells first, as large as fits."""
    height, width = out.shape[:2]
    order = np.argsort(-_along(cells, INTO), kind="stable")
    x, y = _along(cells[order], ACROSS), _along(cells[order], DOWN)
    scale = MARGIN * min(width / (np.ptp(x) + 2), height / (np.ptp(y) + 2))
    side = max(1, math.ceil(1.3 * scale))
    x = (x - (x.max() + x.min()) / 2) * scale + (width - side) / 2
    y = (y - (y.max() + y.min()) / 2) * scale + (height - side) / 2
    place = np.arange(side)
    columns = np.clip(np.floor(x).astype(np.int64)[:, None, None] + place, 0, width - 1)
    rows = np.clip(np.floor(y).astype(np.int64)[:, None, None] + place[:, None], 0, height - 1)
    rows, columns = np.broadcast_arrays(rows, columns)
    out[rows, columns] = color[order][:, None, None]  # the last one stays


def _along(cells: Float, direction: Float) -> Float:
    return cells[:, 0] * direction[0] + cells[:, 1] * direction[1] + cells[:, 2] * direction[2]
