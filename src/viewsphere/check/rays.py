"""An independent witness: Embree casts rays at the exported models, read back by trimesh."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import MissingExtraError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

Float = NDArray[np.float64]

PIXELS = 5000
"""Pixels of a frame that are cast, spread evenly over the objects."""

TOLERANCE = 1e-4
"""Share of the distance by which Embree's float32 and the stored depth may differ."""

OUTLIERS = 0.01
"""Share of the pixels that may differ: where a ray passes within rounding of a triangle's edge, or meets it at a glance."""


class RayCaster:
    """Casts rays at a data set's models; the last scene is kept, because frames of one scene follow one another."""

    def __init__(self, dataset: Dataset) -> None:
        if find_spec("embreex") is None:
            raise MissingExtraError("expected embreex, found none: pip install 'viewsphere[check]'")
        self._files = {info.key: dataset.path(info.glb) for info in dataset.models}
        self._key: object = None
        self._scene: Any = None
        self._triangle_object = np.zeros(0, np.int64)
        self._middle = np.zeros(3)
        self._opaque = True

    def off_surface(self, sample: Sample) -> Iterator[str]:
        """What stored depth and instances say and the exported models, seen by Embree, do not.

        Each point must be the first that its ray meets, and on the right object; of models with see-through materials it
        must lie on a surface.
        """
        self._build(sample)
        camera = sample.camera
        rays = pixel_rays(camera.intrinsics)
        instances, depth = sample.channels["instances"], sample.channels["depth"]
        rows, columns = np.nonzero((instances > 0) & np.isfinite(depth) & (np.abs(rays[..., 2]) > 1e-3))
        if not len(rows):
            return
        chosen = np.linspace(0, len(rows) - 1, min(PIXELS, len(rows))).astype(int)
        rows, columns = rows[chosen], columns[chosen]
        directions = rays[rows, columns] @ camera.R
        s = depth[rows, columns] / rays[rows, columns, 2]
        slack = TOLERANCE * np.abs(s)
        start = np.zeros_like(s) if self._opaque else s - slack
        origins = camera.center - self._middle + start[:, None] * directions
        hit = self._scene.run(origins.astype(np.float32), directions.astype(np.float32), output=True)
        found = np.asarray(hit["tfar"], np.float64) + start
        ids = np.append(self._triangle_object, 0)[np.asarray(hit["primID"], np.int64)]
        wrong = ~(np.abs(found - s) <= slack) | (ids != instances[rows, columns])
        if wrong.sum() > max(2, OUTLIERS * len(s)):
            i = int(np.flatnonzero(wrong)[0])
            stored, x, y = instances[rows[i], columns[i]], columns[i], rows[i]
            yield (
                f"{wrong.sum()} of {len(s)} points are not on the exported model: at pixel ({x}, {y}) object {stored} is "
                f"stored at {s[i]:.6g} m along the ray, Embree finds {ids[i]} at {found[i]:.6g} m"
            )

    def _build(self, sample: Sample) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        key = [(o.key, o.world_from_object.tobytes()) for o in sample.objects]
        if key == self._key:
            return
        self._middle = np.mean([o.box3d.mean(axis=0) for o in sample.objects], axis=0)
        corners: list[Float] = []
        owners: list[NDArray[np.int64]] = []
        self._opaque = True
        for o in sample.objects:
            triangles, opaque = _read(self._files[o.key])
            placed = triangles @ o.world_from_object[:3, :3].T + o.world_from_object[:3, 3] - self._middle
            corners.append(placed)
            owners.append(np.full(len(triangles), o.id, np.int64))
            self._opaque &= opaque
        self._triangle_object = np.concatenate(owners)
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, np.concatenate(corners).astype(np.float32))
        self._key = key


def _read(file: Any) -> tuple[Float, bool]:
    """Corners (T, 3, 3) of an exported GLB in the object's axes, and whether nothing of it can be seen through."""
    import trimesh

    scene: Any = trimesh.load_scene(file, process=False)
    corners: list[Float] = []
    opaque = True
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[name]
        mesh = scene.geometry[geometry]
        x, y, z = (trimesh.transform_points(mesh.vertices, matrix)).T
        corners.append(np.stack([x, -z, y], axis=-1)[mesh.faces])
        material = getattr(mesh.visual, "material", None)
        opaque &= getattr(material, "alphaMode", None) in (None, "OPAQUE")
    return np.concatenate(corners), opaque
