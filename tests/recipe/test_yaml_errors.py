"""Errors of YAML syntax are lines in our own words."""

import pytest

from viewsphere.errors import RecipeError
from viewsphere.recipe.reading.file import parse

PARSER_S = ("while scanning", "while parsing", "<block", "token", "scalar", "alias", "anchor", "alphabetic", "simple key")
"""Words of the YAML reader that mean nothing to a user."""

ERRORS = {
    "models:\n  - source: *.obj\n": '2: `*.obj` needs quotes: "*.obj"',
    "models: [{source: **/*.obj, category: x}]\n": '1: `**/*.obj` needs quotes: "**/*.obj"',
    "a: *photos\n": '1: `*photos` needs quotes: "*photos"',
    "a: @x # why\n": '1: `@x` needs quotes: "@x"',
    "a: %x\n": '1: `%x` needs quotes: "%x"',
    "a: &x.y\n": '1: `&x.y` needs quotes: "&x.y"',
    "a: |x\n b\n": '1: `|x` needs quotes: "|x"',
    "a: b: c\n": "1: a colon does not fit here: check indentation and colons above, or quote the text; found 'a: b: c'",
    "a: 1\n  b: 2\n": "2: a colon does not fit here: ",
    "a:\n  - b\n c: 2\n": "3: the indentation fits no line above: align the names of one mapping; found 'c: 2'",
    "- a\nb: 1\n": "2: the indentation fits no line above: do not mix list items and names in one column; found 'b: 1'",
    "a: 1\nb\nc: 2\n": "2: a name has no colon behind it: write `name: value`; found 'b'",
    'a: "C:\\Users\\me"\n': "1: a backslash in double quotes begins an escape; use single quotes, or / in paths",
    'a: "C:\\models"\n': "1: a backslash in double quotes begins an escape; use single quotes, or / in paths",
    "a: - b\n": "1: a list item begins behind a name: begin it on its own line",
    "a: [1, 2]]\n": "1: a ] closes no list: remove it",
    "a: {b: 1}}\n": "1: a } closes no mapping: remove it",
    "a: 'it's'\n": "1: text goes on behind a closed quote: quote all of it, and double the quotes within single ones",
    "a: 1\n---\nb: 2\n": "2: a second document begins with ---: remove the line, a recipe is one document",
    "%a\n": "2: a line begins with %: put the text in quotes",
}


@pytest.mark.parametrize("text", ERRORS)
def test_an_error_of_syntax_is_a_line_in_our_words(text):
    with pytest.raises(RecipeError) as caught:
        parse(text, "r.yaml")
    assert str(caught.value).startswith(f"r.yaml:{ERRORS[text]}")
    assert "\n" not in str(caught.value) and not any(word in str(caught.value) for word in PARSER_S)
