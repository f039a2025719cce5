"""Functions for formulas that are tried both in numbers of 40 digits (mpmath) and on whole arrays (NumPy, float64)."""

from __future__ import annotations

import mpmath
import numpy as np


def _either(many_digits, arrays):
    def function(*values):
        return (arrays if any(isinstance(value, np.ndarray) for value in values) else many_digits)(*values)

    return function


sqrt = _either(mpmath.sqrt, np.sqrt)
sin = _either(mpmath.sin, np.sin)
cos = _either(mpmath.cos, np.cos)
tan = _either(mpmath.tan, np.tan)
atan = _either(mpmath.atan, np.arctan)
atan2 = _either(mpmath.atan2, np.arctan2)
