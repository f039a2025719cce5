"""NOCS, in the layout of the data set REAL275: category-level poses, for the loaders of Wang et al. 2019 and their successors.

    real/<split>/<scene>/0000_color.png, 0000_depth.png, 0000_mask.png, 0000_coord.png, 0000_meta.txt
    obj_models/real_<split>/<model>.obj, <model>.txt       the mesh; its three extents
    gts/real_<split>/results_real_<split>_<scene>_0000.pkl  the poses

A scene is a sequence, and a picture's number is its instant. The scene of a sensor that is not named `camera` is
`<sequence>-<sensor>`. A thousand still pictures make a scene.

- depth: 16 bits, millimetres along z, 0 for the background; 65535 beyond 65.535 m.
- mask: 8 bits, the object's id; 255 is background. Loaders accept at most 18 objects in a picture, and require at least one
  pixel of background.
- coord: 8 bits, red x, green y, blue 1 - z of the place in the object's box, whose diagonal is 1, times 255; black is
  background.
- meta: a line for each object: id (from 1), class (the category's number, from 1), model. Objects that the recipe excludes from
  annotations have class 0, like NOCS' distractors.
- models: metres, around the centre of the box; the text holds its extents along x, y and z.
- poses of the visible objects, by id: gt_class_ids, gt_bboxes (y0, x0, y1, x1), gt_RTs (4x4: from places less 0.5, by the box's
  diagonal in metres, to the camera; OpenCV axes), gt_scales (extents over diagonal), handle_visibility (1). An addition is
  intrinsics (3x3), with the centre of the first pixel at (0, 0).

The export rotates objects' axes to y up, x to the object's left and z to its front. NOCS' own models stand upright along y; a
front along z is not verified. Not stored: symmetries of models, and the lens' distortion. Axes and units of the poses follow
the readers of REAL275's files, but are not verified against the files. CAMERA's other layout, with depth in two colours, is not
supported. Source: Wang et al. 2019, "Normalized Object Coordinate Space for Category-Level 6D Object Pose and Size Estimation",
https://github.com/hughw19/NOCS_CVPR2019.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import depth_png, picture
from viewsphere.formats.shared.writing.refusals import known_cameras, most_objects
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset, ModelInfo

BACKGROUND = 255
SCENE_SIZE = 1000
"""Number of still pictures in a scene."""
MILLIMETRE = 0.001
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""The rotation from the axes of objects (x left, y back, z up) to NOCS' axes (x left, y up, z to the front)."""


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, and more objects than the mask can number."""
    yield from known_cameras(scope)
    yield from most_objects(scope, BACKGROUND - 1)


class Nocs(Tree):
    """The tree of scenes."""

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """Yield the files of a picture."""
        if "nocs" not in sample.channels:
            raise UserError(f"nocs: expected channel nocs; found none of frame {sample.index}")
        split, scene, number = sample.split or "all", *_place(sample)
        stem = f"real/{split}/{scene}/{number:04d}"
        yield File(f"{stem}_color.png", picture(sample, ".png"))
        yield File(f"{stem}_depth.png", depth_png(sample, MILLIMETRE))
        yield File(f"{stem}_mask.png", Coded(sample.index, "nocs mask.png", lambda: encode_png(_mask(sample))))
        yield File(f"{stem}_coord.png", Coded(sample.index, "nocs coord.png", lambda: encode_png(_coord(sample))))
        yield File(f"{stem}_meta.txt", _meta(sample).encode())
        yield File(f"gts/real_{split}/results_real_{split}_{scene}_{number:04d}.pkl", _portable(_poses(sample)))

    def rest(self) -> Iterator[File]:
        """Meshes and extents, which loaders expect in every split."""
        for info in self.dataset.models:
            mesh, extents = _mesh(self.dataset, info), " ".join(map(repr, map(float, info.size)))
            for split in self.dataset.splits or ("all",):
                yield File(f"obj_models/real_{split}/{info.key}.obj", mesh)
                yield File(f"obj_models/real_{split}/{info.key}.txt", f"{extents}\n".encode())


def _place(sample: Sample) -> tuple[str, int]:
    """The scene of a picture, and its number there."""
    if sample.sequence:
        return sample.sequence if sample.sensor == CAMERA else f"{sample.sequence}-{sample.sensor}", sample.instant
    return f"scene_{sample.index // SCENE_SIZE + 1}", sample.index % SCENE_SIZE


def _mask(sample: Sample) -> NDArray[np.uint8]:
    instances = sample.channels["instances"]
    return np.where(instances == 0, BACKGROUND, instances).astype(np.uint8)


def _coord(sample: Sample) -> NDArray[np.uint8]:
    """Positions in the objects' boxes as colours (H, W, 3)."""
    shares = sample.channels["nocs"].astype(np.float64)
    x, y, z = np.moveaxis(transform(Y_UP, shares - 0.5) + 0.5, -1, 0)
    colors = np.rint(np.clip(np.stack([x, y, 1 - z], axis=-1), 0, 1) * 255)
    return np.where(np.isfinite(colors), colors, 0).astype(np.uint8)


def _meta(sample: Sample) -> str:
    """A line for each id up to the last one known or in the mask, because loaders find an object's line by its id."""
    known = {o.id: (o.category_id, o.key) for o in sample.objects}
    most = max([*known, int(sample.channels["instances"].max(initial=0))])
    distractor = (0, next((key for _, key in known.values()), ""))
    rows = ((number, *known.get(number, distractor)) for number in range(1, most + 1))
    return "".join(f"{number} {category} {key}\n" for number, category, key in rows)


def _poses(sample: Sample) -> dict[str, Any]:
    seen = sorted((o for o in sample.objects if o.area), key=lambda o: o.id)
    poses = np.tile(np.eye(4), (len(seen), 1, 1))
    boxes = [(0.0, 0.0, 0.0, 0.0) if o.box2d is None else o.box2d for o in seen]
    sizes = np.array([o.size for o in seen]).reshape(-1, 3)
    diagonals = np.linalg.norm(sizes, axis=1)
    for pose, o, diagonal in zip(poses, seen, diagonals, strict=True):
        rotation, middle = o.camera_from_object[:3, :3], o.box3d_camera.mean(axis=0)
        pose[:3, :3], pose[:3, 3] = diagonal * product(rotation, Y_UP.T), middle
    return {
        "gt_class_ids": np.array([o.category_id for o in seen], np.int64),
        "gt_bboxes": np.array([(y0, x0, y1, x1) for x0, y0, x1, y1 in boxes], np.int64).reshape(-1, 4),
        "gt_RTs": poses,
        "gt_scales": sizes / diagonals[:, None],
        "handle_visibility": np.ones(len(seen), np.int64),
        "intrinsics": sample.camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]],
    }


class _Portable(pickle.Pickler):
    """A pickler of arrays that any NumPy reads: NumPy's own pickles name modules that version 2 moved."""

    def reducer_override(self, obj: Any) -> Any:
        """Return the call that restores an array from its values and its shape; empty arrays would lose their shape
        otherwise.
        """
        if isinstance(obj, np.ndarray):
            return np.reshape, (obj.ravel().tolist(), obj.shape)
        return NotImplemented


def _portable(value: Any) -> bytes:
    out = io.BytesIO()
    _Portable(out, protocol=2).dump(value)
    return out.getvalue()


def _mesh(dataset: Dataset, info: ModelInfo) -> bytes:
    """An OBJ file with only triangles."""
    mesh, middle = dataset.mesh(info.key), info.box3d_object.mean(axis=0)
    corners = transform(Y_UP, mesh.vertices - middle)
    points = "v %.7g %.7g %.7g\n" * len(corners) % tuple(corners.ravel().tolist())
    return (points + "f %d %d %d\n" * len(mesh.triangles) % tuple((mesh.triangles + 1).ravel().tolist())).encode()


preparer, writer, verify = functions(Nocs)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("NOCS maps", "masks", "depth", "poses", "sizes"),
    read_by=("NOCS_CVPR2019", "category-level pose estimators"),
    channels=("rgb", "depth", "instances", "nocs"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
