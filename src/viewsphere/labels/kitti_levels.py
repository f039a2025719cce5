"""occlusion_level and truncation_level: the hidden share of an object and the share outside the image, in KITTI's grades."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import note
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, Proof, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

PARTLY, LARGELY_HIDDEN = 0.05, 0.5
"""Hidden shares of an object's pixels in the image above which it is partly or largely occluded. KITTI's annotators judged by
eye, without numbers; https://github.com/bostondiditeam/kitti/blob/master/resources/devkit_object/readme.txt has the grades.
"""

TRUNCATED, LARGELY_OUTSIDE = 0.15, 0.5
"""Shares outside the image above which an object is truncated or largely truncated. They are the limits for the benchmark's
easy and hard objects, https://www.cvlibs.net/datasets/kitti/eval_object.php.
"""

UNKNOWN = 3
"""Grade of an object outside the image."""


def _occlusion(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The grade for visibility and truncation. It counts only pixels in the image; pixels outside count as KITTI's
    truncation.
    """
    if o.truncation >= 1:
        return {"occlusion_level": UNKNOWN}
    hidden = 1 - o.visibility / (1 - o.truncation)
    return {"occlusion_level": int(hidden > PARTLY) + int(hidden > LARGELY_HIDDEN)}


def _prove_occlusion(sample: Sample, models: Models) -> Iterator[str]:
    """An invisible object is largely occluded or unknown, and a visible one has a known grade."""
    for o in rendered(sample):
        grade, seen = o.occlusion_level, o.mask.any()
        if grade not in (0, 1, 2, 3) or (not seen and grade < 2) or (seen and grade == 3):
            yield f"object {o.id}: expected a grade of 0 to 3 that fits {o.area} visible pixels, found {grade}"


def _truncation(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The grade for the truncation."""
    return {"truncation_level": int(o.truncation > TRUNCATED) + int(o.truncation > LARGELY_OUTSIDE)}


def _prove_truncation(sample: Sample, models: Models) -> Iterator[str]:
    """An object with its projected box in the image is not truncated; with its box outside, it is largely truncated."""
    for o in rendered(sample):
        grade, inside = o.truncation_level, o.box2d_projected
        within = inside is not None and inside == o.box2d_unclipped
        if grade not in (0, 1, 2) or (within and grade) or (inside is None and not o.area and grade < 2):
            yield f"object {o.id}: expected a grade of 0 to 2 that fits its box {inside}, found {grade}"


def _label(
    name: str,
    meaning: str,
    grades: str,
    restore: Callable[[None, Placement, ObjectAnnotation], Mapping[str, Any]],
    prove: Proof,
    key: str,
) -> ObjectLabel:
    """A label with a grade, drawn at each object's box."""

    def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
        for o in sample.objects:
            note(pen, o, scale, f"{getattr(o, name)}", color_of(o.id))

    return ObjectLabel(
        name=name,
        meaning=meaning,
        on_request=True,
        fields=(Field(name, grades, int, ids={}),),
        restore=restore,
        prove=prove,
        drawing=Drawing(name, lines=draw, key=((f"{name}: {key}", None),)),
    )


LABELS = (
    _label(
        "occlusion_level",
        "how much others hide of it, in KITTI's grades",
        f"of its pixels in the image are hidden: 0 at most {PARTLY:.0%}, 1 at most {LARGELY_HIDDEN:.0%}, 2 more, or it has "
        "none; 3 all are outside",
        _occlusion,
        _prove_occlusion,
        "1 partly, 2 largely occluded",
    ),
    _label(
        "truncation_level",
        "how much of it lies outside of the image, in KITTI's grades",
        f"outside are: 0 at most {TRUNCATED:.0%}, 1 at most {LARGELY_OUTSIDE:.0%}, 2 more",
        _truncation,
        _prove_truncation,
        "0 inside, 1 truncated, 2 largely so",
    ),
)
