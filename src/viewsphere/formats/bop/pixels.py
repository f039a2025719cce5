"""The origin from which a data set of BOP's counts pixels, estimated from its masks.

BOP's documentation and back-projection have the centre of the first pixel at (0, 0), and so have pictures and depth. The tools
that make masks and scene_gt_info may differ. bop_toolkit's renderer has the corner of the first pixel there. BlenderProc's
writer makes masks with pyrender. It takes the first sample of several in a pixel, wherever the graphics card has that sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.cache import load_normalised
from viewsphere.codecs.size import opened
from viewsphere.formats.bop.cads import model_spec
from viewsphere.formats.bop.reading import Frame, object_pose
from viewsphere.formats.shared.again import pose_of
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.store.again import AgainModel
from viewsphere.store.paths import file_inside
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

MOST = 12
"""Masks that are compared, evenly over all."""

CLEARLY = 0.5
"""A shift is believed where it leaves less than this share of the pixels that differ."""

LEAST = 100
"""Pixels of a mask that is compared."""

STARTS = ((0.0, 0.0), (-0.5, -0.5))
STEP = 0.125
MOST_STEPS = 8
"""Of a search from the better start on, in parts of a pixel, to whichever neighbour fits best."""

Shift = tuple[float, float]


@dataclass(frozen=True)
class Fit:
    """The shift in pixels to add to cx and cy so that masks fit. `differed` and `differs` are the shares of their pixels that
    differ from the models' pixels, without this shift and with it.
    """

    shift: Shift = (0.0, 0.0)
    differed: float = 0.0
    differs: float = 0.0


def fit(frames: Sequence[Frame], models: Mapping[str, AgainModel]) -> Fit:
    """The shift that whole masks have against the models in their poses; none where that is not clear, or where there are no
    masks. Raises ModelError for models that cannot be read, StoreError for masks that are none.
    """
    masks = [(frame, n, mask) for frame, n in _chosen(frames) if np.count_nonzero(mask := _mask(frame, n)) >= LEAST]
    if not masks:
        return Fit()

    @cache
    def differ(shift: Shift) -> int:
        return sum(int(np.count_nonzero(mask ^ _silhouette(frame, n, models, shift))) for frame, n, mask in masks)

    best = min(STARTS, key=differ)
    for _ in range(MOST_STEPS):
        x, y = best
        around = product((x - STEP, x, x + STEP), (y - STEP, y, y + STEP))
        best, before = min((best, *around), key=differ), best
        if best == before:
            break
    pixels = sum(int(np.count_nonzero(mask)) for _, _, mask in masks)
    found = best if differ(best) < CLEARLY * differ(STARTS[0]) else STARTS[0]
    return Fit(found, differ(STARTS[0]) / pixels, differ(found) / pixels)


def shifted(lens: Intrinsics, shift: Shift) -> Intrinsics:
    """The lens with its principal point moved."""
    return lens.model_copy(update={"cx": lens.cx + shift[0], "cy": lens.cy + shift[1]})


def _chosen(frames: Sequence[Frame]) -> Iterator[tuple[Frame, int]]:
    """Some objects that have masks, and the pictures that show them."""
    every = max(1, len(frames) // MOST)
    chosen = [(frame, n) for frame in frames[::every] for n in range(len(frame.gt)) if _file(frame, n).is_file()]
    yield from chosen[:: max(1, len(chosen) // MOST)][:MOST]


def _file(frame: Frame, n: int) -> Path:
    return file_inside(frame.scene, f"mask/{frame.image:06d}_{n:06d}.png")


def _mask(frame: Frame, n: int) -> NDArray[np.bool_]:
    with opened(_file(frame, n)) as image:
        mask = np.asarray(image.convert("L")) > 127
    frame.check(_file(frame, n), mask)
    return mask


def _silhouette(frame: Frame, n: int, models: Mapping[str, AgainModel], shift: Shift) -> NDArray[np.bool_]:
    file = models[str(frame.gt[n]["obj_id"])].source
    assert isinstance(file, Path)
    spec = model_spec(file)
    thing = Thing(id=1, model=spec, motion=Motion.still(pose_of(object_pose(frame.gt[n]))))
    geometry = build_geometry((thing,), (load_normalised(spec),), False, 0.01)
    return rasterize(geometry, Camera(shifted(frame.camera.intrinsics, shift), np.eye(3), np.zeros(3))).triangle >= 0
