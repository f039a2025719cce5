"""Comparisons of labels with what knows nothing of how they are made, and of what programs read of exports with labels;
`benchmarks/measure_labels` and `benchmarks/measure_formats` gather their differences.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

VARIABLE = "VIEWSPHERE_PROVEN"
"""Names the file to which differences are appended, a line of JSON each; without it nothing is written."""

DISTRIBUTIONS = {"OpenCV": "opencv-python-headless", "PIL": "pillow", "cv2.FileStorage": "opencv-python-headless"}
"""Of programs that are called otherwise."""


def close(label, against, found, expected, unit="", *, atol=0.0, rtol=0.0):
    """A label's numbers are those expected by something else, which `against` names, but for a tolerance."""
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=atol)
    with np.errstate(invalid="ignore"):  # of infinite ones
        told(label, against, np.subtract(found, expected), unit)


def equal(label, against, found, expected):
    """A label is exactly what something else expects."""
    np.testing.assert_array_equal(found, expected)
    told(label, against, 0)


def told(label, against, error, unit=""):
    """Note the largest of a label's differences (those that are no number aside), which the caller has judged.

    A difference without a unit is a share, or a number of things that differ.
    """
    file, errors = os.environ.get(VARIABLE), np.abs(np.asarray(error, float)).ravel()
    if file and len(errors := errors[np.isfinite(errors)]):
        test = os.environ["PYTEST_CURRENT_TEST"].partition("::")[0]
        line = {"label": label, "against": against, "error": float(errors.max()), "unit": unit, "test": test}
        line["version"] = version_of(against)
        with Path(file).open("a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")


def version_of(against):
    """The version of the one program that `against` names before its colon; empty where none or several have one."""
    found = []
    for words in against.partition(":")[0].split(", "):
        name = words.partition(" ")[0]
        with suppress(PackageNotFoundError, ValueError):
            found.append(version(DISTRIBUTIONS.get(name, name)))
    return found[0] if len(found) == 1 else ""
