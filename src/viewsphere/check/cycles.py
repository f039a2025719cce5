"""Frames compared with Cycles' own pass of object indices: a renderer that knows nothing of viewsphere's rasteriser."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.check.scenery import Scenery
from viewsphere.formats.blend import StoredModels
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset


class Compared:
    """Compares samples with what Cycles sees; counts the pixels that differ, and those on edges, which may.

    Both look through the middles of pixels, Cycles in single precision: a pixel may differ whose neighbour, of the eight around
    it, is of the object that Cycles sees.
    """

    def __init__(self, dataset: Dataset) -> None:
        self._dataset, self._scenery = dataset, Scenery(dataset)
        self.frames, self.pixels, self.edges = 0, 0, 0
        self.left_out = 0

    def differences(self, sample: Sample) -> Iterator[str]:
        """What Cycles sees otherwise than the sample's instance map, beyond edges; UserError where there is no Blender."""
        shot = self._dataset.store.shot(self._scenery.key_of(sample.index))
        if shot is None or "instances" not in sample.files:
            self.left_out += 1
            return
        instant, sensor = self._scenery.taken(sample, shot)
        now = shot.model_copy(update={"things": shot.things_at(instant)})
        engine = plugins.load("engines", "cycles")
        seen = engine.indices(now, instant, sensor, StoredModels.of(self._dataset, now, sample))
        if seen is None:
            self.left_out += 1
            return
        kept = kept_map(sample)
        differ = seen != kept
        beyond = differ & ~near(kept, seen)
        self.frames, self.pixels = self.frames + 1, self.pixels + int(differ.sum())
        self.edges += int((differ & ~beyond).sum())
        if beyond.any():
            y, x = (int(i[0]) for i in np.nonzero(beyond))
            yield (
                f"{beyond.sum()} of {kept.size} pixels are not what Cycles sees, and on no edge: at pixel {(x, y)} Cycles sees "
                f"object {seen[y, x]}, found {kept[y, x]}"
            )

    def note(self) -> str:
        """What was compared, in a line."""
        left = f"; {self.left_out} left out, of which no shot is known or whose lens Blender has not" if self.left_out else ""
        return f"Cycles' object indices: {self.frames} frames, {self.pixels} pixels differ, {self.edges} of them on edges{left}"


def kept_map(sample: Sample) -> NDArray[np.int32]:
    """The ids that a sample's instance map has, (H, W) int32."""
    return sample.channels["instances"].astype(np.int32)


def near(kept: NDArray[np.int32], seen: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether a pixel of `kept` (H, W), or one of the eight around it, is what is seen there (H, W)."""
    padded = np.pad(kept, 1, mode="edge")
    height, width = kept.shape
    found = np.zeros(kept.shape, np.bool_)
    for dy in range(3):
        for dx in range(3):
            found |= padded[dy : dy + height, dx : dx + width] == seen
    return found
