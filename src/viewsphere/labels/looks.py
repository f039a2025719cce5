"""looks: words for an object's colour and material."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.labels.shared.captions.statements import words_of
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import note
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.needs import ShotAppearance
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.annotations.appearance import LONGEST
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """The words for most of the model's surface, with the shot's materials."""
    color, material = words_of(context)[i + 1]
    return {"color": color or None, "material": material or None}


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The fields, from a pair of words."""
    color, material = kept or (None, None)
    return {"color": color, "material": material}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Words are printable and short; a model of unknown appearance has none."""
    for o in rendered(sample):
        known = models.get(o.key)
        for word in filter(None, (o.color, o.material)):
            if not (word.isprintable() and len(word) <= LONGEST):
                yield f"object {o.id}: expected a word, found {word!r:.60}"
            if known is not None and known.looks is None:
                yield f"object {o.id}: expected no word for a model of which no looks are known, found {word!r:.60}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The words, written at every visible object."""
    for o in sample.objects:
        if o.box2d and (o.color or o.material):
            note(pen, o, scale, " ".join(filter(None, (o.color, o.material))), color_of(o.id))


LABEL = ObjectLabel(
    name="looks",
    meaning="words for what it looks like",
    on_request=True,
    needs=(ShotAppearance(),),
    fields=(
        Field(
            "color", "one of eleven basic colour terms, or the model's own word; None: none holds for most", str, optional=True
        ),
        Field("material", "glass, metal, glossy, matte, or the model's own word; None: none does", str, optional=True),
    ),
    compute=_compute,
    keep=lambda o: [o.color, o.material] if o.color or o.material else None,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("looks", lines=_draw),
)
