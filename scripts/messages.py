"""Lists the templates of all messages that users can meet, by file: tests/messages.txt.

scripts/messages.py              # fails if tests/messages.txt does not list the messages of the source
scripts/messages.py --write      # writes tests/messages.txt again

A template is the text of an exception or a warning, with `{}` for each value. Messages that a function builds elsewhere, from
values alone, have no template here.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from difflib import unified_diff
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src"
SNAPSHOT = ROOT / "tests" / "messages.txt"

WORKERS = {"blender"}
"""Packages whose exceptions other parts of the software translate."""

ERRORS = ast.parse((SOURCE / "viewsphere" / "errors.py").read_text("utf-8"))
NAMES = {node.name for node in ast.walk(ERRORS) if isinstance(node, ast.ClassDef)} | {"ValueError", "PydanticCustomError"}


def template(node: ast.expr) -> str | None:
    """The text of a message with `{}` for its values; None if it has no text of its own."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in parts)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            sides = [template(side) for side in (left, right)]
            return None if sides == [None, None] else "".join("{}" if side is None else side for side in sides)
        case ast.IfExp(body=body, orelse=orelse):
            return " | ".join(text for text in map(template, (body, orelse)) if text is not None) or None
        case _:
            return None


def messages(source: str) -> Iterator[str]:
    """Yield the templates of a module's messages, in its order."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMES:
            for argument in node.args:
                text = template(argument)
                if text is not None and text.strip("{} :.\n|"):
                    yield text.replace("\n", "\\n")


def listing() -> str:
    """The text of tests/messages.txt for the source as it is."""
    lines: list[str] = []
    for file in sorted(SOURCE.rglob("*.py")):
        path = file.relative_to(SOURCE)
        if WORKERS.isdisjoint(path.parts[1:2]) or "worker" not in path.parts:
            own = sorted(set(messages(file.read_text("utf-8"))))
            lines += [f"# {path.as_posix()}", *own, ""] if own else []
    return "\n".join(lines)


def main() -> None:
    """Compare, or write."""
    now = listing()
    if "--write" in sys.argv:
        SNAPSHOT.write_text(now, "utf-8", newline="\n")
        return
    known = SNAPSHOT.read_text("utf-8") if SNAPSHOT.exists() else ""
    if changes := list(
        unified_diff(known.splitlines(), now.splitlines(), "tests/messages.txt", "the source", lineterm="", n=0)
    ):
        sys.exit("\n".join([*changes, "run scripts/messages.py --write, and read what changed"]))


if __name__ == "__main__":
    main()
