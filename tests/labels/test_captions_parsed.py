"""captions and referring, read back by a second program, which was written from docs/captions.md and from other labels alone.

Every sentence is parsed into claims, which have to hold of the boxes, masks, poses and facts of models; each expression that
refers to an object has to be the first, in the page's order, of all that hold of this object and of no other.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest
import trimesh
from trimesh.visual.material import PBRMaterial

import viewsphere as vs
from built_once import built_once
from proven import equal, told

COLORS = ("black", "gray", "white", "red", "orange", "yellow", "green", "blue", "purple", "pink", "brown")
MATERIALS = ("glass", "metal", "glossy", "matte")
NUMBERS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
TALLIES = {**{word: i for i, word in enumerate(NUMBERS)}, **{str(i): i for i in range(13, 100)}}
IRREGULAR = """
child children, man men, woman women, person people, foot feet, goose geese, tooth teeth, mouse mice, ox oxen, calf calves,
half halves, knife knives, leaf leaves, life lives, loaf loaves, scarf scarves, shelf shelves, thief thieves, wife wives,
wolf wolves, echo echoes, hero heroes, potato potatoes, tomato tomatoes, aircraft aircraft, deer deer, fish fish,
scissors scissors, sheep sheep, series series, species species
"""
PLURALS = dict(pair.split() for pair in IRREGULAR.split(","))
PLACES = (
    ("at the top left", "at the top", "at the top right"),
    ("on the left", "in the middle", "on the right"),
    ("at the bottom left", "at the bottom", "at the bottom right"),
)
SIDES = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")
RELATIONS = ("to the left of", "to the right of", "in front of", "behind", "above", "below", "next to")
EXTREMES = ("leftmost", "rightmost", "nearest", "farthest")
STUFF = {4: "a road", 6: "a pavement", 7: "grass", 8: "plants", 9: "buildings", 10: "a fence"}


# words


def noun_of(category):
    return category.replace("_", " ") or "object"


def plural_of(noun, own=None):
    if own and noun in own:
        return own[noun]
    rest, space, last = noun.rpartition(" ")
    if last.lower() in PLURALS:
        many = PLURALS[last.lower()]
    elif re.search("[^aeiouAEIOU]y$", last):
        many = last[:-1] + "ies"
    else:
        many = last + ("es" if re.search("(s|x|z|ch|sh)$", last) else "s")
    return rest + space + many


def article_of(text):
    if re.match("(?i:eu|one|ufo|uni|use|usu|uti)", text):
        return "a"
    return "an" if re.match("(?i:[aeiou]|heir|honest|honor|honour|hour)", text) else "a"


def joined(parts):
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def capital(text):
    return text[:1].upper() + text[1:]


# what is the case, from other labels than these


@dataclass
class Thing:
    """What labels say of an object, and whether it has symmetries."""

    o: object
    is_symmetric: bool

    @cached_property
    def noun(self):
        return noun_of(self.o.category)

    @cached_property
    def words(self):
        return (self.o.color or "", self.o.material or "")

    @cached_property
    def middle(self):
        x0, y0, x1, y1 = self.o.box2d
        return (x0 + x1) / 2, (y0 + y1) / 2

    @cached_property
    def low(self):
        return self.o.box3d.min(axis=0)

    @cached_property
    def high(self):
        return self.o.box3d.max(axis=0)

    def fits(self, color, material):
        """Return whether words for colour and material, empty without, hold of it."""
        return color in ("", self.words[0]) and material in ("", self.words[1])


class World:
    """All that sentences of a picture may claim."""

    def __init__(self, dataset, sample, least=0.1):
        symmetric = {
            info.key: bool(info.symmetries and (info.symmetries.discrete or info.symmetries.continuous))
            for info in dataset.models
        }
        self.sample, self.dataset = sample, dataset
        self.width, self.height = sample.width, sample.height
        self.seen = [Thing(o, symmetric[o.key]) for o in sample.objects if o.area > 0]
        self.told = [t for t in self.seen if t.o.area >= 16 and t.o.visibility >= least]
        self.by_id = {t.o.id: t for t in self.told}

    def place(self, t):
        (x, y), w, h = t.middle, self.width, self.height
        return PLACES[(y >= h / 3) + (y > 2 * h / 3)][(x >= w / 3) + (x > 2 * w / 3)]

    def size(self, t):
        share = t.o.area / (self.width * self.height)
        return "large" if share >= 0.2 else "small" if share <= 0.01 else ""

    def is_hidden(self, t):
        return t.o.truncation < 1 and 1 - t.o.visibility / (1 - t.o.truncation) >= 0.3

    def is_cut(self, t):
        return t.o.truncation >= 0.1

    def side(self, t):
        view = t.o.view
        if t.is_symmetric:
            return ""
        if abs(view.elevation_deg) >= 60:
            return "above" if view.elevation_deg > 0 else "below"
        way = SIDES[math.floor((view.azimuth_deg + 22.5) / 45) % 8]
        return f"its {way}" + (
            " and from above" * (view.elevation_deg >= 30) or " and from below" * (view.elevation_deg <= -30)
        )

    def holds(self, one, words, two):
        """Return whether a relation of one thing to another holds."""
        (ax0, ay0, ax1, ay1), (bx0, by0, bx1, by1) = one.o.box2d, two.o.box2d
        match words:
            case "to the left of":
                return ax1 <= bx0
            case "to the right of":
                return ax0 >= bx1
            case "in front of":
                overlap = min(ax1, bx1) > max(ax0, bx0) and min(ay1, by1) > max(ay0, by0)
                return overlap and one.o.view.distance <= 0.9 * two.o.view.distance
            case "behind":
                return self.holds(two, "in front of", one)
            case "above":
                level = one.low[2] >= two.high[2] - 0.05 * (two.high[2] - two.low[2])
                return level and bool((np.minimum(one.high, two.high) > np.maximum(one.low, two.low))[:2].all())
            case "below":
                return self.holds(two, "above", one)
            case "next to":
                apart = np.linalg.norm(one.o.box3d.mean(axis=0) - two.o.box3d.mean(axis=0))
                reach = sum(np.linalg.norm(t.o.size) / 2 for t in (one, two))
                others = ("above", "below", "in front of", "behind")
                return apart <= 1.25 * reach and not any(self.holds(one, other, two) for other in others)
        raise AssertionError(words)

    def tally(self):
        """The nouns of all that are told of with their numbers, in the order of lists."""
        counted = Counter(t.noun for t in self.told)
        return sorted(counted.items(), key=lambda item: (-item[1], item[0]))

    def weather(self):
        """The sentences that hold of sky and sun."""
        shot, taken = self.dataset.labelled(self.sample.origin.key), self.sample.origin
        scene, finish = shot.scene, shot.instants[taken.instant].finish or shot.scene.finish
        ground = finish.background
        if scene.sky is None or scene.sky.kind != "daylight" or ground.color or ground.image or ground.transparent:
            return "", []
        clouds = scene.sky.clouds
        word = "clear" if clouds < 0.2 else "partly cloudy" if clouds < 0.6 else "overcast"
        low = scene.sun is not None and scene.sun.elevation < 20 and word != "overcast"
        return word, [f"The sky is {word}.", *["The sun is low."] * low]

    def surroundings(self):
        ids, counts = np.unique(self.sample.semantic, return_counts=True)
        shares = dict(zip(ids.tolist(), (counts / counts.sum()).tolist(), strict=True))
        return [words for id_, words in STUFF.items() if shares.get(id_, 0) >= 0.05]


# reading sentences


def groups(pattern, text):
    """The groups of a pattern that has to be the whole of a text."""
    found = re.fullmatch(pattern, text)
    assert found, f"{text!r} is not {pattern}"
    return found.groups()


@dataclass(frozen=True)
class Phrase:
    """An article, words for colour and material, and a noun."""

    article: str
    color: str
    material: str
    noun: str

    @property
    def words(self):
        return {self.color, self.material} - {""}


class Reader:
    """Reads sentences about a data set, whose nouns and words it knows; `own` are plurals that its recipe says."""

    def __init__(self, dataset, own=None):
        objects = [o for sample in dataset for o in sample.objects]
        self.nouns = {noun_of(o.category) for o in objects}
        self.plurals = {plural_of(noun, own): noun for noun in self.nouns}
        colors = {*COLORS, *(o.color for o in objects if o.color)}
        materials = {*MATERIALS, *(o.material for o in objects if o.material)} - {"glossy", "matte"}
        nouns, colors, materials = ("|".join(sorted(map(re.escape, words))) for words in (self.nouns, colors, materials))
        self.phrase = rf"(?:(?P<finish>glossy|matte) )?(?:(?P<color>{colors}) )?(?:(?P<made>{materials}) )?(?P<noun>{nouns})"

    def one(self, text):
        """What a whole noun phrase with its article means."""
        found = re.fullmatch(rf"(?P<article>[Aa]n?|[Aa]nother|[Tt]he) {self.phrase}", text)
        assert found and not (found["finish"] and found["made"]), text
        return Phrase(found["article"].lower(), found["color"] or "", found["finish"] or found["made"] or "", found["noun"])

    def two(self, text, words):
        """Both phrases around the words of a relation, which no noun has."""
        before, after = text.split(f" {words} ")
        return self.one(before), self.one(after)

    def tally(self, text):
        """Nouns with their numbers, of a list."""
        parts = re.split(", | and ", text)
        assert joined(parts) == text
        return [self._entry(part) for part in parts]

    def _entry(self, part):
        number, _, noun = part.partition(" ")
        if number in ("a", "an"):
            assert number == article_of(noun)
            return noun, 1
        assert noun in self.plurals and TALLIES.get(number, 0) > 1, part
        return self.plurals[noun], TALLIES[number]


def check_phrase(phrase, thing, first=None):
    """A noun phrase with its article, of the thing that it tells of; `first` is the phrase before."""
    assert phrase.noun == thing.noun and thing.fits(phrase.color, phrase.material), (phrase, thing.noun, thing.words)
    is_another = first is not None and first.noun == phrase.noun and phrase.words <= first.words
    text = written(phrase)
    assert phrase.article == ("another" if is_another else article_of(text)), (phrase, first)


def written(phrase):
    """The noun phrase without its article."""
    finish = phrase.material if phrase.material in ("glossy", "matte") else ""
    made = "" if finish else phrase.material
    return " ".join(word for word in (finish, phrase.color, made, phrase.noun) if word)


def check_caption(world, reader, caption):
    """Every claim of a sentence holds, and its data are what it says."""
    text, things = caption.text, [world.by_id[i] for i in caption.objects]
    assert text.endswith(".") and text == capital(text), text
    said = text[:-1]
    match caption.form:
        case "count":
            assert sorted(world.by_id) == list(caption.objects)
            if not world.told:
                assert said == "No object can be seen"
                return
            verb, there, shown, first = groups("There (is|are) (.*)|The picture shows (.*)|(.*) can be seen", said)
            tally = reader.tally(there or shown or first[0].lower() + first[1:])
            assert tally == world.tally()
            assert verb in (None, "is" if tally[0][1] == 1 else "are")
        case "place":
            head, place = groups("(.*?) is ((?:at|on|in) the .*) of the picture", said)
            check_phrase(reader.one(head), *things)
            assert place == world.place(*things)
        case "size":
            head, size = groups("(.*) fills a (large|small) part of the picture", said)
            check_phrase(reader.one(head), *things)
            assert size == world.size(*things)
        case "hidden":
            check_phrase(reader.one(*groups("(.*) is partly hidden", said)), *things)
            assert world.is_hidden(*things)
        case "cut":
            check_phrase(reader.one(*groups("(.*) is partly outside the picture", said)), *things)
            assert world.is_cut(*things)
        case "view":
            head, side = groups("(.*?) is seen from (.*)", said)
            check_phrase(reader.one(head), *things)
            assert side == world.side(*things) != ""
        case "relation":
            (words,) = groups(f".*? is ({'|'.join(RELATIONS)}) .*", said)
            one, two = reader.two(said, f"is {words}")
            check_phrase(one, things[0])
            check_phrase(two, things[1], one)
            assert world.holds(things[0], words, things[1]) and things[0] is not things[1]
        case "weather":
            assert text in world.weather()[1] and not things
        case "surroundings":
            assert said == f"The picture also shows {joined(world.surroundings())}" and not things
        case form:
            raise AssertionError(form)


def forms_of(world):
    """The forms, but for the first, that have something to say of a picture."""
    told = world.told
    said = {
        "place": told,
        "size": [t for t in told if world.size(t)],
        "hidden": [t for t in told if world.is_hidden(t)],
        "cut": [t for t in told if world.is_cut(t)],
        "view": [t for t in told if world.side(t)],
        "relation": [1 for a, b in itertools.permutations(told, 2) if any(world.holds(a, words, b) for words in RELATIONS)],
        "weather": world.weather()[1],
        "surroundings": world.surroundings(),
    }
    return {form for form, found in said.items() if found}


def check_captions(world, reader, count):
    """All sentences of a picture: true, none twice, and of every form that has something to say before any comes again."""
    captions = world.sample.captions
    assert len({caption.text for caption in captions}) == len(captions) <= count
    for caption in captions:
        check_caption(world, reader, caption)
    assert captions[0].form == "count"
    forms = forms_of(world) if world.told else set()
    others = [caption.form for caption in captions[1:]]
    assert set(others) <= forms
    first = others[: len(forms)]
    assert len(set(first)) == len(first) == min(len(forms), count - 1), (others, forms)
    return len(captions)


# referring expressions


def options(thing):
    """Words for colour and material of a noun phrase, in the order of preference: none, colour, material, both."""
    color, material = thing.words
    yield "", ""
    if color:
        yield color, ""
    if material:
        yield "", material
    if color and material:
        yield color, material


def named(world, thing, words):
    """The things seen of which a noun phrase holds."""
    return [t for t in world.seen if t.noun == thing.noun and t.fits(*words)]


def cost(words):
    return sum(map(bool, words))


def own_phrase(world, thing):
    """The words of the first noun phrase that singles a thing out; None if there is none."""
    fitting = [words for words in options(thing) if named(world, thing, words) == [thing]]
    return min(fitting, key=cost, default=None)


def is_extreme(world, thing, others, extreme):
    margin, own = 0.02 * world.width, thing.o.view.distance
    for other in others:
        away, far = thing.middle[0] - other.middle[0], other.o.view.distance
        holds = {
            "leftmost": -away >= margin,
            "rightmost": away >= margin,
            "nearest": own <= 0.9 * far,
            "farthest": far <= 0.9 * own,
        }
        if not holds[extreme]:
            return False
    return True


def expressions(world, thing):
    """All expressions that hold of a thing and of nothing else that is seen: their places in the order, and texts."""
    landmarks = [(t, words) for t in world.seen if t is not thing and (words := own_phrase(world, t)) is not None]
    for rank, words in enumerate(options(thing)):
        holding = named(world, thing, words)
        others = [t for t in holding if t is not thing]
        head, price = written(Phrase("", *words, thing.noun)), cost(words)
        if not others:
            yield (price, 0, rank, 0, 0), f"the {head}"
        if not any(world.place(t) == world.place(thing) for t in others):
            yield (price + 1, 1, rank, 0, 0), f"the {head} {world.place(thing)} of the picture"
        for i, extreme in enumerate(EXTREMES):
            if others and is_extreme(world, thing, others, extreme):
                yield (price + 1, 2, rank, i, 0), f"the {extreme} {head}"
        for i, relation in enumerate(RELATIONS):
            for mark, own in landmarks:
                also = [t for t in others if t is not mark and world.holds(t, relation, mark)]
                if world.holds(thing, relation, mark) and not also:
                    order = (price + 1 + cost(own), 3, rank, i, mark.o.id)
                    yield order, f"the {head} that is {relation} the {written(Phrase('', *own, mark.noun))}"


def extension(world, reader, text):
    """The things seen of which an expression holds, from its text alone; and its parts."""
    parts = {"color": "", "material": "", "extreme": "", "place": "", "relation": "", "landmark": 0}
    rest, marks = text.removeprefix("the "), []
    assert rest != text
    found = re.fullmatch(f"(.*) that is ({'|'.join(RELATIONS)}) (the .*)", rest)
    if found:
        rest, parts["relation"], told = found.groups()
        mark = reader.one(told)
        marks = [t for t in world.seen if t.noun == mark.noun and t.fits(mark.color, mark.material)]
        assert len(marks) == 1, text
        parts["landmark"] = marks[0].o.id
    elif found := re.fullmatch(r"(.*?) ((?:at|on|in) the .*) of the picture", rest):
        rest, parts["place"] = found.groups()
    elif found := re.fullmatch(f"({'|'.join(EXTREMES)}) (.*)", rest):
        parts["extreme"], rest = found.groups()
    phrase = reader.one(f"the {rest}")
    parts["color"], parts["material"] = phrase.color, phrase.material
    things = [t for t in world.seen if t.noun == phrase.noun and t.fits(phrase.color, phrase.material)]
    if parts["extreme"]:
        assert len(things) > 1, text
        things = [t for t in things if is_extreme(world, t, [other for other in things if other is not t], parts["extreme"])]
    if parts["place"]:
        things = [t for t in things if world.place(t) == parts["place"]]
    if marks:
        things = [t for t in things if t is not marks[0] and world.holds(t, parts["relation"], marks[0])]
    return things, parts


def check_referring(world, reader):
    """Each expression holds of its object alone and is the first of all that do; and whoever has one is there."""
    said = {one.object: one for one in world.sample.referring}
    assert len(said) == len(world.sample.referring) and list(said) == sorted(said)
    for one in said.values():
        things, parts = extension(world, reader, one.text)
        assert [t.o.id for t in things] == [one.object], one.text
        assert {name: getattr(one, name) for name in parts} == parts, one.text
    expected = {t.o.id: min(expressions(world, t))[1] for t in world.told if any(True for _ in expressions(world, t))}
    assert {i: one.text for i, one in said.items()} == expected
    return len(said)


# data sets

PAINTS = {
    "red": (0.6, 0.01, 0.01),
    "green": (0.02, 0.3, 0.03),
    "blue": (0.02, 0.05, 0.6),
    "yellow": (0.8, 0.6, 0.02),
    "black": (0.004, 0.004, 0.004),
    "white": (0.9, 0.9, 0.9),
    "gray": (0.2, 0.2, 0.2),
}
FINISHES = {"glossy": (0.0, 0.1), "matte": (0.0, 0.95), "metal": (1.0, 0.4), "": (0.0, 0.5)}
"""Metallic and roughness of each word."""

SHAPES = {
    "knife": lambda: trimesh.creation.box((0.3, 0.9, 0.5)),
    "orange": lambda: trimesh.creation.icosphere(1, 0.3),
    "traffic light": lambda: trimesh.creation.cylinder(0.2, 1.2, sections=7),
    "umbrella": lambda: trimesh.creation.cone(0.6, 0.5, sections=9),
    "unicorn": lambda: trimesh.util.concatenate(
        [trimesh.creation.box((0.9, 0.4, 0.3)), trimesh.creation.box((0.2, 0.2, 0.5)).apply_translation((0.35, 0.05, 0.4))]
    ),
    "bus": lambda: trimesh.creation.box((0.8, 1.7, 0.8)),
}
PAINTED = [
    ("knife", "red", "metal"),
    ("knife", "black", "metal"),
    ("orange", "yellow", ""),
    ("orange", "green", "matte"),
    ("traffic light", "green", "glossy"),
    ("traffic light", "gray", "matte"),
    ("umbrella", "blue", "matte"),
    ("umbrella", "red", "matte"),
    ("unicorn", "white", "matte"),
    ("unicorn", "white", "glossy"),
    ("bus", "yellow", "glossy"),
    ("bus", "yellow", ""),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Files of models in the colours and materials that their names say; the last one is said to be navy and wooden."""
    folder = tmp_path_factory.mktemp("painted")
    for noun, color, finish in PAINTED:
        metallic, rough = FINISHES[finish]
        mesh = SHAPES[noun]()
        paint = PBRMaterial(baseColorFactor=[*PAINTS[color], 1.0], metallicFactor=metallic, roughnessFactor=rough)
        mesh.visual = trimesh.visual.TextureVisuals(material=paint)
        mesh.export(folder / f"{noun.replace(' ', '_')}-{color}-{finish or 'plain'}.glb")
    return folder


def entries(folder, **more):
    """Each noun's models; umbrellas have symmetries, one bus is navy and wooden."""
    said = {"umbrella": {"symmetries": "found"}, "bus": {}}
    found = [
        {
            "source": str(folder / f"{noun.replace(' ', '_')}-*.glb"),
            "category": noun.replace(" ", "_"),
            "up": "+z",
            **said.get(noun, {}),
        }
        for noun in SHAPES
        if noun != "bus"
    ]
    buses = {"category": "bus", "up": "+z"}
    return [
        *({**one, "forward": "-y", **more} for one in found),
        {"source": str(folder / "bus-yellow-glossy.glb"), **buses, "forward": "-y", **more},
        {
            "source": str(folder / "bus-yellow-plain.glb"),
            **buses,
            "forward": "-y",
            "color": "navy",
            "material": "wooden",
            **more,
        },
    ]


def made(out, models, captions, **changes):
    recipe = {
        "models": models,
        "viewpoints": {"kind": "sphere", "count": 2, "distance": [3, 7], "elevation": [3, 85], "tilt": [-10, 10]},
        "camera": {"size": [96, 72], "fov_deg": 45},
        "scene": {"sky": {"daylight": {"clouds": [0, 1]}}, "sun": {"elevation": [5, 60]}},
        "channels": ["instances", "semantic"],
        "annotations": ["captions", "referring", "looks"],
        "labels": {"captions": captions, "referring": {k: v for k, v in captions.items() if k == "min_visibility"}},
        "splits": {"by": "frame", "train": 1},
        "formats": [],
    }
    vs.generate(vs.Recipe.model_validate({**recipe, **changes}), out, workers=0)
    return vs.open(out)


def read(dataset, count, least=0.1, own=None):
    """How many sentences of a data set were read and hold, and how often each form and part is among them."""
    reader, forms, sentences = Reader(dataset, own), Counter(), 0
    for sample in dataset:
        world = World(dataset, sample, least)
        sentences += check_captions(world, reader, count) + check_referring(world, reader)
        forms.update(caption.form for caption in sample.captions)
        for one in sample.referring:
            forms.update(name for name in ("color", "material", "extreme", "place", "relation") if getattr(one, name))
    return sentences, forms


SCENES = {"objects": [1, 6], "repeat": True, "layout": "scatter", "gap": 0.05}


@pytest.fixture(scope="module")
def few(folder, tmp_path_factory):
    return made(tmp_path_factory.mktemp("few"), entries(folder), {"count": 8}, scenes={"count": 9, **SCENES})


@pytest.mark.slow
def test_sentences_hold_of_their_pictures(few):
    sentences, forms = read(few, 8)
    told("captions", "a second program that reads them", 0)
    told("referring", "a second program that reads them", 0)
    assert sentences > 180
    assert {"count", "place", "size", "cut", "view", "relation", "weather", "color", "extreme"} <= set(forms)


@pytest.mark.slow
def test_words_are_those_of_the_paint(few):
    """Of each model, as it was painted; but of the one whose entry says others."""
    said = {o.key: (o.color or "", o.material or "") for sample in few for o in sample.objects}
    assert len(said) == len(PAINTED)
    for noun, color, finish in PAINTED:
        words = ("navy", "wooden") if (noun, finish) == ("bus", "") else (color, finish)
        equal("looks", "paint", said[f"{noun.replace(' ', '_')}-{color}-{finish or 'plain'}"], words)


SWAPS = [
    ("left", "right"),
    ("top", "bottom"),
    ("middle", "left"),
    ("in front of", "behind"),
    ("large", "small"),
    ("front", "back"),
    ("clear", "overcast"),
    ("red", "green"),
    ("glossy", "matte"),
    ("nearest", "farthest"),
    ("two", "three"),
    (" a ", " an "),
    ("umbrella", "unicorn"),
]


@pytest.mark.slow
def test_the_reader_notices_what_does_not_hold(few):
    """Sentences in which a word was changed for another are refused, each of them."""
    reader, noticed = Reader(few), Counter()
    for sample in few:
        world = World(few, sample)
        for caption, swap in itertools.product(sample.captions, [*SWAPS, *(pair[::-1] for pair in SWAPS)]):
            changed = re.sub(rf"(?<!\w){swap[0].strip()}(?!\w)", swap[1].strip(), caption.text)
            if changed != caption.text:
                with pytest.raises(AssertionError):
                    check_caption(world, reader, replace(caption, text=changed))
                noticed[swap] += 1
        for one, other in itertools.permutations(sample.referring, 2):
            things, _ = extension(world, reader, one.text)
            assert [t.o.id for t in things] != [other.object]
    assert len(noticed) > 15 and sum(noticed.values()) > 100


@pytest.mark.slow
def test_a_thousand_sentences_hold_of_their_pictures(folder, tmp_path):
    """Of random scenes of all models, and of scenes of few models, in which looks alone single out nothing."""
    dataset = made(tmp_path / "all", entries(folder), {"count": 12}, scenes={"count": 40, **SCENES}, seed=5)
    sentences, forms = read(dataset, 12)
    alike = [one for one in entries(folder) if one["category"] in {"bus", "umbrella"}][:2]
    crowds = made(tmp_path / "alike", alike, {"count": 12}, scenes={"count": 40, **SCENES, "objects": [4, 8]}, seed=6)
    more, _ = read(crowds, 12)
    assert sentences > 1000 and more > 1000
    assert {"hidden", "material"} <= set(forms)
    wanted = {one.relation or one.extreme or one.place for sample in crowds for one in sample.referring}
    assert {"in front of", "behind", "next to", *EXTREMES} <= wanted


@pytest.mark.slow
def test_what_is_above_and_below(folder, tmp_path):
    """Umbrellas rise to the one side of a bus that drives below them; cameras see it from all around."""
    rising = {"kind": "constant", "velocity": [0, 0, 1.5]}
    driving = {"kind": "constant", "velocity": [1.2, 0, 0]}
    models = [
        {**one, "motion": driving if one["category"] == "bus" else rising}
        for one in entries(folder)
        if one["category"] in {"bus", "umbrella"}
    ]
    dataset = made(
        tmp_path,
        models,
        {"count": 30},
        scenes={"count": 6, "objects": 3, "layout": [[0, 0, 0], [-1.3, 0, 0], [1.3, 0, 0]], "gap": 0},
        viewpoints={"azimuth": [0, 80, 200], "elevation": [10, 70], "distance": 6},
        time={"frames": 3, "fps": 1},
        splits={"by": "sequence", "train": 1},
    )
    read(dataset, 30)
    said = [caption.text for sample in dataset for caption in sample.captions]
    assert any(" is above " in text for text in said) and any(" is below " in text for text in said)


@pytest.mark.slow
def test_a_street_is_told_of(folder, tmp_path):
    """With what stands around as objects with categories of their own, and as scenery."""
    forms = Counter()
    with built_once():
        for labels in ("own", "background"):
            dataset = made(
                tmp_path / labels,
                entries(folder),
                {"count": 20},
                scenes={"count": 1, "objects": 4},
                scene={"place": {"source": "zoo:neighbourhood", "labels": labels}, "sky": {"daylight": {}}},
            )
            forms += read(dataset, 20)[1]
    assert forms["surroundings"] and forms["hidden"] and forms["count"] == 4


@pytest.mark.slow
def test_many_few_and_none(folder, tmp_path):
    """More than twelve of a kind, plurals of the recipe's own, and pictures in which too little of anything is seen."""
    models = [one for one in entries(folder, scale={"length": 0.2}) if one["category"] in {"knife", "orange"}]
    own = {"knife": "cutlery"}
    dataset = made(
        tmp_path,
        models,
        {"count": 6, "plurals": own, "min_visibility": 0.6},
        scenes={"count": 1, "objects": 32, "repeat": True, "layout": "scatter", "gap": 0.02},
        viewpoints={"azimuth": [0], "elevation": [12, 70], "distance": [2.5, 40]},
        camera={"size": [160, 120], "fov_deg": 50},
    )
    read(dataset, 6, 0.6, own)
    told = [sample.captions[0].text for sample in dataset]
    assert any(re.search("1[3-9] ", text) for text in told) and "No object can be seen." in told
    assert any("cutlery" in text for text in told)


TEMPLATES = ["{count} things: {list}|{categories}", "{object} is a {color} {material} {category}, {size}|{place}|{view}"]
TEMPLATES += ["{description} {relation}", "under a {weather} sky {{so}}"]


@pytest.mark.slow
def test_own_sentences_hold(folder, tmp_path):
    dataset = made(tmp_path, entries(folder), {"count": 6, "templates": TEMPLATES}, scenes={"count": 6, **SCENES})
    reader, seen = Reader(dataset), Counter()
    for sample in dataset:
        world = World(dataset, sample)
        assert len({caption.text for caption in sample.captions}) == len(sample.captions) <= 6
        for caption in sample.captions:
            assert caption.form == "template" and caption.text == capital(caption.text)
            seen[check_own(world, reader, caption)] += 1
    assert set(seen) == {0, 1, 2, 3}


def check_own(world, reader, caption):
    """Which of the templates it is of; every field holds."""
    text, things = caption.text, [world.by_id[i] for i in caption.objects]
    if found := re.fullmatch("(.*) things: (.*)\\|(.*)", text):
        assert found[1].lower() == (NUMBERS[len(world.told)] if len(world.told) < 13 else str(len(world.told)))
        assert reader.tally(found[2]) == world.tally()
        assert found[3] == joined([noun if n == 1 else plural_of(noun) for noun, n in world.tally()]) and not things
        return 0
    if found := re.fullmatch("(.*) is a (.*), (.*)\\|(.*) of the picture\\|(.*)", text):
        (thing,) = things
        check_phrase(reader.one(found[1]), thing)
        assert found[1] == capital(f"{article_of(thing.noun)} {thing.noun}")
        assert found[2] == " ".join((*thing.words, thing.noun)) and all(thing.words)
        assert found.groups()[2:] == (world.size(thing), world.place(thing), world.side(thing)) and all(found.groups())
        return 1
    if text == f"Under a {world.weather()[0]} sky {{so}}":
        assert not things and world.weather()[0]
        return 3
    head, words, other = groups(f"(.*?) ({'|'.join(RELATIONS)}) (.*)", text)
    check_phrase(reader.one(head), things[0])
    assert {*reader.one(head).words} == {*things[0].words} - {""}
    check_phrase(reader.one(other), things[1], reader.one(head))
    assert world.holds(things[0], words, things[1]) and not reader.one(other).words
    return 2
