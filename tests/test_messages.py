"""The snapshot of all messages, and rules that each message keeps."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SPEC = importlib.util.spec_from_file_location("messages", ROOT / "scripts" / "messages.py")
messages = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(messages)
TEMPLATES = [line for line in messages.SNAPSHOT.read_text("utf-8").splitlines() if line and not line.startswith("# ")]

FORBIDDEN = {
    "found others": "name the value that was found",
    "found another number": "give the number that was found",
    "nobody": "name the part of the software, or the reader",
    "somebody": "name the part of the software, or the reader",
    "is told": "use the present and active: reports, names",
}


def test_the_snapshot_lists_the_messages_of_the_source():
    assert messages.SNAPSHOT.read_text("utf-8") == messages.listing(), "run scripts/messages.py --write, and read what changed"


def test_templates_keep_text_and_mark_values():
    source = (
        'raise UserError(f"{name}: expected {one + 1:,} frames; found {two}")\nraise ValueError("a " + str(b))\nprint("no")\n'
    )
    assert list(messages.messages(source)) == ["{}: expected {} frames; found {}", "a {}"]
    assert list(messages.messages('raise UserError(message)\nraise ValueError(f"{a}: {b}")')) == []


@pytest.mark.parametrize("words", FORBIDDEN)
def test_no_message_has_words_that_name_nothing(words):
    found = [line for line in TEMPLATES if re.search(rf"\b{words}\b", line)]
    assert not found, f"{FORBIDDEN[words]}: {found}"


PLURAL = re.compile(r"(?<![-\w.x] )(?<!\{\})\{\} (frames|models|files|images|shots|scenes|samples|things|objects|sequences)\b")

NO_COUNT_OF_ONE = ("samples in a pixel want", "samples instead of", "files are not read")
"""At least two samples in a pixel; a shot that has lost samples; and `{}` is a kind of file."""


def test_numbers_agree_with_what_they_count():
    """A number before a plural noun may be one: such messages use `quantity`, which leaves no noun in the template."""
    found = [line for line in TEMPLATES if PLURAL.search(line) and not any(words in line for words in NO_COUNT_OF_ONE)]
    assert found == []
