"""Defaults that are made without a validator are those that it would make."""

from collections.abc import Iterator

import viewsphere.planning.plan  # noqa: F401 # every class of a recipe and a shot
from viewsphere.model.fields.frozen import Frozen


def _classes(base: type[Frozen]) -> Iterator[type[Frozen]]:
    for each in base.__subclasses__():
        yield each
        yield from _classes(each)


def test_defaults_of_fields_are_what_their_class_makes_of_no_arguments():
    defaults = [field.default for each in _classes(Frozen) for field in each.model_fields.values()]
    found = {type(default): default for default in defaults if isinstance(default, Frozen) and not default.model_fields_set}
    assert len(found) >= 15
    for kind, default in found.items():
        assert default == kind()
        assert default.model_dump() == kind().model_dump()
