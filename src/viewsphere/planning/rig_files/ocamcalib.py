"""OCamCalib's calib_results.txt: the lens of one omnidirectional camera (https://sites.google.com/site/scarabotix/ocamcalib-toolbox).

The file's axes are x down the rows, y along the columns and z backwards; its pixels are (row, column), counted from the centre
of the first one. Of its two polynomials, the forward one is the lens; the other approximates the inverse.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.composing.viewpoints.pose_files.lines import numbers
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.fields.numbers import LARGEST
from viewsphere.planning.rig_files.documents import size
from viewsphere.planning.rig_files.entries import CENTER, Calibrated
from viewsphere.validation.errors import told_of

LINES = 5
"""Lines of numbers: the polynomial, its approximate inverse, the centre, the affine matrix, the size."""

MOST_TERMS = 13
"""Terms of a polynomial, a0 and a1 among them, as many as the lens has."""

STRETCH, SHEAR = 10.0, 0.5
"""Limits of the affine matrix, which is near the unit matrix for common sensors: its stretch, and its shear as a share of that,
as in the lens.
"""


def is_own(document: dict[str, Any]) -> bool:
    """Return whether a document is one of OCamCalib's."""
    lines: list[list[str]] = document.get("lines", [])
    return len(lines) == LINES and [len(line) for line in lines[2:]] == [2, 3, 2]


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The camera, named by the file. Raises RecipeError for files with other numbers."""
    where = ", ".join(map(str, documents))
    if rectified or len(documents) > 1 or not all(map(is_own, documents.values())):
        raise RecipeError(f"{where}: expected one calib_results.txt of OCamCalib, not rectified; found another setting")
    ((path, document),) = documents.items()
    polynomial, _, center, affine, extent = (numbers(line, where) for line in document["lines"])
    count, a0, a1 = len(polynomial) - 1, *(-term for term in (*polynomial[1:3], 0.0, 0.0)[:2])
    if polynomial[0] != count or not 3 <= count <= MOST_TERMS or not 0 < a0 <= LARGEST or a1 != 0:
        raise RecipeError(
            f"{where}: expected a polynomial of a0 below 0, down to {-LARGEST:g}, a1 of 0, 1 to {MOST_TERMS - 2} terms more; "
            f"found {count} numbers from {-a0:g}, {-a1:g}: calibrate the camera again"
        )
    c, d, e = affine
    if not 1 / STRETCH <= c <= STRETCH or max(abs(d), abs(e)) > SHEAR * c or not c > e * d:
        raise RecipeError(
            f"{where}: expected an affine matrix near [[1, 0], [0, 1]]; found c {c:g}, d {d:g}, e {e:g}: "
            "calibrate the camera again"
        )
    coefficients = tuple(-term * a0 ** (n + 1) for n, term in enumerate(polynomial[3:]))
    lens = {"fx": a0 * (1 - e * d / c), "fy": a0 * c, "skew": a0 * e, "cx": center[1] + CENTER, "cy": center[0] + CENTER}
    with told_of(where):
        distortion = lens_parameters("scaramuzza", coefficients=coefficients, shear=d / c)
    return (Calibrated(Calibrated.name_by(path), lens, distortion, np.eye(4), size(extent[1], extent[0], where)),)
