"""Recipe files: YAML 1.2 in UTF-8, read with the line of every value; their JSON schema; a recipe to start from."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, cast

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.tokens import FlowMappingEndToken, FlowMappingStartToken, FlowSequenceEndToken, FlowSequenceStartToken

from viewsphere.errors import RecipeError
from viewsphere.files import read_bytes
from viewsphere.limits import limits
from viewsphere.validation.errors import Marks, Place, dotted, shown
from viewsphere.validation.errors import Path as Steps

_UNCLOSED = ("while scanning a quoted scalar", "while parsing a flow sequence", "while parsing a flow mapping")
"""The YAML reader's contexts of an unclosed quote or bracket with a known place."""

_OPENING: dict[str, str] = {"'": "quoted text", '"': "quoted text", "[": "list", "{": "mapping"}
"""The kind of value that each opening sign begins."""

_ENDS = ("end of stream", "<stream end>")
"""The YAML reader's words for the end of a file."""

_NEEDS_QUOTES = re.compile(r"[*&!%@`|>][^,#\]}]*")
"""A value that begins with a character that is special in YAML, such as `*.obj`."""

_EXPLAINED = {
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

DEEPEST = 200
"""Largest nesting of brackets: the YAML reader's time for each level equals that of all levels around it."""

FOUND: dict[type | tuple[type, ...], str] = {type(None): "an empty file", list: "a list", str: "a text", object: "a number"}
"""The problem of a file that holds no mapping. The message does not quote the file, which may be private and no recipe."""

_HALF = re.compile("[\ud800-\udfff]")
_INT = re.compile(r"[-+]?[0-9]+\Z")
_FLOAT = re.compile(r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z")
_TAG = "tag:yaml.org,2002:"


def _use_yaml_12(rules: type[yaml.SafeLoader] | type[yaml.SafeDumper]) -> None:
    """Set YAML 1.2's core rules: `no` and `12:30` are text, `1e3` is a number, there are no dates and no merge keys."""
    rules.yaml_implicit_resolvers = {}
    rules.add_implicit_resolver(f"{_TAG}null", re.compile(r"(?:~|null|Null|NULL|)\Z"), ["~", "n", "N", ""])
    rules.add_implicit_resolver(f"{_TAG}bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), list("tTfF"))
    rules.add_implicit_resolver(f"{_TAG}int", _INT, list("-+0123456789"))
    rules.add_implicit_resolver(f"{_TAG}float", _FLOAT, list("-+.0123456789"))


class _TooMany(yaml.MarkedYAMLError):
    """More values than a recipe may have."""


class BoundedLoader(yaml.SafeLoader):
    """A loader that ends before it reads on: RecursionError for more than `DEEPEST` brackets within one another, and a
    MarkedYAMLError at the first value beyond MAX_RECIPE_VALUES. Keys of mappings do not count as values.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.most = self._left = limits.MAX_RECIPE_VALUES

    def fetch_flow_collection_start(self, TokenClass: Any) -> None:
        """Begin a list or a mapping in brackets."""
        if self.flow_level >= DEEPEST:
            raise RecursionError("lists or mappings nested too deeply")
        super().fetch_flow_collection_start(TokenClass)

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        """The next node."""
        if parent is None or index is not None:
            self._left -= 1
            if self._left < 0:
                raise self.too_many(self.peek_event().start_mark)
        return super().compose_node(parent, cast(Any, index))

    def too_many(self, mark: yaml.Mark) -> yaml.MarkedYAMLError:
        """The error of a value beyond the limit at this place."""
        problem = f"at most {self.most:,} values (limit MAX_RECIPE_VALUES) were expected; found more: write fewer aliases"
        return _TooMany(problem=problem, problem_mark=mark)


class _Loader(BoundedLoader):
    """A loader that follows the rules of YAML 1.2."""


class _Dumper(yaml.SafeDumper):
    """A dumper whose text `_Loader` reads back equal."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_use_yaml_12(_Loader)
_use_yaml_12(_Dumper)


def read(path: Path, fields: str = "name, models, viewpoints") -> tuple[Any, Marks]:
    """Plain data of one recipe file, or of another file with these fields, and the place of every value; raises RecipeError
    with file and line.
    """
    data, marks = parse(_text(path), str(path))
    if not isinstance(data, dict):
        found = next(kind for kinds, kind in FOUND.items() if isinstance(data, kinds))
        raise RecipeError(f"{path}:1: expected a mapping of {fields}, ...; found {found}")
    return data, marks


def parse(text: str, source: str) -> tuple[Any, Marks]:
    """Any YAML text as plain data, and the place of every value in it; raises RecipeError beginning with `source` and line."""
    loader = _Loader(text)
    try:
        root = loader.get_single_node()
        reader = _Reader(source, loader.most)
        data = reader.value(root, ()) if root is not None else None
    except _TooMany as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        problem = f"expected at most {loader.most:,} values (limit MAX_RECIPE_VALUES); found more"
        raise RecipeError(f"{source}:{line}: {problem}: write fewer, or set VIEWSPHERE_MAX_RECIPE_VALUES higher") from None
    except yaml.MarkedYAMLError as error:
        raise RecipeError(f"{source}:{_syntax_error(text, error, _Loader)}") from None
    except RecursionError:
        raise RecipeError(f"{source}: expected a recipe, found lists or mappings nested too deeply") from None
    return data, Marks(source, {steps: Place(source, line) for steps, line in reader.lines.items()})


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise RecipeError(f"{path}: expected a recipe file, found a folder: name the .yaml file in it")
        raw = read_bytes(path, "MAX_RECIPE_BYTES")
    except OSError as error:
        raise RecipeError(f"{path}: expected a readable recipe file, found: {error.strerror or error}") from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise RecipeError(
            f"{path}:{line}: expected text in UTF-8; found byte 0x{raw[error.start]:02x}: save it as UTF-8"
        ) from None
    control = yaml.reader.Reader.NON_PRINTABLE.search(text)
    if control:
        line = text.count("\n", 0, control.start()) + 1
        raise RecipeError(f"{path}:{line}: expected text; found the control character {control.group()!r}")
    return text


class _Reader:
    """Turns YAML nodes into plain data and keeps their lines."""

    def __init__(self, file: str, most: int) -> None:
        self.file = file
        self.most = most
        self.lines: dict[Steps, int] = {}
        self._count = 0
        self._open: set[int] = set()

    def value(self, node: Node, place: Steps) -> Any:
        """The node's plain data; raises RecipeError for duplicate keys, tags and endless or exploding aliases."""
        line = node.start_mark.line + 1
        self.lines.setdefault(place, line)
        self._count += 1
        if self._count > self.most:
            found = f"expected at most {self.most:,} values (limit MAX_RECIPE_VALUES); found more: write fewer aliases"
            raise self._error(line, place, found)
        if id(node) in self._open:
            raise self._error(line, place, "expected a value; found an alias for the value it stands in")
        self._open.add(id(node))
        try:
            if isinstance(node, MappingNode) and node.tag == f"{_TAG}map":
                return self._mapping(node, place)
            if isinstance(node, SequenceNode) and node.tag == f"{_TAG}seq":
                return [self.value(item, (*place, i)) for i, item in enumerate(node.value)]
            if isinstance(node, ScalarNode):
                return self._scalar(node, place)
        finally:
            self._open.discard(id(node))
        raise self._error(line, place, f"expected plain YAML; found the tag {node.tag!r}")

    def _mapping(self, node: MappingNode, place: Steps) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            key = key_node.value if isinstance(key_node, ScalarNode) else None
            if not isinstance(key, str):
                raise self._error(line, place, "expected a name before the colon; found a list or mapping")
            self._character(key, key_node, place)
            if key in result:
                first = self.lines[(*place, key)]
                raise self._error(line, (*place, key), f"expected every field once; found {key!r} again, after line {first}")
            self.lines[(*place, key)] = line
            result[key] = self.value(value_node, (*place, key))
        return result

    def _scalar(self, node: ScalarNode, place: Steps) -> Any:
        text: str = node.value
        match node.tag.removeprefix(_TAG):
            case "null":
                return None
            case "bool":
                return text.lower() == "true"
            case "int" if _INT.match(text) and len(text) <= 300:
                return int(text)
            case "float" if _FLOAT.match(text):
                return _float(text)
            case "str":
                return self._character(text, node, place)
            case _:
                line = node.start_mark.line + 1
                raise self._error(line, place, f"expected plain YAML; found {shown(text)} with the tag {node.tag!r}")

    def _character(self, text: str, node: Node, place: Steps) -> str:
        """The text; raises RecipeError for halves of pairs, such as `\\ud800` in quotes, which no file can hold, and for `\\0`,
        which no path can.
        """
        if "\0" in text:
            raise self._error(
                node.start_mark.line + 1, place, f"expected text; found the control character '\\x00' in {text!a:.60}"
            )
        if not text.isascii() and _HALF.search(text):
            raise self._error(node.start_mark.line + 1, place, f"expected characters; found half of one in {text!a:.60}")
        return text

    def _error(self, line: int, place: Steps, problem: str) -> RecipeError:
        return RecipeError(f"{self.file}:{line}: {dotted(place)}: {problem}")


def _float(text: str) -> float:
    lower = text.lower()
    if lower.endswith("inf"):
        return -math.inf if lower.startswith("-") else math.inf
    return math.nan if lower == ".nan" else float(text)


def dump(data: dict[str, Any]) -> str:
    """Plain data as the text of a recipe file that `read` gives back."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110)


def _syntax_error(text: str, error: yaml.MarkedYAMLError, loader: type[yaml.SafeLoader]) -> str:
    """The line, the problem and the fix of a YAML syntax error, as `12: '*.obj' needs quotes: "*.obj"`."""
    lines, problem = text.splitlines(), error.problem or ""
    begins = error.context == "while scanning a simple key"  # the reader notices the missing colon a line later
    mark = error.context_mark if begins else error.problem_mark or error.context_mark
    line = mark.line + 1 if mark else 1
    around = lines[line - 1] if line <= len(lines) else ""  # the reader may notice an error behind the last line
    if "\t" in around[: len(around) - len(around.lstrip())] or "'\\t'" in problem:
        return f"{line}: expected spaces; found a tab: YAML is indented with spaces"
    is_ended = any(end in problem for end in _ENDS) and "<document start>" not in problem
    begun = error.context_mark if error.context in _UNCLOSED else _innermost_open(text, loader) if is_ended else None
    sign = "" if begun is None else lines[begun.line][begun.column : begun.column + 1] if begun.line < len(lines) else ""
    if begun is None or sign not in _OPENING:  # characters that the YAML reader does not count as ends of lines
        return f"{line}: {_explained(problem, around, error.context_mark or mark)}"
    kind = _OPENING[sign]
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
    meaning = next((meaning for part, meaning in _EXPLAINED.items() if part in problem), "")
    if meaning:
        return f"{meaning}; found {shown(around.strip())}"
    if meaning is None and mark is not None and (value := _NEEDS_QUOTES.match(around, mark.column)):
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
