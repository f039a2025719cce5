"""Where a data set of BOP's counts pixels from, as its masks tell.

BOP's documentation and back-projection have the centre of the first pixel at (0, 0), as pictures and depth have it. The renderers of
bop_toolkit (vispy) and of BlenderProc's writer (pyrender), which make masks and scene_gt_info, have its corner there: masks that they
make lie half a pixel beside the pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.cache import load_normalised
from viewsphere.codecs.size import opened
from viewsphere.formats._again import pose_of
from viewsphere.formats.bop.reading import Frame, object_pose
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Motion, Thing
from viewsphere.store.again import AgainModel
from viewsphere.store.paths import file_inside
from viewsphere.truth.geometry import build_geometry
from viewsphere.truth.visibility import rasterize

MOST = 12
"""Masks that are compared, evenly over all."""

CLEARLY = 0.5
"""A count from the corner is believed where it leaves less than this share of the pixels that differ."""

LEAST = 100
"""Pixels of a mask that is compared."""


@dataclass(frozen=True)
class Fit:
    """Pixels of masks, and how many of them differ from the models' as pixels count from the centre or the corner of the first."""

    pixels: int = 0
    of_centre: int = 0
    of_corner: int = 0

    @property
    def is_corner(self) -> bool:
        """Whether the masks count from the corner."""
        return self.of_corner < CLEARLY * self.of_centre


def fit(frames: Sequence[Frame], models: Mapping[str, AgainModel]) -> Fit:
    """How well whole masks fit the models in their poses; all 0 where there are none. Raises ModelError for models that cannot be
    read, StoreError for masks that are none.
    """
    pixels = np.zeros(3, np.int64)
    for frame, n in _chosen(frames):
        mask = _mask(frame, n)
        if np.count_nonzero(mask) >= LEAST:
            lens, shown = frame.camera.intrinsics, models[str(frame.gt[n]["obj_id"])]
            differ = [np.count_nonzero(mask ^ _silhouette(frame, n, shown, one)) for one in (lens, from_corner(lens))]
            pixels += [np.count_nonzero(mask), *differ]
    return Fit(*pixels.tolist())


def from_corner(lens: Intrinsics) -> Intrinsics:
    """The lens of a K that was read as one of pixels' centres, if it counts from the first one's corner."""
    return lens.model_copy(update={"cx": lens.cx - 0.5, "cy": lens.cy - 0.5})


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


def _silhouette(frame: Frame, n: int, model: AgainModel, lens: Intrinsics) -> NDArray[np.bool_]:
    spec = ModelSpec(
        key="model",
        source=str(model.source),
        category="object",
        category_id=1,
        up=model.up,
        forward=model.forward,
        unit=model.unit,
        centring="as_is",
    )
    thing = Thing(id=1, model=spec, motion=Motion.still(pose_of(object_pose(frame.gt[n]))))
    geometry = build_geometry((thing,), (load_normalised(spec),), False, 0.01)
    return rasterize(geometry, Camera(lens, np.eye(3), np.zeros(3))).triangle >= 0
