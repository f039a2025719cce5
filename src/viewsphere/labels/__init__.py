"""Labels: everything computed about a picture from its exact geometry. A file defines `LABEL`, or several `LABELS`.

`ChannelLabel`s are arrays of pixels, computed if a recipe's `channels` name them. `ObjectLabel`s are fields of objects,
`SampleLabel`s of whole pictures; labels on request are computed if a recipe's `annotations` name them. Third parties
add a label by an entry point of the group `viewsphere.labels` that names such a module.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.homes import names_of
from viewsphere.labels.shared.catalogue import (
    channel_labels,
    channels,
    drawable,
    drawings,
    is_channel,
    is_in,
    is_on_request,
    is_shown,
    label_named,
    label_names,
    labels,
    labels_of,
    makers,
    object_labels,
    on_request,
    regular,
    sample_labels,
    sample_labels_of,
    stand_in_for,
)
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import IdKind, by_number, by_table, in_attributes, in_column, renumbered
from viewsphere.labels.shared.needs import (
    FollowedPoints,
    LidarScan,
    Need,
    Next,
    ObjectPoints,
    OwnView,
    Partner,
    Poses,
    Previous,
    Randomness,
    RigPoses,
    ShotAppearance,
    requires,
)
from viewsphere.labels.shared.placement import Placement, view_of
from viewsphere.labels.shared.record import Makers, finite, from_short_record, from_whole_record, short_record, whole_record
from viewsphere.labels.shared.spec import (
    TAIL,
    ChannelLabel,
    Color,
    Drawing,
    Extent,
    LabelSpec,
    ModelFacts,
    ObjectLabel,
    SampleLabel,
)

if TYPE_CHECKING:
    from viewsphere.labels.shared.computing import annotated, computed_channel, context_of, observe, sample_values
    from viewsphere.labels.shared.context import LabelContext

__all__ = [
    "TAIL",
    "ChannelLabel",
    "Color",
    "Drawing",
    "Extent",
    "Field",
    "FollowedPoints",
    "IdKind",
    "LabelContext",
    "LabelSpec",
    "LidarScan",
    "Makers",
    "ModelFacts",
    "Need",
    "Next",
    "ObjectLabel",
    "ObjectPoints",
    "OwnView",
    "Partner",
    "Placement",
    "Poses",
    "Previous",
    "Randomness",
    "RigPoses",
    "SampleLabel",
    "ShotAppearance",
    "annotated",
    "by_number",
    "by_table",
    "channel_labels",
    "channels",
    "computed_channel",
    "context_of",
    "drawable",
    "drawings",
    "finite",
    "from_short_record",
    "from_whole_record",
    "in_attributes",
    "in_column",
    "is_channel",
    "is_in",
    "is_on_request",
    "is_shown",
    "label_named",
    "label_names",
    "labels",
    "labels_of",
    "makers",
    "object_labels",
    "observe",
    "on_request",
    "regular",
    "renumbered",
    "requires",
    "sample_labels",
    "sample_labels_of",
    "sample_values",
    "short_record",
    "stand_in_for",
    "view_of",
    "whole_record",
]

_COMPUTING = "viewsphere.labels.shared.computing"
__getattr__ = names_of(
    __name__,
    {
        "LabelContext": "viewsphere.labels.shared.context",
        "annotated": _COMPUTING,
        "computed_channel": _COMPUTING,
        "observe": _COMPUTING,
        "sample_values": _COMPUTING,
        "context_of": _COMPUTING,
    },
)
