"""What a page's screenshots show."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from deadline import until


def pixels(place) -> np.ndarray:
    """A screenshot of a locator's place, (H, W, 3)."""
    return np.asarray(Image.open(io.BytesIO(place.screenshot())).convert("RGB")).astype(int)


def changed(before, after) -> float:
    """The share of the pixels that differ; all of them where the sizes do."""
    return float((np.abs(before - after).max(axis=-1) > 12).mean()) if before.shape == after.shape else 1.0


def looks(place, true) -> bool:
    """Return whether a place comes to look so that `true(pixels)`."""
    return until(lambda: true(pixels(place)))


def differs(place, before, share) -> bool:
    """Return whether more than this share of a place's pixels comes to differ."""
    return looks(place, lambda after: changed(before, after) > share)


def equals(place, before, share) -> bool:
    """Return whether less than this share of a place's pixels comes to differ."""
    return looks(place, lambda after: changed(before, after) < share)
