"""occlusion_level: how much of an object others hide, in KITTI's grades."""

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

PARTLY, LARGELY = 0.05, 0.5
"""Hidden shares of an object's pixels in the image, above which it is partly, and largely occluded. KITTI's people judged by
eye, without numbers; https://github.com/bostondiditeam/kitti/blob/master/resources/devkit_object/readme.txt has the grades.
"""

UNKNOWN = 3


def restore(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The grade that visibility and truncation mean: of the pixels in the image, those outside of it are KITTI's truncation."""
    if o.truncation >= 1:
        return {"occlusion_level": UNKNOWN}
    hidden = 1 - o.visibility / (1 - o.truncation)
    return {"occlusion_level": int(hidden > PARTLY) + int(hidden > LARGELY)}


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """An object of which nothing is seen is largely occluded or unknown; one that nothing hides is fully visible."""
    for o in rendered(sample):
        grade, seen = o.occlusion_level, o.mask.any()
        if grade not in (0, 1, 2, 3) or (not seen and grade < 2) or (seen and grade == 3):
            yield f"object {o.id}: expected a grade of 0 to 3 that fits {o.area} visible pixels, found {grade}"


def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The grade at each object's box."""
    for o in sample.objects:
        note(pen, o, scale, f"{o.occlusion_level}", color_of(o.id))


LABEL = ObjectLabel(
    name="occlusion_level",
    meaning="how much others hide of it, in KITTI's grades",
    on_request=True,
    fields=(
        Field(
            "occlusion_level",
            f"of its pixels in the image are hidden: 0 at most {PARTLY:.0%}, 1 at most {LARGELY:.0%}, 2 more, or it has none; "
            "3 all are outside",
            int,
            ids={},
        ),
    ),
    restore=restore,
    prove=prove,
    drawing=Drawing("occlusion_level", lines=draw, key=(("occlusion_level: 1 partly, 2 largely occluded", None),)),
)
