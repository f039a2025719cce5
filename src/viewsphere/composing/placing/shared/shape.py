"""The shape of a model, for placers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import MissingExtraError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform

Float = NDArray[np.float64]


Surface = tuple[Float, NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class Shape:
    """A model's shape in its own axes, metres: its box (8, 3), and its convex hull, computed on first access. `vertices`
    returns the vertices (N, 3) of the model's mesh; `surface` returns them with the mesh's triangles (M, 3).
    """

    box: Float
    vertices: Callable[[], Float]
    surface: Callable[[], Surface] | None = None

    def turned(self, rotation: Float) -> Shape:
        """The shape turned by a rotation (3, 3) in its own axes; raises ModelError if the model's file cannot be used."""
        points, surface = transform(rotation, self.vertices()), self.surface

        def turned_surface() -> Surface:
            vertices, triangles = surface() if surface else (self.vertices(), np.zeros((0, 3), np.int32))
            return transform(rotation, vertices), triangles

        return Shape(Box3d.around(points).corners, lambda: points, turned_surface)

    @property
    def length(self) -> float:
        """Length of its box's longest side, metres."""
        return float((self.box.max(axis=0) - self.box.min(axis=0)).max())

    @cached_property
    def hull(self) -> Float:
        """Vertices of the convex hull (N, 3), in rising order of x, y, z; of a flat model all its vertices, each once.

        By Qhull (Barber et al. 1996). Raises ModelError if the model's file cannot be used, MissingExtraError without scipy.
        """
        try:
            from scipy.spatial import ConvexHull, QhullError
        except ImportError:
            raise MissingExtraError(
                "scene.company.layout: expected the package scipy for convex hulls, found none: pip install 'viewsphere[hulls]'"
            ) from None
        points = np.unique(self.vertices(), axis=0)
        try:
            return points[np.sort(ConvexHull(points).vertices)]
        except QhullError:  # no volume, or fewer than four points
            return points
