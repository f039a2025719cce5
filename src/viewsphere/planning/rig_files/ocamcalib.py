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
from viewsphere.planning.rig_files.documents import size
from viewsphere.planning.rig_files.entries import CENTER, Calibrated
from viewsphere.validation.errors import told_of

LINES = 5
"""Lines of numbers: the polynomial, its approximate inverse, the centre, the affine matrix, the size."""


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is one of OCamCalib's."""
    lines = document.get("lines")
    return isinstance(lines, list) and len(lines) == LINES and len(lines[2]) == 2 and len(lines[3]) == 3


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The camera, named by the file. Raises RecipeError for files with other numbers."""
    where = ", ".join(map(str, documents))
    if rectified or len(documents) > 1 or not all(map(is_own, documents.values())):
        raise RecipeError(f"{where}: expected one calib_results.txt of OCamCalib, not rectified; found another setting")
    ((path, document),) = documents.items()
    polynomial, _, center, affine, extent = (numbers(line, where) for line in document["lines"])
    count, a0 = int(polynomial[0]), -polynomial[1] if len(polynomial) > 1 else 0.0
    if len(polynomial) != count + 1 or count < 3 or a0 <= 0 or polynomial[2] != 0:
        raise RecipeError(
            f"{where}: expected a polynomial of a0 below 0, a1 of 0, and a2; found {len(polynomial) - 1} numbers from "
            f"{-a0:g}, {polynomial[2] if len(polynomial) > 2 else 0:g}"
        )
    c, d, e = affine
    if not c > 0 or not c > e * d:
        raise RecipeError(f"{where}: expected an affine matrix near [[1, 0], [0, 1]]; found c {c:g}, d {d:g}, e {e:g}")
    coefficients = tuple(-term * a0 ** (n + 1) for n, term in enumerate(polynomial[3:]))
    lens = {"fx": a0 * (1 - e * d / c), "fy": a0 * c, "skew": a0 * e, "cx": center[1] + CENTER, "cy": center[0] + CENTER}
    with told_of(where):
        distortion = lens_parameters("scaramuzza", coefficients=coefficients, shear=d / c)
    return (Calibrated(path.stem, lens, distortion, np.eye(4), size(extent[1], extent[0], where)),)
