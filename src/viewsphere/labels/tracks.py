"""tracks: where the points that a sensor follows through a sequence are, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels._label import ChannelLabel, Models, Needs, channel_of
from viewsphere.labels._sight import Sight
from viewsphere.model.sample import Sample
from viewsphere.model.tracks import TRACK
from viewsphere.truth.points import SKY

WORST = 4
"""The last of the states."""


def compute(sight: Sight) -> NDArray[np.void]:
    """One row a point, (N,) of `viewsphere.model.tracks.TRACK`. Raises ValueError where the sample's shot follows none."""
    own = sight.neighbour()
    if own is None or sight.around is None:
        raise ValueError("tracks: expected a sample of a sequence, found none")
    followed = sight.around.followed
    now = followed.points.in_view(own)
    out = np.empty(len(followed.query), TRACK)
    out["instant"], out["query"], out["object"] = followed.query[:, 0], followed.query[:, 1:], followed.object
    out["point"][:, :3], out["point"][:, 3] = now.world, 1.0
    sky = followed.points.thing == SKY
    out["point"][sky, :3], out["point"][sky, 3] = followed.points.place[sky], 0.0
    out["state"] = now.state
    out["point"][np.isnan(out["point"][:, 0])] = np.nan
    return out


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """States are known ones, points lie on known objects, and are somewhere unless they are invalid."""
    rows = channel_of(sample, "tracks")
    if rows is None:
        return
    known = {0, *(o.id for o in sample.objects)}
    strange = (rows["state"] > WORST).sum()
    if strange:
        yield f"expected states of 0 to {WORST}; found others of {strange} points"
    lost = np.isnan(rows["point"]).any(axis=1) & (rows["state"] != WORST)
    if lost.any():
        yield f"expected a place of every point that is not invalid; found none of {lost.sum()}"
    absent = ~np.isin(rows["object"], list(known)) & (rows["state"] != WORST)
    if absent.any():
        yield f"expected points on objects of the sample; found {absent.sum()} on others that are not invalid"


LABEL = ChannelLabel(
    name="tracks",
    meaning="points followed through the sequence, a row each: where each was picked, where it is now, whether it is seen",
    axes="world, image",
    needs=Needs(tracks=True),
    dtype=TRACK,
    components=0,
    unit="m, px",
    empty=np.nan,
    encoding="npz",
    compute=compute,
    prove=prove,
)
