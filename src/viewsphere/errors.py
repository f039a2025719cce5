"""Everything viewsphere raises on purpose.

    ViewsphereError
    ├── UserError                 the user can mend it: one line, exit status 2
    │   ├── RecipeError           a recipe's field, with file and line
    │   ├── ModelError            a model file that cannot be used
    │   ├── StoreError            an output folder that cannot be used
    │   ├── RemoteError           a URL that does not answer, or refuses
    │   ├── PluginError           a plug-in that cannot be loaded, or whose spec is not valid
    │   └── MissingExtraError     a feature whose optional package is not installed
    ├── CheckFailedError          a data set that is not what it claims to be: exit status 1
    ├── WorkerDied                who did a job died, as often as it is tried; other jobs go on
    ├── BlenderError              Blender answered that it cannot; it lives, and can be asked again
    └── BlenderDied               Blender crashed, or hung and was ended; only another one can be asked

A message says where, what was expected, what was found and what to do, in one line; mistakes that are told together have a
line each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")

MOST_TOLD = 20
"""Mistakes that are told together; of further ones the number is."""


class ViewsphereError(Exception):
    """Anything that viewsphere raises on purpose."""


class UserError(ViewsphereError):
    """A mistake the user can mend; the command line shows it in one line and exits with status 2."""


class RecipeError(UserError):
    """A recipe that does not say something that can be done."""


class ModelError(UserError):
    """A model file that cannot be used."""


class StoreError(UserError):
    """An output folder that cannot be used."""


class RemoteError(UserError):
    """A URL that does not answer, or refuses; what is finished there is kept."""


class PluginError(UserError):
    """A plug-in that cannot be loaded, or whose spec is not valid; the message names its file and field."""


class MissingExtraError(UserError):
    """A feature whose optional package is not installed."""


class CheckFailedError(ViewsphereError):
    """A data set that is not what it claims to be."""


class WorkerDied(ViewsphereError):
    """A job's process or machine died in every try; other jobs go on."""


class BlenderError(ViewsphereError):
    """Blender answered that it cannot do what it was asked; it lives, and can be asked again. `reason` is the message without
    the name of Blender's exception, `how` the whole one.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.how, self.reason = message, message.partition(": ")[2]


class BlenderDied(ViewsphereError):
    """Blender crashed, or hung and was ended; only another one can be asked.

    `how` is the message without the end of Blender's log. `signal` names the signal that ended it, such as SIGKILL; None where
    there was none, or it hung. `is_late`: it was ended because it hung.
    """

    def __init__(self, how: str, signal: str | None = None, *, log: str = "", is_late: bool = False) -> None:
        super().__init__(f"{how}; its log ends with: {log}" if log else how)
        self.how, self.signal, self.is_late = how, signal, is_late


class NotKeptError(AttributeError):
    """An object lacks a field, or its data set does not keep it."""


def joined(errors: Sequence[ViewsphereError]) -> ViewsphereError:
    """Join errors to one, each line once; of their common type if they have one, else a UserError."""
    kinds = {type(error) for error in errors}
    kind = kinds.pop() if len(kinds) == 1 else UserError
    lines = list(dict.fromkeys(line for error in errors for line in str(error).splitlines()))
    left = lines[MOST_TOLD:]
    return kind("\n".join([*lines[:MOST_TOLD], *([f"and {len(left):,} more mistakes"] if left else [])]))


def each(work: Callable[[Item], Made], items: Iterable[Item]) -> list[Made]:
    """Return the result of `work` for each item, in order; raises all of the user's mistakes together, as `joined` does."""
    made, errors = list[Made](), list[UserError]()
    for item in items:
        try:
            made.append(work(item))
        except UserError as error:
            errors.append(error)
    if errors:
        raise joined(errors) from None
    return made
