"""Omni3D: 3D and 2D boxes of all objects, in JSON similar to COCO's, for Cube R-CNN.

    Omni3D/viewsphere_<split>.json       info, images, categories, annotations
    viewsphere/<split>/<index>.png       the pictures

The folder is Cube R-CNN's `datasets`: `file_path` of an image is relative to it. Values are in metres and the camera's axes, x
right, y down, z ahead. An annotation has

- center_cam, dimensions [width, height, length] and R_cam, from the box's axes (x its front, y down, z its left) to the
  camera's;
- bbox3D_cam, the corners: 0 back-top-right, 1 front-top-right, 2 front-bottom-right, 3 back-bottom-right, 4 to 7 the same on
  the object's own left;
- bbox2D_proj, around the projected corners, and bbox2D_trunc, its part inside the picture; bbox2D_tight, around the visible
  pixels: corners x1, y1, x2, y2. -1 means none, for example with a corner behind the camera (behind_camera);
- visibility, truncation (0 to 1), segmentation_pts (visible pixels); lidar_pts and depth_error are unknown: -1; valid3D;
- track_id, an addition: the object's id in its sequence.

Hidden objects are listed with segmentation_pts 0, and Cube R-CNN ignores them. Omni3D defines neither the pixel origin nor the
front of an object. Here K has the picture's corner at (0, 0), and an object looks along x. Image ids count from 1, and no two
splits share an id. Training with Cube R-CNN also needs `Omni3D/stats.json`, which its own scripts create. Source: Brazil et al.
2023, "Omni3D: A Large Benchmark and Model for 3D Object Detection in the Wild",
https://github.com/facebookresearch/omni3d/blob/main/DATA.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.refusals import known_cameras, pinhole
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions, item
from viewsphere.geometry.box import clip_to_image
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec

KINDS = (".png", ".jpg")
NAME = "viewsphere"
DATASET = 1000
"""Number of the data set; Omni3D's own data sets have small numbers."""
UNKNOWN = [-1.0, -1.0, -1.0, -1.0]
OBJECT_FROM_BOX = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""The rotation from Omni3D's axes of a box (x front, y down, z left) to viewsphere's object axes (x left, y back, z up)."""
CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]) / 2
"""A box's corners in its own axes, in Omni3D's order, as shares of length, height and width."""


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, and distorted lenses."""
    yield from known_cameras(scope)
    yield from pinhole(scope)


class Omni3d(Tree):
    """The tree of splits."""

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its image and its annotations."""
        stem, plan = self.stem(sample), self.dataset.plan
        place, table = f"{NAME}/{stem}{suffix_of(sample, *KINDS)}", f"Omni3D/{NAME}_{sample.split or 'all'}.json"
        yield File(place, picture(sample, *KINDS))
        image = {"id": sample.index + 1, "dataset_id": DATASET, "width": sample.width, "height": sample.height}
        more = {"file_path": place, "K": sample.camera.K.tolist(), "src_90_rotate": 0, "src_flagged": False}
        yield item(table, image | more, "images")
        for o in sample.objects:
            ids = {"id": plan.annotation_id(sample.index, o.id), "image_id": sample.index + 1, "dataset_id": DATASET}
            yield item(table, ids | _annotation(sample, o), "annotations")

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """A JSON object with the two lists and the data of the whole data set."""
        split = path.removesuffix(".json").partition(f"{NAME}_")[2]
        info = {"id": DATASET, "source": NAME, "name": f"{NAME} {split}", "split": split, "version": "0.1", "url": ""}
        own = [{"id": c.id, "name": c.name, "supercategory": c.supercategory} for c in self.dataset.categories]
        head = b'{"info":' + json_bytes(info) + b',\n"categories":' + json_bytes(own)
        return head + b',\n"images":[\n', "images", b'\n],\n"annotations":[\n', "annotations", b"\n]}\n"


_NO_BOX: dict[str, Any] = {
    "bbox2D_proj": UNKNOWN,
    "bbox2D_trunc": UNKNOWN,
    "bbox3D_cam": [[-1.0] * 3] * 8,
    "center_cam": [-1.0] * 3,
    "dimensions": [-1.0] * 3,
    "R_cam": [[-1.0] * 3] * 3,
    "behind_camera": False,
}


def _annotation(sample: Sample, o: ObjectAnnotation) -> dict[str, Any]:
    is_known = o.is_boxed
    return {
        "category_id": o.category_id,
        "category_name": o.category,
        "track_id": o.id,
        "valid3D": is_known,
        "bbox2D_tight": UNKNOWN if o.box2d is None else list(o.box2d),
        **(_box(sample, o) if is_known else _NO_BOX),
        "visibility": _share(o.visibility) if is_known else -1,
        "truncation": _share(o.truncation) if is_known else -1,
        "segmentation_pts": o.area,
        "lidar_pts": -1,
        "depth_error": -1,
    }


def _share(value: float) -> float:
    """A share; -1 if it is unknown."""
    return -1 if math.isnan(value) else value


def _box(sample: Sample, o: ObjectAnnotation) -> dict[str, Any]:
    """The box in 3D, and its 2D boxes in the picture."""
    width, height, length = o.size
    rotation = product(o.camera_from_object[:3, :3], OBJECT_FROM_BOX)
    center = o.box3d_camera.mean(axis=0)
    corners = transform(rotation, CORNERS * [length, height, width]) + center
    is_behind = bool(corners[:, 2].min() <= 0)
    around = None if is_behind else _bounds(transform(sample.camera.K, corners))
    inside = around and clip_to_image(around, sample.width, sample.height)
    return {
        "bbox2D_proj": list(around or UNKNOWN),
        "bbox2D_trunc": list(inside or UNKNOWN),
        "bbox3D_cam": corners.tolist(),
        "center_cam": center.tolist(),
        "dimensions": [width, height, length],
        "R_cam": rotation.tolist(),
        "behind_camera": is_behind,
    }


def _bounds(seen: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """The 2D box of homogeneous pixels (8, 3)."""
    pixels = seen[:, :2] / seen[:, 2:]
    x0, y0, x1, y1 = (*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())
    return x0, y0, x1, y1


preparer, writer, verify = functions(Omni3d)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("3D boxes", "boxes", "poses", "visibility"),
    read_by=("Cube R-CNN", "pycocotools"),
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
