"""Frames compared with Cycles' own pass of object indices: a renderer independent of viewsphere's rasteriser."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.assets.animation.deforming import Load
from viewsphere.check.failure import failure
from viewsphere.formats.blend import StoredModels
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.plugins.engine import EngineSpec
from viewsphere.recipe.world.scene import engine_entry
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Dataset


class Compared:
    """Compares samples with Cycles' view; counts the pixels that differ, and separately those on edges, which may differ.

    Both sample the centres of pixels, Cycles in single precision. A pixel may differ if one of its eight neighbours shows the
    object that Cycles sees.
    """

    def __init__(self, dataset: Dataset) -> None:
        """Prepare the comparison. Raises UserError if a recipe's Blender, or the default one, cannot be used."""
        self._dataset, self._scenery = dataset, Scenery(dataset)
        self._engine = plugins.load(EngineSpec, "cycles")
        self.frames, self.pixels, self.edges = 0, 0, 0
        self._left_out: Counter[str] = Counter()
        for python in {_own_python(part.recipe) for part in dataset.plan.parts}:
            self._engine.check({"python": python} if python else {})

    def differences(self, sample: Sample) -> Iterator[str]:
        """Yield the differences of Cycles' view from the sample's instance map, beyond edges, or the file that cannot be read.

        Raises UserError if Blender does not answer.
        """
        try:
            asked = self._asked(sample)
        except Exception as error:
            yield failure("an instance map, models and a shot that can be read", error)
            return
        if asked is None:
            return
        kept, shot, instant, sensor, load = asked
        assert self._engine.indices is not None
        seen = self._engine.indices(shot, instant, sensor, load)
        if seen is None:
            self._left_out["whose lens Blender has not"] += 1
            return
        if seen.shape != kept.shape:
            yield f"expected an instance map of shape {seen.shape}, found {kept.shape}"
            return
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

    def _asked(self, sample: Sample) -> tuple[NDArray[np.int32], Shot, int, int, Load] | None:
        """The stored instance map, and the request for Cycles: shot, instant, sensor and models. None if these are unknown or
        have changed.
        """
        key = self._scenery.key_of(sample.index)
        shot = self._dataset.store.shot(key)
        if shot is None or "instances" not in sample.files:
            self._left_out["of which no shot or no instance map is known"] += 1
            return None
        instant, sensor = self._scenery.position(sample, shot)
        now, around = shot.model_copy(update={"things": shot.things_at(instant)}), self._scenery.around(key)
        changed = [thing.key for thing in now.things if not thing.id and self._scenery.mesh(around, thing) is None]
        if changed:
            self._left_out[f"whose scenery is not what it was ({changed[0]})"] += 1
            return None
        kept, load = kept_map(sample), StoredModels.for_sample(self._dataset, now, sample)
        for thing in now.objects:
            if thing.is_there:
                load(thing.model, thing.step)  # loaded here to distinguish damage from a Blender that does not answer
        return kept, now, instant, sensor, load

    def note(self) -> str:
        """Return a one-line summary of the comparison."""
        left = "".join(f"; {count} left out {why}" for why, count in self._left_out.items())
        return f"Cycles' object indices: {self.frames} frames, {self.pixels} pixels differ, {self.edges} of them on edges{left}"


def _own_python(recipe: Mapping[str, Any]) -> str | None:
    """The interpreter of the Blender that a recipe names for Cycles; None for the default one."""
    engine = engine_entry(recipe.get("engine", {}))
    return engine.get("python") if engine.get("name") == "cycles" else None


def kept_map(sample: Sample) -> NDArray[np.int32]:
    """The ids in a sample's instance map, (H, W) int32."""
    return sample.channels["instances"].astype(np.int32)


def near(kept: NDArray[np.int32], seen: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return a mask: True where a pixel of `kept` (H, W), or one of its eight neighbours, equals the pixel of `seen` (H, W)."""
    padded = np.pad(kept, 1, mode="edge")
    height, width = kept.shape
    mask = np.zeros(kept.shape, np.bool_)
    for dy in range(3):
        for dx in range(3):
            mask |= padded[dy : dy + height, dx : dx + width] == seen
    return mask
