"""The author and the licence of a model."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.validation.errors import shown

LONGEST_CREDIT = 1000
"""Characters of a licence, of an attribution, or of a URL."""


def _one_line(text: str) -> str:
    if not text.isprintable() or not text.strip():
        raise ValueError(f"expected one line of printable text; found {shown(text)}")
    return text


def _url(text: str) -> str:
    """Refuse characters outside RFC 3986, so that a URL cannot end a Markdown link or a table cell."""
    if not re.fullmatch(r"https?://[^\s<>\"\\^`{|}]+", text):
        raise ValueError(f"expected a URL that begins with https:// or http://, without spaces; found {shown(text)}")
    return text


CreditText = Annotated[str, Field(min_length=1, max_length=LONGEST_CREDIT), AfterValidator(_one_line)]
Licence = Annotated[CreditText | None, Field(description="licence of the models, preferably an SPDX identifier: CC-BY-4.0")]
Attribution = Annotated[CreditText | None, Field(description="maker of the models, in the words that their licence requires")]
SourceUrl = Annotated[
    Annotated[CreditText, AfterValidator(_url)] | None, Field(description="origin of the models: https://...")
]


class Credit(Frozen):
    """A model's licence, its attribution and its source; unknown ones are None."""

    licence: Licence = None
    attribution: Attribution = None
    source_url: SourceUrl = None
