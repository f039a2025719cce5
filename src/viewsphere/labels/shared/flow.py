"""The shared parts of labels of motion in the picture: flow and scene flow to another instant, and their contradictions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Array, Models, Proof, channel_of
from viewsphere.model.sample import Sample
from viewsphere.truth.correspondences.correspondence import pixel_centers
from viewsphere.truth.surface_points.raster import BEHIND, INVALID, OUTSIDE

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight

EDGE = 1e-3
"""Pixels from the picture's border within which the rounding of stored flow decides whether it leads outside."""


def flow(sight: Sight, instants: int) -> NDArray[np.float32]:
    """Return the motion (H, W, 2), in pixels, of each seen point from now to so many instants later. NaN where the point has no
    pixel then.
    """
    match = sight.match(instants)
    return np.full((*sight.visibility.triangle.shape, 2), np.nan, np.float32) if match is None else match.flow


def scene_flow(sight: Sight, instants: int) -> NDArray[np.float32]:
    """By how much the seen point moves, each in its own instant's camera axes, (H, W, 3) metres; NaN of the sky."""
    match = sight.match(instants)
    return np.full((*sight.visibility.triangle.shape, 3), np.nan, np.float32) if match is None else match.scene_flow


def flow_proof(name: str, state: str) -> Proof:
    """The proof that flow is there wherever its point has a pixel, and leads outside where the state says so."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        vectors, states = channel_of(sample, name), channel_of(sample, state)
        if vectors is None:
            return
        if (np.isnan(vectors[..., 0]) != np.isnan(vectors[..., 1])).any():
            yield "expected both components or none; found one of them"
        elif states is not None:
            yield from _against(vectors, states, state)

    return prove


def _against(vectors: Array, states: Array, state: str) -> Iterator[str]:
    has_pixel = np.isfinite(vectors[..., 0])
    wrong = has_pixel != (states < BEHIND)
    if wrong.any():
        yield f"expected vectors where {state} is 0, 1 or 2, NaN elsewhere; found others at {wrong.sum()} pixels"
    height, width = states.shape
    there = pixel_centers(states.shape) + vectors
    inside = np.minimum(there, (width, height) - there).min(axis=-1)  # how far inside of the picture
    wrong = has_pixel & (np.abs(inside) > EDGE) & ((inside < 0) != (states == OUTSIDE))
    if wrong.any():
        yield f"expected {state} 2 where the vectors lead outside; found others at {wrong.sum()} pixels"


def scene_flow_proof(name: str, state: str) -> Proof:
    """The proof that points that are seen, and not gone, have scene flow, and nothing else has."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        vectors, states, depth = (channel_of(sample, n) for n in (name, state, "depth"))
        if vectors is None:
            return
        has = np.isfinite(vectors).all(axis=-1)
        if (has != np.isfinite(vectors).any(axis=-1)).any():
            yield "expected all components or none; found some of them"
        if states is not None and (has & (states == INVALID)).any():
            yield f"expected NaN where {state} is 4; found vectors at {(has & (states == INVALID)).sum()} pixels"
        if states is not None and depth is not None:
            missing = (np.isfinite(depth) & (states != INVALID)) & ~has
            if missing.any():
                yield f"expected vectors where something is seen and {state} is not 4; found NaN at {missing.sum()} pixels"

    return prove
