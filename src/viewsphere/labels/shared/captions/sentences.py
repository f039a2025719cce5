"""Sentences about pictures: their stored parts, the user's templates, and the proof of a sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from string import Formatter
from typing import Annotated

from pydantic import AfterValidator, Field

from viewsphere.labels.shared.captions.english import capital, listed, noun_of, number, plural, with_article
from viewsphere.labels.shared.captions.statements import RELATIONS, Company, Words, of_one, phrases
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.validation.errors import one_of, shown

LONGEST = 1000
"""Maximum number of characters in a template."""

OF_PICTURE = ("count", "list", "categories", "weather", "surroundings")
OF_OBJECT = ("object", "description", "category", "color", "material", "place", "size", "view", "relation")
"""Fields of templates."""

NOTHING = "No object can be seen."
SKY = ("The sky is clear.", "The sky is partly cloudy.", "The sky is overcast.", "The sun is low.")


@dataclass(frozen=True)
class Caption:
    """A sentence, its form, and the ids of the objects in it."""

    text: str
    form: str
    objects: tuple[int, ...] = ()


def fields_of(template: str) -> frozenset[str]:
    """The fields of a template."""
    return frozenset(name for _, name, _, _ in Formatter().parse(template) if name is not None)


def _template(text: str) -> str:
    try:
        parts = [part for part in Formatter().parse(text) if part[1] is not None]
    except ValueError:
        raise ValueError(f"expected fields in pairs of braces; found {shown(text)}: a brace itself is {{{{ or }}}}") from None
    for _, name, form, conversion in parts:
        if name not in (*OF_PICTURE, *OF_OBJECT):
            raise ValueError(f"field {{{name}}}: {one_of(name, (*OF_PICTURE, *OF_OBJECT))}")
        if form or conversion:
            raise ValueError(f"expected fields without a format, such as {{{name}}}; found {shown(text)}")
    if not text.strip() or not text.isprintable():
        raise ValueError(f"expected a line of printable text; found {shown(text)}")
    return text


AnyTemplate = Annotated[str, Field(max_length=LONGEST), AfterValidator(_template)]


def _plural(text: str) -> str:
    if not text.strip() or not text.isprintable():
        raise ValueError(f"expected printable text; found {shown(text)}")
    return text


AnyPlural = Annotated[str, Field(max_length=LONGEST), AfterValidator(_plural)]


@dataclass(frozen=True)
class Filled:
    """Fields of a template with their words; a word is empty if there is none."""

    fields: frozenset[str]
    words: Mapping[str, str]

    @property
    def is_whole(self) -> bool:
        """Return whether all fields have words."""
        return all(self.words.get(name) for name in self.fields)

    @property
    def may_be_whole(self) -> bool:
        """Return whether all fields except those of objects have words."""
        return all(self.words.get(name) for name in self.fields.intersection(OF_PICTURE))

    def text(self, template: str) -> str:
        """The template with its words."""
        return template.format_map(self.words)


def wrong(sample: Sample, caption: Caption, objects: Sequence[ObjectAnnotation], fronts: Sequence[bool]) -> str | None:
    """Return the caption that a sample's other labels require if the given caption differs from it, else None. `objects` are
    the objects of the caption; `fronts` gives for each whether it has a front.
    """
    text = caption.text
    match caption.form:
        case "relation" if len(objects) == 2:
            return _wrong_relation(sample, text, *objects)
        case "weather" | "surroundings" if not objects:
            is_known = text in SKY if caption.form == "weather" else text.startswith("The picture also shows ")
            return None if is_known else f"a sentence of {caption.form}"
        case "template":
            return None
        case form if len(objects) == 1:
            (o,) = objects
            said = of_one(form, o, (sample.width, sample.height), fronts[0])
            if not said:
                return f"nothing of the form {form} of object {o.id}"
            texts = [capital(f"{with_article(phrase)} {said}.") for phrase, _ in _phrases(sample, o)]
            is_right = text in texts if texts else text.endswith(f"{noun_of(o.category)} {said}.")
            return None if is_right else f"an object of its category that {said}, and has its colour and material"
        case _:
            return f"a known form with as many objects as it has, found {caption.form!r} of {len(objects)}"


def _phrases(sample: Sample, o: ObjectAnnotation) -> list[tuple[str, Words]]:
    """Return every noun phrase of an object; none if its appearance is unknown."""
    if "looks" not in sample.requested:
        return []
    return list(phrases(o, (o.color or "", o.material or "")))


def grouped(told: Iterable[ObjectAnnotation]) -> list[tuple[str, int]]:
    """Nouns with their counts, most frequent first, then alphabetically: merging data sets changes category numbers."""
    counts = Counter(noun_of(o.category) for o in told)
    return sorted(counts.items(), key=lambda entry: (-entry[1], entry[0]))


def listing(groups: Iterable[tuple[str, int]], plurals: Mapping[str, str]) -> str:
    """Nouns with their counts in words: three chairs and a car."""
    return listed([with_article(noun) if n == 1 else f"{number(n)} {plural(noun, plurals)}" for noun, n in groups])


def counted(groups: Sequence[tuple[str, int]], plurals: Mapping[str, str]) -> tuple[str, ...]:
    """The sentences of counts."""
    if not groups:
        return (NOTHING,)
    told, verb = listing(groups, plurals), "is" if groups[0][1] == 1 else "are"
    return f"There {verb} {told}.", f"The picture shows {told}.", capital(f"{told} can be seen.")


def wrong_count(caption: Caption, told: Sequence[ObjectAnnotation], plurals: Mapping[str, str]) -> Iterator[str]:
    """Yield the errors in a sentence of counts that covers these objects."""
    texts, ids = counted(grouped(told), plurals), tuple(o.id for o in told)
    if caption.text not in texts or caption.objects != ids:
        yield f"{caption.text!r:.80}: expected {texts[0]!r:.200} or the like, of objects {ids}; found objects {caption.objects}"


def _wrong_relation(sample: Sample, text: str, one: ObjectAnnotation, other: ObjectAnnotation) -> str | None:
    relations = Company((one, other)).relations
    for name in (name for name in RELATIONS if relations[name][0, 1]):
        texts = set(_related(sample, one, name, other))
        is_of_both = f"{noun_of(one.category)} is {name} a" in text and text.endswith(f"{noun_of(other.category)}.")
        if text in texts or (not texts and is_of_both):
            return None
    return f"a relation of object {one.id} to object {other.id} that holds, of phrases for these"


def _related(sample: Sample, one: ObjectAnnotation, relation: str, other: ObjectAnnotation) -> Iterator[str]:
    """Yield every sentence of a relation."""
    for first in _phrases(sample, one):
        for second in _phrases(sample, other):
            yield related((one, *first), relation, (other, *second))


Phrase = tuple[ObjectAnnotation, str, Words]
"""An object with one of its noun phrases, and its words for looks."""


def related(first: Phrase, relation: str, second: Phrase) -> str:
    """The sentence that states an object's relation to another object. If both have the same phrase, the second gets
    `another`.
    """
    (one, phrase, own), (other, landmark, its) = first, second
    is_alike = noun_of(one.category) == noun_of(other.category) and set(its) <= {*own, ""}
    return capital(f"{with_article(phrase)} is {relation} {f'another {landmark}' if is_alike else with_article(landmark)}.")
