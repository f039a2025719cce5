"""Matches: the position of each pixel's point in another sample, from geometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.mesh import Mesh
from viewsphere.errors import StoreError, UserError
from viewsphere.model.sample import Origin, Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Store, located
from viewsphere.truth.correspondences.rolling import match_between
from viewsphere.truth.shot_views import views_of
from viewsphere.truth.view import View

SHOTS = 4
"""Number of shots whose things are cached for the next matches."""


@dataclass(frozen=True, eq=False)
class Matches:
    """The positions of each pixel's point in another picture; returned by `viewsphere.matches`.

    Attributes:
        xy: (H, W, 2) float64, pixels (x, y) in the other picture, NaN where the point has no position.
        z: (H, W) float64, metres along the other camera's optical axis, infinite for the sky, NaN where `xy` is NaN.
        state: (H, W) uint8, 0 visible, 1 occluded, 2 outside, 3 behind, 4 invalid.
    """

    xy: NDArray[np.float64]
    z: NDArray[np.float64]
    state: NDArray[np.uint8]


def matches(a: Sample, b: Sample) -> Matches:
    """Match each pixel of `a` with its position in `b`, by geometry.

    Args:
        a: A sample of a sequence, or a still picture.
        b: Another sample of the same sequence, or another still picture of the same subject.

    Returns:
        Positions, depths and states, each with the size of `a`.

    Raises:
        UserError: The samples belong to different sequences or subjects.
        StoreError: The geometry of a sample is unknown, as for imported pictures.
    """
    shots = tuple(map(_shot_of, (a, b)))
    if a.sequence != b.sequence or (not a.sequence and _subject(shots[0]) != _subject(shots[1])):
        names = (sample.sequence or f"stills of {_subject(shot)}" for sample, shot in zip((a, b), shots, strict=True))
        raise UserError(
            f"matches: expected two samples of one sequence, or of one subject's stills; found {' and '.join(names)}"
        )
    one, other = (_view(sample, shot) for sample, shot in zip((a, b), shots, strict=True))
    found = match_between(one, one.visibility, other)
    z = np.where(np.isnan(found.xy[..., 0]), np.nan, found.xyz[..., 2])
    return Matches(found.xy, z, found.state)


def _shot_of(sample: Sample) -> Shot:
    origin = sample.origin
    if origin is None:
        raise StoreError(f"frame {sample.index}: expected a sample whose shot is kept; found one that was imported or merged")
    if origin.shot is not None:
        return origin.shot
    found = _stored(origin.root, origin.key)
    if found is None:
        raise StoreError(f"{origin.root}: frame {sample.index}: expected its shot {origin.key}, found none")
    return found


@lru_cache(maxsize=SHOTS)
def _stored(root: str, key: str) -> Shot | None:
    return Store(located(root)).shot(key)


def _subject(shot: Shot) -> str:
    return shot.things[0].model.key


def _view(sample: Sample, shot: Shot) -> View:
    """Return the view of a sample's sensor."""
    assert sample.origin is not None
    return views_of(shot, _meshes(sample.origin)).view(sample.origin.instant, sample.origin.sensor)


def _meshes(taken: Origin) -> Callable[[Thing], Mesh]:
    """The function that returns a thing's mesh: the export for a data set's objects, and the source for everything else."""

    def mesh(thing: Thing) -> Mesh:
        if taken.shot is None and thing.id:
            return _exported(taken.root, thing.model.key, thing.step and thing.step.frame)
        return _built(thing)

    return mesh


@lru_cache(maxsize=64)
def _exported(root: str, key: str, frame: int | None) -> Mesh:
    info = Store(located(root)).model_info(key)
    if info is None:
        raise StoreError(f"{root}: expected a finished model {key}, found none")
    shown = info.at_frame(frame)
    return read_exported(located(root) / shown.glb, shown.parts, shown.node)


def _built(thing: Thing) -> Mesh:
    return _models().model(thing.model, thing.step)


@lru_cache(maxsize=1)
def _models() -> Stages:
    return Stages()
