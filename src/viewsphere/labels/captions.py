"""captions: sentences about a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field as Limits

from viewsphere.labels.shared.captions.english import capital, listed, noun_of, number, plural, with_article
from viewsphere.labels.shared.captions.sentences import (
    NOTHING,
    AnyPlural,
    AnyTemplate,
    Caption,
    Filled,
    counted,
    fields_of,
    grouped,
    listing,
    related,
    wrong,
    wrong_count,
)
from viewsphere.labels.shared.captions.statements import (
    MIN_VISIBILITY,
    ONE,
    RELATIONS,
    Company,
    Words,
    has_front,
    is_told,
    of_one,
    phrases,
    side_of,
    size_of,
    words_of,
)
from viewsphere.labels.shared.drawing.lines import written
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import in_attributes
from viewsphere.labels.shared.needs import Randomness, Scenery, ShotAppearance, no_sides
from viewsphere.labels.shared.randomness import generator
from viewsphere.labels.shared.spec import Drawing, Models, Picture, SampleLabel
from viewsphere.model.annotations.classes import SKY, STUFF_IDS
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Natural, Portion
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

MOST = 100
"""Maximum number of sentences about one picture."""

CLEAR, CLOUDY = 0.2, 0.6
"""Cloud cover below which the sky is clear, and from which it is overcast."""

LOW_DEG = 20.0
"""The sun's elevation below which it is low."""

SEEN_STUFF = 0.05
"""Minimum share of the pixels for captions to mention stuff."""

FOGGY = 300.0
"""Metres of visibility below which rain and snow fall through fog."""

SURROUNDINGS = {
    "road": "a road",
    "pavement": "a pavement",
    "grass": "grass",
    "vegetation": "plants",
    "building": "buildings",
    "fence": "a fence",
}

Rng = np.random.Generator
Sentences = Iterator[Caption]


class _Captions(Frozen):
    """Options of the label."""

    count: Annotated[Count, Limits(le=MOST)] = Limits(default=5, description="sentences about each picture, at most")
    templates: tuple[AnyTemplate, ...] = Limits(
        default=(), max_length=1000, description="sentences to fill in, instead of those of viewsphere: {list}, {color}, ..."
    )
    plurals: dict[str, AnyPlural] = Limits(default={}, description="plurals of nouns that no rule gives")
    min_visibility: Portion = Limits(
        default=MIN_VISIBILITY, description="visibility from which on an object is told of, if at least 16 pixels are seen"
    )
    seed: Natural = Limits(default=0, description="what chance follows from; default: the recipe's seed")


@dataclass(frozen=True, eq=False)
class _Seen:
    """The facts that captions may state about a picture. These are the objects in the captions, the words for their appearance
    by their ids, and the objects that have a front. Also: the picture's size, the surroundings, and things that fall or hang
    in the air.
    """

    told: Sequence[ObjectAnnotation]
    words: Mapping[int, Words]
    fronts: frozenset[int]
    size: tuple[int, int]
    weather: str
    sun_is_low: bool
    surroundings: str
    plurals: Mapping[str, str]
    air: tuple[str, ...] = ()

    @cached_property
    def company(self) -> Company:
        """All objects, with the relations between them."""
        return Company(self.told)

    @cached_property
    def groups(self) -> Sequence[tuple[str, int]]:
        """Nouns and the number of objects for each, in the order of lists."""
        return grouped(self.told)

    @property
    def list(self) -> str:
        """The list of visible objects in words, with counts: three chairs and a car."""
        return listing(self.groups, self.plurals)


def _compute(context: LabelContext, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The sentences of a picture; none for a LiDAR's."""
    options, scenery, names = (
        context.options_of("captions", _Captions),
        context.get(ShotAppearance()),
        context.get(Randomness()),
    )
    if scenery is None or names is None:
        raise ValueError("captions: expected a sample of a shot, found none")
    if scenery.sensor.lidar is not None:
        return {"captions": ()}
    seen, rng = _seen(context, scenery, objects, options), generator(options.seed, "captions", *names)
    found = _by_templates(seen, options, rng) if options.templates else _sentences(seen, options.count, rng)
    return {"captions": tuple(found)}


def _seen(context: LabelContext, scenery: Scenery, objects: Sequence[ObjectAnnotation], options: _Captions) -> _Seen:
    told = [o for o in objects if is_told(o, options.min_visibility)]
    fronts = frozenset(o.id for o in told if has_front(context.placement(o.id - 1).facts))
    weather, sun_is_low = _weather(scenery)
    size = context.camera.width, context.camera.height
    return _Seen(
        told, words_of(context), fronts, size, weather, sun_is_low, _surroundings(context), options.plurals, _air(scenery)
    )


def _weather(scenery: Scenery) -> tuple[str, bool]:
    """Return the words for the sky, and whether the sun is low. The words are empty without daylight, or where the picture does
    not show the sky.
    """
    scene, behind = scenery.shot.scene, scenery.finish.background
    is_sky = behind.color is None and behind.image is None and not behind.transparent
    if scene.sky.kind != "daylight" or scene.blend is not None or not is_sky:
        return "", False
    clouds = scene.sky.clouds
    weather = "clear" if clouds < CLEAR else "partly cloudy" if clouds < CLOUDY else "overcast"
    return weather, clouds < CLOUDY and scene.sun is not None and scene.sun.elevation < LOW_DEG


def _air(scenery: Scenery) -> tuple[str, ...]:
    """Words for fog, rain and snow, without mist that only results from rain."""
    scene = scenery.shot.scene
    falls = [word for word, what in (("raining", scene.rain), ("snowing", scene.snow)) if what is not None]
    is_foggy = scene.fog is not None and (not falls or scene.fog.visibility < FOGGY)
    return ("foggy", *falls) if is_foggy else tuple(falls)


def _surroundings(context: LabelContext) -> str:
    """The list of visible stuff, in words."""
    classes = context.per_triangle(context.geometry.triangle_class, SKY)
    pixels = np.bincount(classes.ravel(), minlength=len(STUFF_IDS) + 1)
    return listed([words for name, words in SURROUNDINGS.items() if pixels[STUFF_IDS[name]] >= SEEN_STUFF * classes.size])


def _sentences(seen: _Seen, most: int, rng: Rng) -> list[Caption]:
    """A sentence of counts, and other sentences, whose forms alternate."""
    ids = tuple(o.id for o in seen.told)
    if not ids:
        return [Caption(NOTHING, "count")]
    found = [Caption(counted(seen.groups, seen.plurals)[int(rng.integers(3))], "count", ids)]
    waiting = [FORMS[i](seen, rng) for i in rng.permutation(len(FORMS)).tolist()]
    while waiting and len(found) < most:
        for form in tuple(waiting):
            one = next(form, None)
            if one is None:
                waiting.remove(form)
            elif len(found) < most and all(one.text != other.text for other in found):
                found.append(one)
    return found


def _of_one(form: str) -> Callable[[_Seen, Rng], Sentences]:
    """The function that makes a form's sentences about single objects."""

    def sentences(seen: _Seen, rng: Rng) -> Sentences:
        for i in rng.permutation(len(seen.told)).tolist():
            o = seen.told[i]
            if said := of_one(form, o, seen.size, o.id in seen.fronts):
                yield Caption(capital(f"{with_article(_phrase(seen, o, rng)[0])} {said}."), form, (o.id,))

    return sentences


def _phrase(seen: _Seen, o: ObjectAnnotation, rng: Rng) -> tuple[str, Words]:
    """A random noun phrase of an object, and its words for appearance."""
    known = list(phrases(o, seen.words[o.id]))
    return known[int(rng.integers(len(known)))]


def _relations(seen: _Seen, rng: Rng) -> Sentences:
    """For each pair of objects, in both orders, one of the relations that hold."""
    count = len(seen.told)
    for i, j in (divmod(pair, count) for pair in rng.permutation(count * count).tolist()):
        known = [name for name in RELATIONS if seen.company.relations[name][i, j]]
        if known:
            one, other = seen.told[i], seen.told[j]
            first, second = _phrase(seen, one, rng), _phrase(seen, other, rng)
            text = related((one, *first), known[int(rng.integers(len(known)))], (other, *second))
            yield Caption(text, "relation", (one.id, other.id))


def _of_sky(seen: _Seen, rng: Rng) -> Sentences:
    if seen.weather:
        yield Caption(f"The sky is {seen.weather}.", "weather")
    if seen.sun_is_low:
        yield Caption("The sun is low.", "weather")
    yield from (Caption(f"It is {word}.", "weather") for word in seen.air)


def _of_surroundings(seen: _Seen, rng: Rng) -> Sentences:
    if seen.surroundings:
        yield Caption(f"The picture also shows {seen.surroundings}.", "surroundings")


FORMS = (*map(_of_one, ONE), _relations, _of_sky, _of_surroundings)


def _by_templates(seen: _Seen, options: _Captions, rng: Rng) -> list[Caption]:
    """The user's sentences, filled in."""
    found, waiting = list[Caption](), {template: _filled(template, seen, rng) for template in options.templates}
    while waiting and len(found) < options.count:
        template = [*waiting][int(rng.integers(len(waiting)))]
        one = next(waiting[template], None)
        if one is None:
            del waiting[template]
        elif all(one.text != other.text for other in found):
            found.append(one)
    return found


def _filled(template: str, seen: _Seen, rng: Rng) -> Sentences:
    """A template, filled in for each object that has a word for all of its fields, in random order. A template without fields
    of objects is filled in once.
    """
    fields = fields_of(template)
    shared = Filled(fields, _of_picture(seen))
    if shared.is_whole:
        yield Caption(capital(shared.text(template)), "template")
        return
    for i in rng.permutation(len(seen.told)).tolist() if shared.may_be_whole else ():
        words, ids = _of_object(seen, i, rng, "relation" in fields)
        whole = Filled(fields, {**shared.words, **words})
        if whole.is_whole:
            yield Caption(capital(whole.text(template)), "template", ids)


def _of_picture(seen: _Seen) -> dict[str, str]:
    nouns = [noun if n == 1 else plural(noun, seen.plurals) for noun, n in seen.groups]
    return {
        "count": number(len(seen.told)),
        "list": seen.list,
        "categories": listed(nouns),
        "weather": seen.weather,
        "surroundings": seen.surroundings,
    }


def _of_object(seen: _Seen, i: int, rng: Rng, is_related: bool) -> tuple[dict[str, str], tuple[int, ...]]:
    """The words for an object's fields, and the ids of the objects that they describe."""
    o = seen.told[i]
    noun, (color, material) = noun_of(o.category), seen.words[o.id]
    *_, (whole, _) = phrases(o, (color, material))
    words = {
        "object": with_article(noun),
        "description": with_article(whole),
        "category": noun,
        "color": color,
        "material": material,
        "place": of_one("place", o, seen.size, True).removeprefix("is "),
        "size": size_of(o.area, *seen.size),
        "view": side_of(o) if o.id in seen.fronts else "",
    }
    if not is_related:
        return words, (o.id,)
    pairs = [(name, j) for name in RELATIONS for j in np.flatnonzero(seen.company.relations[name][i]).tolist()]
    if not pairs:
        return words, (o.id,)
    name, j = pairs[int(rng.integers(len(pairs)))]
    other = noun_of(seen.told[j].category)
    relation = f"{name} {f'another {other}' if other == noun else with_article(other)}"
    return {**words, "relation": relation}, (o.id, seen.told[j].id)


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Sentences differ and name visible objects; their statements agree with the sample's other labels. Colours and materials
    are checked if the sample has `looks`.
    """
    visible = {o.id: o for o in sample.objects if o.box2d is not None}
    options = _Captions.model_validate(sample.options.get("captions", {}))
    told = [o for o in visible.values() if is_told(o, options.min_visibility)]
    texts = [one.text for one in sample.captions]
    if len(set(texts)) < len(texts):
        yield "expected different sentences, found one twice"
    for one in sample.captions:
        objects = [visible[i] for i in one.objects if i in visible]
        if len(objects) < len(set(one.objects)) or len(set(one.objects)) < len(one.objects):
            yield f"{one.text!r:.80}: expected different objects that are visible, found {one.objects}"
        elif one.form == "count":
            yield from wrong_count(one, told, options.plurals)
        elif problem := wrong(sample, one, objects, [has_front(models.get(o.key)) for o in objects]):
            yield f"{one.text!r:.80}: expected {problem}"


def _beside(sample: Sample) -> Picture:
    """The sentences, one below another."""
    return written([one.text for one in sample.captions], sample.width, sample.height)


LABEL = SampleLabel(
    name="captions",
    refuses=no_sides,
    meaning="sentences about the picture",
    needs=(Randomness(), ShotAppearance()),
    options=_Captions,
    names_categories=True,
    fields=(
        Field(
            "captions",
            "text, form and ids of the objects that each is of: docs/captions.md has the grammar",
            Caption,
            many=True,
            ids={"object": in_attributes("objects")},
        ),
    ),
    compute=_compute,
    prove=_prove,
    drawing=Drawing("captions", beside=_beside),
)
