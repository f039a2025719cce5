"""English words that sentences are made of: articles, numbers, plurals, lists."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")

PLURALS = {
    **{"child": "children", "man": "men", "woman": "women", "person": "people", "ox": "oxen", "mouse": "mice"},
    **{"foot": "feet", "goose": "geese", "tooth": "teeth"},
    **{"calf": "calves", "half": "halves", "knife": "knives", "leaf": "leaves", "life": "lives", "loaf": "loaves"},
    **{"scarf": "scarves", "shelf": "shelves", "thief": "thieves", "wife": "wives", "wolf": "wolves"},
    **{"echo": "echoes", "hero": "heroes", "potato": "potatoes", "tomato": "tomatoes"},
    **{name: name for name in ("aircraft", "deer", "fish", "scissors", "sheep", "series", "species")},
}
"""Irregular plurals."""

VOWEL = re.compile(r"(?!eu|one|ufo|uni|use|usu|uti)[aeiou]|heir|honest|honou?r|hour", re.IGNORECASE)
"""The beginnings of words that take the article "an"."""


def noun_of(category: str) -> str:
    """Return the noun for an object of a category."""
    return " ".join(category.replace("_", " ").split()) or "object"


def number(count: int) -> str:
    """A number in words up to twelve, in digits from 13 on."""
    return NUMBERS[count] if count < len(NUMBERS) else str(count)


def plural(noun: str, own: Mapping[str, str]) -> str:
    """The plural of a noun: the user's `own` plural, else the plural of its last word."""
    if noun in own:
        return own[noun]
    before, space, last = noun.rpartition(" ")
    return before + space + _plural(last)


def _plural(word: str) -> str:
    if word.lower() in PLURALS:
        known = PLURALS[word.lower()]
        return known.capitalize() if word[:1].isupper() else known
    if re.search(r"[^aeiou\W\d_]y$", word, re.IGNORECASE):
        return word[:-1] + "ies"
    return word + ("es" if word.endswith(("s", "x", "z", "ch", "sh")) else "s")


def with_article(words: str) -> str:
    """Words with `a` or `an` before them."""
    return f"{'an' if VOWEL.match(words) else 'a'} {words}"


def listed(words: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def capital(sentence: str) -> str:
    """The sentence, beginning with a capital letter."""
    return sentence[:1].upper() + sentence[1:]


FINISHES = ("glossy", "matte")
"""Words for materials that precede a colour."""


def noun_phrase(noun: str, color: str = "", material: str = "") -> str:
    """A noun with adjectives: glossy red car, red metal chair."""
    words = (material, color) if material in FINISHES else (color, material)
    return " ".join([*filter(None, words), noun])
