"""Smoothing of the border between targets and background: Dwibedi et al., *Cut, Paste and Learn* (2017).

Networks learn to find the seam of a pasted object rather than the object; several kinds of seam on the same pictures prevent
that. All kinds work on the finished picture and on the ground-truth mask. So they act alike over photographs, skies, grounds
and shadows, and need no picture of the background alone. Beyond the border, each side is continued from its own pixels, except
the border pixels, which show both sides.

- `box`, `gaussian`: the mask, blurred by a box of `size` pixels to each side or a Gaussian of that sigma, becomes the object's
  opacity. Pixels beyond the blur's reach do not change.
- `poisson`: the object keeps its gradients and takes its border's colours from the background (Perez et al., *Poisson Image
  Editing*, 2003): a correction that is harmonic inside the mask is added to it. As in that paper, this is done on coded values
  (square roots of light, close to the sRGB curve). `size` has no effect here. At the picture's border the correction runs out
  level, so objects that leave the picture are safe. A transparent picture has nothing behind its objects and stays unchanged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Smoother
from viewsphere.rendering.harmonic import harmonic
from viewsphere.rendering.spread import box, gaussian, spread_both_ways

Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

WIDER = {"box": 2.0, "gaussian": 0.6}
"""Extra size of the blur that continues both sides, compared to the mask's blur, since it must reach beyond the border
pixels.
"""

SIDE = 1.0
"""Sigma, in pixels, of the Gaussian that continues both sides for `poisson`."""


def smooth_border(picture: Float32, targets: Mask, smoother: Smoother) -> Float32:
    """The picture with its targets' border smoothed, a new array of the same shape; `none` and empty masks change nothing.

    `picture` (H, W, 3) display-linear, or (H, W, 4) premultiplied; `targets` (H, W) bool.
    """
    impossible = smoother.kind == "poisson" and picture.shape[2] == 4
    if smoother.kind == "none" or impossible or not targets.any() or targets.all():
        return picture
    profile = box if smoother.kind == "box" else gaussian
    drawing = gaussian(SIDE) if smoother.kind == "poisson" else profile(smoother.size + WIDER[smoother.kind])
    window = _window(targets, len(drawing) + 1)
    out = picture.copy()
    part, mask = picture[window], targets[window]
    inside, outside = _drawn_on(part, mask, drawing), _drawn_on(part, ~mask, drawing)
    if smoother.kind == "poisson":
        out[window] = _poisson(part, mask, inside, outside)
    else:
        opacity = spread_both_ways(mask[..., None].astype(np.float32), profile(smoother.size))
        melted = outside + (inside - outside) * opacity
        out[window] = np.where((opacity > 0) & (opacity < 1), melted, part)
    return out


def _window(mask: Mask, margin: int) -> tuple[slice, slice]:
    """The part of the picture around a mask, with a margin."""
    spans: list[slice] = []
    for axis in (1, 0):
        found = np.flatnonzero(mask.any(axis=axis))
        spans.append(slice(max(int(found[0]) - margin, 0), int(found[-1]) + margin + 1))
    return spans[0], spans[1]


def _drawn_on(picture: Float32, mask: Mask, profile: Float32) -> Float32:
    """The picture continued from a mask's inner pixels: border pixels and those beyond become means of inner pixels nearby.

    If the mask has no inner pixels, as for a wire, all its pixels count. Beyond the blur's reach, the picture is unchanged.
    """
    core = mask & ~_touched(~mask)
    weight = np.where(core, np.float32(1), np.where(mask, np.float32(1e-4), np.float32(0)))[..., None]
    summed = spread_both_ways(np.concatenate([picture * weight, weight], axis=2), profile)
    total = summed[..., -1:]
    near = (total > 1e-9) & ~core[..., None]
    return np.where(near, summed[..., :-1] / np.where(near, total, np.float32(1)), picture)


def _touched(mask: Mask) -> Mask:
    """The mask and its eight neighbours' pixels."""
    tall = mask.copy()
    tall[1:] |= mask[:-1]
    tall[:-1] |= mask[1:]
    wide = tall.copy()
    wide[:, 1:] |= tall[:, :-1]
    wide[:, :-1] |= tall[:, 1:]
    return wide


def _poisson(picture: Float32, mask: Mask, inside: Float32, outside: Float32) -> Float32:
    """The object in its window of the picture, corrected so that its border meets the background; three channels."""
    rim = ~mask & _touched(mask)
    step = np.sqrt(np.maximum(outside, 0)) - np.sqrt(np.maximum(inside, 0))
    light = np.sqrt(np.maximum(inside, 0)) + harmonic(step, mask, rim)
    around = np.where(rim[..., None], outside, picture)
    return np.where(mask[..., None], np.square(np.clip(light, 0, 1)), around)
