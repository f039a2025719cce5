"""Which members of a long list of parameters the default suite has time for."""

from __future__ import annotations

import pytest


def quick(values, *chosen):
    """The values as parameters; all but the chosen ones are slow, as they mostly run the same code again."""
    return [v if v in chosen else pytest.param(*(v if isinstance(v, tuple) else (v,)), marks=pytest.mark.slow) for v in values]
