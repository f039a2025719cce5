"""parts: which named part of its model is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have parts, the background has no part."""
    parts, instances = channel_of(sample, "parts"), channel_of(sample, "instances")
    if parts is not None and instances is not None and ((parts > 0) != (instances > 0)).any():
        yield f"expected a part where an object is seen, none elsewhere; found {((parts > 0) != (instances > 0)).sum()} others"


LABEL = ChannelLabel(
    name="parts",
    meaning="named part of the object's model, from 1; 0 is none",
    dtype=np.int32,
    unit="part id",
    encoding="png16",
    ids={"part": by_table},
    compute=lambda sight: sight.per_triangle(sight.geometry.triangle_part, 0),
    prove=prove,
    drawing=Drawing("parts", pixels=lambda picture, sample: by_number(picture, sample.channels["parts"])),
)
