"""instances: which object is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The map contains only ids of the sample's objects."""
    instances = channel_of(sample, "instances")
    if instances is None or not instances.size:
        return
    known = np.array([0, *(o.id for o in sample.objects)])
    found = np.unique(instances)
    if not np.isin(found, known).all():
        yield f"expected ids {known.tolist()}, found {np.setdiff1d(found, known)[:5].tolist()} among them"


LABEL = ChannelLabel(
    name="instances",
    meaning="which object is seen; 0 is background",
    dtype=np.int32,
    unit="object id",
    encoding="png16",
    ids={"object": by_table},
    compute=lambda context: context.instances.ids,
    prove=_prove,
    drawing=Drawing("instances", pixels=lambda picture, sample: by_number(picture, sample.channels["instances"])),
)
