"""The stuff classes of scenery, from categories and part names."""

from __future__ import annotations

import re
from collections.abc import Sequence

from viewsphere.model.annotations.classes import SCENERY, STUFF_IDS
from viewsphere.plugins.source import families_named


def stuff_of(category: str, parts: Sequence[str]) -> list[int]:
    """The classes of the parts of scenery of a category.

    A family of models with the category's name declares the classes of its parts. Otherwise the name of the part decides, or
    else the category's, without trailing numbers and without the text before a slash: Road.001 is road. The default is scenery.
    """
    family = next(families_named(category.replace(" ", "_")), None)
    if family is not None:
        return [STUFF_IDS[family.classes.get(part, family.classes[""])] for part in parts]
    return [next((STUFF_IDS[name] for name in map(_plain, (part, category)) if name in STUFF_IDS), SCENERY) for part in parts]


def _plain(name: str) -> str:
    return re.sub(r"[\W\d_]+$", "", name.rpartition("/")[-1]).lower().replace("_", " ")
