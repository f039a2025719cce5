"""Errors of YAML syntax in the user's words: line, problem, fix."""

from __future__ import annotations

import re

import yaml
from yaml.tokens import FlowMappingEndToken, FlowMappingStartToken, FlowSequenceEndToken, FlowSequenceStartToken

from viewsphere.validation.errors import shown

UNCLOSED = ("while scanning a quoted scalar", "while parsing a flow sequence", "while parsing a flow mapping")
"""The YAML reader's contexts of an unclosed quote or bracket with a known place."""

OPENING: dict[str, str] = {"'": "quoted text", '"': "quoted text", "[": "list", "{": "mapping"}
"""The kind of value that each opening sign begins."""

ENDS = ("end of stream", "<stream end>")
"""The YAML reader's words for the end of a file."""

NEEDS_QUOTES = re.compile(r"[*&!%@`|>][^,#\]}]*")
"""A value that begins with a character that is special in YAML, such as `*.obj`."""

EXPLAINED = {
    "undefined alias": None,
    "cannot start any token": None,
    "alphabetic or numeric character": None,
    "chomping or indentation": None,
    "escape sequence": "a backslash in double quotes begins an escape; use single quotes, or / in paths",
    "unknown escape": "a backslash in double quotes begins an escape; use single quotes, or / in paths",
    "mapping values are not allowed": "a colon does not fit here: check indentation and colons above, or quote the text",
    "sequence entries are not allowed": "a list item begins behind a name: begin it on its own line",
    "could not find expected ':'": "a name has no colon behind it: write `name: value`",
    "another document": "a second document begins with ---: remove the line, a recipe is one document",
    "<document start>": "a line begins with %: put the text in quotes",
    "found ']'": "a ] closes no list: remove it",
    "found '}'": "a } closes no mapping: remove it",
    "'<scalar>'": "text goes on behind a closed quote: quote all of it, and double the quotes within single ones",
    "'<block mapping start>'": "the indentation fits no line above: align the names of one mapping",
    "expected <block end>": "the indentation fits no line above: do not mix list items and names in one column",
}
"""Parts of the YAML reader's messages, and what they mean to the user; None: the value needs quotes."""


def syntax_error(text: str, error: yaml.MarkedYAMLError, loader: type[yaml.SafeLoader]) -> str:
    """The line, the problem and the fix of a YAML syntax error, as `12: '*.obj' needs quotes: "*.obj"`."""
    lines, problem = text.splitlines(), error.problem or ""
    begins = error.context == "while scanning a simple key"  # the reader notices the missing colon a line later
    mark = error.context_mark if begins else error.problem_mark or error.context_mark
    line = mark.line + 1 if mark else 1
    around = lines[line - 1] if line <= len(lines) else ""  # the reader may notice an error behind the last line
    if "\t" in around[: len(around) - len(around.lstrip())] or "'\\t'" in problem:
        return f"{line}: expected spaces; found a tab: YAML is indented with spaces"
    is_ended = any(end in problem for end in ENDS) and "<document start>" not in problem
    begun = error.context_mark if error.context in UNCLOSED else _innermost_open(text, loader) if is_ended else None
    sign = "" if begun is None else lines[begun.line][begun.column : begun.column + 1] if begun.line < len(lines) else ""
    if begun is None or sign not in OPENING:  # characters that the YAML reader does not count as ends of lines
        return f"{line}: {_explained(problem, around, error.context_mark or mark)}"
    kind = OPENING[sign]
    what = f"the {kind} that begins with {sign} in column {begun.column + 1}"
    if is_ended or mark is None or sign in "'\"":
        met = "the end of the file" if is_ended else f"what does not belong there on line {line}"
        return f"{begun.line + 1}: expected an end of {what}; found {met}: close it"
    is_name = around[mark.column : mark.column + 1] == ":"  # a name begins before its colon
    column = around.rfind(" ", 0, mark.column) + 1 if is_name else mark.column
    met = f"{shown(around[column:].strip())} in column {column + 1} of line {line}"
    comma = f"set a comma before it, or close the {kind} there"
    return f"{begun.line + 1}: expected a comma or the end of {what}; found {met}: {comma}"


def _explained(problem: str, around: str, mark: yaml.Mark | None) -> str:
    meaning = next((meaning for part, meaning in EXPLAINED.items() if part in problem), "")
    if meaning:
        return f"{meaning}; found {shown(around.strip())}"
    if meaning is None and mark is not None and (value := NEEDS_QUOTES.match(around, mark.column)):
        text = value[0].rstrip()
        return f'`{text}` needs quotes: "{text}"'
    return f"the text is no YAML ({problem}); found {shown(around.strip())}: put text with special characters in quotes"


def _innermost_open(text: str, loader: type[yaml.SafeLoader]) -> yaml.Mark | None:
    """The place of the last bracket that is not closed, for a text that ends within one."""
    opened: list[yaml.Mark] = []
    for token in yaml.scan(text, Loader=loader):
        if isinstance(token, (FlowSequenceStartToken, FlowMappingStartToken)):
            opened.append(token.start_mark)
        elif isinstance(token, (FlowSequenceEndToken, FlowMappingEndToken)):
            opened.pop()
    return opened[-1] if opened else None
