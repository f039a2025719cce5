"""Formats that a data set can be exported to: one module a format, with a `viewsphere.plugins.format.FormatSpec`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viewsphere.model.sample import Sample
    from viewsphere.model.sensors.rig import Rig
    from viewsphere.store import Category


@dataclass(frozen=True)
class Scope:
    """The known facts about a data set before any of it is rendered. `rig` is the rig of its first part, None if it is
    unknown, as for imported pictures; `later_rigs` are the different rigs of its other parts. `is_moving`: its pictures are of
    sequences. `most_objects` is the largest number of objects in a picture. `channels` and `annotations` are the labels and
    passes that it keeps, and the labels that can be computed from its shots. `pictures` are a few pictures of each part, one
    for each different set of known facts. They are given where a part does not keep its shots, as imported parts do not.
    """

    categories: tuple[Category, ...]
    splits: tuple[str, ...]
    rig: Rig | None
    is_moving: bool
    most_objects: int
    channels: tuple[str, ...]
    annotations: tuple[str, ...]
    pictures: tuple[Sample, ...] = ()
    later_rigs: tuple[Rig, ...] = ()
