"""referring: expressions that identify one object among all visible ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field as Limits

from viewsphere.labels.shared.captions.english import noun_of, noun_phrase
from viewsphere.labels.shared.captions.statements import (
    MIN_VISIBILITY,
    NEARER,
    RELATIONS,
    Company,
    Truths,
    Words,
    is_told,
    middle_of,
    phrases,
    place_of,
    words_of,
)
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import note
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import in_attributes
from viewsphere.labels.shared.needs import ShotAppearance, no_sides
from viewsphere.labels.shared.spec import Drawing, Models, SampleLabel
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

APART = 0.02
"""Minimum distance of the leftmost and the rightmost object from the next, as a share of the picture's width."""

EXTREMES = ("leftmost", "rightmost", "nearest", "farthest")


class _Referring(Frozen):
    """Options of the label."""

    min_visibility: Portion = Limits(
        default=MIN_VISIBILITY, description="visibility from which on an object is named, if at least 16 pixels are seen"
    )


@dataclass(frozen=True)
class Expression:
    """An expression that is true of only one object, and its parts: words (empty if not used), and the id of the object that a
    relation refers to (0 without one).
    """

    object: int
    text: str
    color: str = ""
    material: str = ""
    extreme: str = ""
    place: str = ""
    relation: str = ""
    landmark: int = 0


@dataclass(frozen=True, eq=False)
class Scene:
    """The visible objects of a picture of this size, and the words for their appearance by their ids."""

    objects: Sequence[ObjectAnnotation]
    words: Mapping[int, Words]
    size: tuple[int, int]

    @cached_property
    def relations(self) -> Mapping[str, Truths]:
        """For each relation a mask (N, N): True where the row's object has the relation to the column's."""
        return Company(self.objects).relations

    @cached_property
    def places(self) -> Sequence[str]:
        """The place of each object, in words."""
        return [place_of(o.box2d, *self.size) if o.box2d else "" for o in self.objects]

    @cached_property
    def sorts(self) -> Mapping[tuple[str, Words], Truths]:
        """For each noun with its words for appearance a mask (N,): True for the objects that its noun phrase fits."""
        found: dict[tuple[str, Words], Truths] = {}
        for i, o in enumerate(self.objects):
            for _, own in phrases(o, self.words[o.id]):
                found.setdefault((noun_of(o.category), own), np.zeros(len(self.objects), np.bool_))[i] = True
        return found

    def sort(self, i: int, own: Words) -> Truths:
        """A mask (N,) of the objects that fit the noun phrase of object i with these words."""
        return self.sorts[noun_of(self.objects[i].category), own]

    def kinds(self, i: int) -> Iterator[tuple[str, Words]]:
        """The noun phrases of object i."""
        return phrases(self.objects[i], self.words[self.objects[i].id])

    @cached_property
    def landmarks(self) -> Mapping[int, tuple[str, int]]:
        """For each object that a noun phrase alone identifies, by the object's number: the shortest such phrase, and its
        number of words for appearance.
        """
        found: dict[int, tuple[str, int]] = {}
        for i in range(len(self.objects)):
            alone = [(_used(own), phrase) for phrase, own in self.kinds(i) if self.sort(i, own).sum() == 1]
            if alone:
                used, phrase = min(alone, key=lambda one: one[0])
                found[i] = phrase, used
        return found

    def extreme(self, name: str, sort: Truths) -> int | None:
        """The number of the object of a sort that is the leftmost, ...; None if no object clearly is."""
        at = np.flatnonzero(sort)
        if name in ("leftmost", "rightmost"):
            sign = 1.0 if name == "leftmost" else -1.0
            values = sign * self._middles[at]
            first, second = np.argsort(values, kind="stable")[:2].tolist()
            is_clear = values[second] - values[first] >= APART * self.size[0]
        else:
            order = np.argsort(self._distances[at], kind="stable").tolist()
            first, second = order[:2] if name == "nearest" else order[-1:-3:-1]
            near, far = sorted((self._distances[at[first]], self._distances[at[second]]))
            is_clear = near <= NEARER * far
        return int(at[first]) if is_clear else None

    @cached_property
    def _middles(self) -> Any:
        return np.array([middle_of(o.box2d)[0] if o.box2d else np.nan for o in self.objects])

    @cached_property
    def _distances(self) -> Any:
        return np.array([o.view.distance for o in self.objects])

    def expression(self, i: int) -> Expression | None:
        """The shortest expression that is true only of object i.

        Full brevity of R. Dale and E. Reiter, https://arxiv.org/abs/cmp-lg/9504020, in the order of preference of their
        incremental algorithm among expressions of one length.
        """
        found = min(self._candidates(i), key=lambda one: one[0], default=None)
        return found and found[1]

    def _candidates(self, i: int) -> Iterator[tuple[tuple[int, int], Expression]]:
        """Expressions that are true only of object i, with their lengths and the ranks of their kinds."""
        o = self.objects[i]
        for phrase, own in self.kinds(i):
            sort, length, (color, material) = self.sort(i, own), _used(own), own
            plain = Expression(o.id, f"the {phrase}", color, material)
            if sort.sum() == 1:
                yield (length, 0), plain
                return  # the phrases that follow are no shorter
            for more, rank, one in self._located(i, sort, phrase, plain):
                yield (length + more, rank), one

    def _located(self, i: int, sort: Truths, phrase: str, plain: Expression) -> Iterator[tuple[int, int, Expression]]:
        """Expressions that identify object i among those of its sort by its location, with their number of additional words
        and the ranks of their kinds.
        """
        own = np.arange(len(self.objects)) == i
        place = self.places[i]
        if [j for j in np.flatnonzero(sort).tolist() if self.places[j] == place] == [i]:
            yield 1, 1, replace(plain, text=f"the {phrase} {place} of the picture", place=place)
        for name in EXTREMES:
            if self.extreme(name, sort) == i:
                yield 1, 2, replace(plain, text=f"the {name} {phrase}", extreme=name)
        for name in RELATIONS:
            for j, (landmark, used) in self.landmarks.items():
                related = self.relations[name][:, j] & sort
                if j != i and related[i] and (related == own).all():
                    text = f"the {phrase} that is {name} the {landmark}"
                    yield 1 + used, 3, replace(plain, text=text, relation=name, landmark=self.objects[j].id)


def _used(own: Words) -> int:
    return sum(map(bool, own))


def _compute(context: LabelContext, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The expressions, in the order of the objects' ids; none for a LiDAR's picture."""
    options, scenery = context.options_of("referring", _Referring), context.get(ShotAppearance())
    if scenery is None:
        raise ValueError("referring: expected a sample of a shot, found none")
    if scenery.sensor.lidar is not None:
        return {"referring": ()}
    visible = [o for o in objects if o.box2d is not None]
    scene = Scene(visible, words_of(context), (context.camera.width, context.camera.height))
    found = (scene.expression(i) for i, o in enumerate(visible) if is_told(o, options.min_visibility))
    return {"referring": tuple(one for one in found if one)}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Check that each visible object has at most one expression, with all parts in its text.

    If the label `looks` gives words for all objects, the expression must single out its object, and a missing expression is an
    error where one exists.
    """
    visible = [o for o in sample.objects if o.box2d is not None]
    ids = [one.object for one in sample.referring]
    if ids != sorted(set(ids) & {o.id for o in visible}):
        yield f"expected visible objects in the order of their ids, each once; found {ids}"
        return
    for one in sample.referring:
        text = _text(one, {o.id: o for o in visible})
        if text != one.text:
            yield f"object {one.object}: expected {text!r}, by the parts of the expression; found {one.text!r:.80}"
    if "looks" in sample.requested and not sample.camera.lens.is_scan:
        options = _Referring.model_validate(sample.options.get("referring", {}))
        words = {o.id: (o.color or "", o.material or "") for o in visible}
        scene = Scene(visible, words, (sample.width, sample.height))
        kept = {one.object: one for one in sample.referring}
        for i, o in enumerate(visible):
            again = scene.expression(i) if is_told(o, options.min_visibility) else None
            if again != (one := kept.get(o.id)):
                yield f"object {o.id}: expected {_said(again)}, found {_said(one)}"


def _said(one: Expression | None) -> str:
    return f"{one.text!r:.80}" if one else "no expression"


def _text(one: Expression, by_id: Mapping[int, ObjectAnnotation]) -> str | None:
    """The text made from an expression's parts. An expression with a landmark keeps its text, because the landmark's words are
    not stored.
    """
    phrase = noun_phrase(noun_of(by_id[one.object].category), one.color, one.material)
    if one.landmark:
        begins = f"the {phrase} that is {one.relation} the "
        other = by_id.get(one.landmark)
        is_right = other is not None and one.text.startswith(begins) and one.text.endswith(noun_of(other.category))
        return one.text if is_right else f"{begins}..."
    words = ("the", one.extreme, phrase, f"{one.place} of the picture" if one.place else "")
    return " ".join(filter(None, words))


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Each expression at its object."""
    by_id = {o.id: o for o in sample.objects}
    for one in sample.referring:
        note(pen, by_id[one.object], scale, one.text, color_of(one.object))


LABEL = SampleLabel(
    name="referring",
    refuses=no_sides,
    meaning="expressions that single objects out",
    needs=(ShotAppearance(),),
    options=_Referring,
    names_categories=True,
    fields=(
        Field(
            "referring",
            "object (id), text, and its parts color, material, extreme, place, relation and landmark (id): docs/captions.md",
            Expression,
            many=True,
            ids={"object": in_attributes("object", "landmark")},
        ),
    ),
    compute=_compute,
    prove=_prove,
    drawing=Drawing("referring", lines=_draw),
)
