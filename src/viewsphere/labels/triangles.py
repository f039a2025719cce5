"""triangles: the index of the seen triangle in its object's model."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext) -> NDArray[np.int32]:
    """Index (H, W) of the triangle within its object; -1 on scenery, on ground, and where nothing is seen."""
    g = context.geometry
    index = np.full(len(g.triangles), -1, np.int32)
    for first, last in pairwise(g.triangle_start[: g.object_count + 1]):
        index[first:last] = np.arange(last - first)
    return context.per_triangle(index, -1)


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have triangles; the background has none."""
    triangles, instances = channel_of(sample, "triangles"), channel_of(sample, "instances")
    if triangles is not None and instances is not None and ((triangles >= 0) != (instances > 0)).any():
        wrong = ((triangles >= 0) != (instances > 0)).sum()
        yield f"expected a triangle where an object is seen, -1 elsewhere; found {wrong} others"


LABEL = ChannelLabel(
    name="triangles",
    meaning="index in the object's exported model; -1 where no object",
    dtype=np.int32,
    unit="triangle",
    empty=-1,
    ids={"part": by_table},
    compute=_compute,
    prove=_prove,
    drawing=Drawing("triangles", pixels=lambda picture, sample: by_number(picture, sample.channels["triangles"] + 1)),
)
