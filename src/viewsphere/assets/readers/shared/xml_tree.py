"""XML files as trees, by expat: names without their namespaces, no entities, no external files."""

from __future__ import annotations

import re
from typing import Any, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from viewsphere.assets.paths.folder import ModelFolder

_DECLARED = re.compile(rb"""<\?xml[^>]*encoding\s*=\s*["']([A-Za-z0-9._-]+)""")


class _EntityError(Exception):
    """A file declares an entity. Entities are refused: nested ones expand to gigabytes, and some name files."""


def parse_xml(folder: ModelFolder, data: bytes, file: str = "") -> Element:
    """The root of an XML file, `file` of an archive or the model's own; comments and processing instructions are left out.

    Raises ModelError for XML that is not well-formed, or declares entities.
    """
    what = f"{file} " if file else ""
    try:
        return _parsed(data)
    except expat.ExpatError as error:
        problem = expat.ErrorString(error.code)
        where = f"{problem}, line {error.lineno}"
        raise folder.error(f"{what}is not well-formed XML ({where}): truncated or damaged") from None
    except (LookupError, UnicodeError) as error:
        raise folder.error(f"{what}is not well-formed XML ({str(error)[:100]}): save it as UTF-8") from None
    except _EntityError:
        raise folder.error(f"{what}declares XML entities, which are not read: save it without them") from None


def _parsed(data: bytes) -> Element:
    try:
        return _tree(expat.ParserCreate(), data)
    except ValueError:  # an encoding such as Shift JIS: expat reads only Unicode and single-byte encodings
        name = _DECLARED.match(data)
    return _tree(expat.ParserCreate("utf-8"), data.decode(name[1].decode() if name else "utf-8").encode())


def _tree(parser: expat.XMLParserType, data: bytes) -> Element:
    builder, local = TreeBuilder(), _Locals()

    def start(tag: str, attributes: dict[str, str]) -> None:
        named = {local[name]: value for name, value in attributes.items()}
        if len(named) < len(attributes):  # id beside xml:id: the one without a prefix counts
            named |= {name: value for name, value in attributes.items() if ":" not in name}
        builder.start(local[tag], named)

    def end(tag: str) -> None:
        builder.end(local[tag])

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.buffer_text, parser.buffer_size = builder.data, True, 1 << 16
    parser.EntityDeclHandler = _refuse
    parser.Parse(data, True)
    return builder.close()


class _Locals(dict[str, str]):
    """A cache of names without their prefixes, by the full names."""

    def __missing__(self, name: str) -> str:
        local = self[name] = name.rpartition(":")[2]
        return local


def _refuse(*_: Any) -> NoReturn:
    raise _EntityError
