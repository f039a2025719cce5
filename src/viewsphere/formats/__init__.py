"""Formats that a data set can be exported to: one module a format, with a `viewsphere.plugins.format.FormatSpec`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viewsphere.model.rig import Rig
    from viewsphere.model.sample import Sample
    from viewsphere.store import Category


@dataclass(frozen=True)
class Scope:
    """What is known of a data set before any of it is rendered. `rig`: that of its first part, None where nobody knows it, as
    of imported pictures; `is_moving`: its pictures are of sequences; `most_objects`: of one picture; `channels` and
    `annotations`: labels and passes that it keeps, and those that can be computed of its shots; `pictures`: a few of each part,
    of those of which different things are known, where the shots of any part are not kept, as those of imported ones.
    """

    categories: tuple[Category, ...]
    splits: tuple[str, ...]
    rig: Rig | None
    is_moving: bool
    most_objects: int
    channels: tuple[str, ...]
    annotations: tuple[str, ...]
    pictures: tuple[Sample, ...] = ()
