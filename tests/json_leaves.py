"""Places in values of JSON."""

from __future__ import annotations


def leaves(value, where=()):
    """The places of all numbers, texts and truths in a value of JSON, and of empty lists and objects."""
    if isinstance(value, dict | list) and value:
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(item, (*where, key))
    else:
        yield where
