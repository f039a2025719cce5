"""The exceptions that viewsphere raises on purpose.

    ViewsphereError
    ├── UserError                 the user can fix it: one line, exit status 2
    │   ├── RecipeError           a recipe's field, with file and line
    │   ├── ModelError            a model file that cannot be used
    │   ├── StoreError            an output folder that cannot be used
    │   ├── RemoteError           a URL that does not answer, or refuses
    │   ├── PluginError           a plug-in that cannot be loaded, or whose spec is not valid
    │   └── MissingExtraError     a feature whose optional package is not installed
    ├── CheckFailedError          a data set that is not what it claims to be: exit status 1
    ├── WorkerDied                a job's process died in every try; other jobs go on
    ├── BlenderError              Blender reported that a request failed; it still runs
    └── BlenderDied               Blender crashed, or hung and was killed

A message states the place, the expected value, the value found and the fix, in one line. Errors reported together have one line
each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")

MOST_TOLD = 20
"""Maximum number of errors reported together; further ones are only counted."""


class ViewsphereError(Exception):
    """The base class of all exceptions that viewsphere raises on purpose."""


class UserError(ViewsphereError):
    """An error the user can fix; the command line shows it in one line and exits with status 2."""


class RecipeError(UserError):
    """An invalid recipe."""


class ModelError(UserError):
    """A model file that cannot be used."""


class StoreError(UserError):
    """An output folder that cannot be used."""


class RemoteError(UserError):
    """A URL that does not answer, or refuses; results already finished there are kept."""


class PluginError(UserError):
    """A plug-in that cannot be loaded, or whose spec is not valid; the message names its file and field."""


class MissingExtraError(UserError):
    """A feature whose optional package is not installed."""


class CheckFailedError(ViewsphereError):
    """A data set that is not what it claims to be."""


class WorkerDied(ViewsphereError):
    """A job's process or machine died in every try; other jobs go on."""


class BlenderError(ViewsphereError):
    """Blender reported that a request failed; it still runs and accepts further requests. `reason` is the message without the
    name of Blender's exception, `how` the full message.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.how, self.reason = message, message.partition(": ")[2]


class BlenderDied(ViewsphereError):
    """Blender crashed, or hung and was killed; further requests need a new Blender process.

    `how` is the message without the end of Blender's log. `signal` names the signal that ended it, such as SIGKILL; None if
    there was none or Blender hung. `is_late`: Blender was killed because it hung.
    """

    def __init__(self, how: str, signal: str | None = None, *, log: str = "", is_late: bool = False) -> None:
        super().__init__(f"{how}; its log ends with: {log}" if log else how)
        self.how, self.signal, self.is_late = how, signal, is_late


class NotKeptError(AttributeError):
    """A field that an object lacks or its data set does not store."""


def joined(errors: Sequence[ViewsphereError]) -> ViewsphereError:
    """Join errors into one, with each line once. It has their common type if there is one, else UserError."""
    kinds = {type(error) for error in errors}
    kind = kinds.pop() if len(kinds) == 1 else UserError
    lines = list(dict.fromkeys(line for error in errors for line in str(error).splitlines()))
    left = lines[MOST_TOLD:]
    return kind("\n".join([*lines[:MOST_TOLD], *([f"and {len(left):,} more mistakes"] if left else [])]))


def each(work: Callable[[Item], Made], items: Iterable[Item]) -> list[Made]:
    """Return the result of `work` for each item, in order; raises all UserErrors together, as `joined` does."""
    made, errors = list[Made](), list[UserError]()
    for item in items:
        try:
            made.append(work(item))
        except UserError as error:
            errors.append(error)
    if errors:
        raise joined(errors) from None
    return made
