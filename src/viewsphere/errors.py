"""Everything viewsphere raises on purpose.

    ViewsphereError
    ├── UserError                 the user can mend it: one line, exit status 2
    │   ├── RecipeError           a recipe's field, with file and line
    │   ├── ModelError            a model file that cannot be used
    │   ├── StoreError            an output folder that cannot be used
    │   └── MissingExtraError     a feature whose optional package is not installed
    ├── CheckFailedError          a data set that is not what it claims to be: exit status 1
    ├── BlenderError              Blender answered that it cannot; it lives, and can be asked again
    └── BlenderDied               Blender crashed, or hung and was ended; only another one can be asked

A message says where, what was expected, what was found and what to do, in one line.
"""

from __future__ import annotations


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


class MissingExtraError(UserError):
    """A feature whose optional package is not installed."""


class CheckFailedError(ViewsphereError):
    """A data set that is not what it claims to be."""


class BlenderError(ViewsphereError):
    """Blender answered that it cannot do what it was asked; it lives, and can be asked again."""


class BlenderDied(ViewsphereError):
    """Blender crashed, or hung and was ended; only another one can be asked.

    `signal` names what ended it, such as SIGKILL; None where that is not how it ended, or it hung.
    """

    def __init__(self, message: str, signal: str | None = None) -> None:
        super().__init__(message)
        self.signal = signal
