"""truncation_level: how much of an object lies outside of the image, in the grades of KITTI's tracking benchmark."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import note
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TRUNCATED, LARGELY = 0.15, 0.5
"""Shares outside of the image above which an object is truncated, and largely so: the most that the benchmark's easy and hard
objects may have, https://www.cvlibs.net/datasets/kitti/eval_object.php.
"""


def restore(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The grade that the truncation means."""
    return {"truncation_level": int(o.truncation > TRUNCATED) + int(o.truncation > LARGELY)}


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """An object whose projected box lies in the image is not truncated; one whose box lies outside is largely so."""
    for o in rendered(sample):
        grade, inside = o.truncation_level, o.box2d_projected
        within = inside is not None and inside == o.box2d_unclipped
        if grade not in (0, 1, 2) or (within and grade) or (inside is None and not o.area and grade < 2):
            yield f"object {o.id}: expected a grade of 0 to 2 that fits its box {inside}, found {grade}"


def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The grade at each object's box."""
    for o in sample.objects:
        note(pen, o, scale, f"{o.truncation_level}", color_of(o.id))


LABEL = ObjectLabel(
    name="truncation_level",
    meaning="how much of it lies outside of the image, in KITTI's grades",
    on_request=True,
    fields=(
        Field("truncation_level", f"outside are: 0 at most {TRUNCATED:.0%}, 1 at most {LARGELY:.0%}, 2 more", int, ids={}),
    ),
    restore=restore,
    prove=prove,
    drawing=Drawing("truncation_level", lines=draw, key=(("truncation_level: 0 inside, 1 truncated, 2 largely so", None),)),
)
