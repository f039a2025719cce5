"""The BOP records of a picture: its camera, its objects' poses, their visible shares and their masks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import depth_steps
from viewsphere.geometry.diameter import diameter
from viewsphere.geometry.mask import decode_rle, rle_area, rle_box, rle_runs
from viewsphere.model.sample import ObjectAnnotation, Rle, Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store import ModelInfo

MM = 1000.0
MILLIMETRES = np.diag([MM, MM, MM, 1.0])


LEAST_VISIBLE = 0.1
"""Least visible share of an object that counts in BOP's evaluations."""

NO_BOX = [-1, -1, -1, -1]


@dataclass(frozen=True, eq=False)
class Entry:
    """An object of a picture in BOP's terms: pose, visibility, both masks."""

    pose: dict[str, Any]
    info: dict[str, Any]
    mask: Rle
    mask_visib: Rle


def camera(sample: Sample, scale: float) -> dict[str, Any]:
    """The camera's record: K with pixel centres, the depth step in mm, and the camera's pose in mm."""
    own = sample.camera
    k = own.K - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    return {
        "cam_K": k.ravel().tolist(),
        "depth_scale": scale,
        "cam_R_w2c": own.R.ravel().tolist(),
        "cam_t_w2c": (own.t * MM).tolist(),
    }


def sensor(lens: Intrinsics, scale: float) -> dict[str, Any]:
    """The lens with pixel centres, as in camera.json."""
    k = {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx - 0.5, "cy": lens.cy - 0.5}
    return {**k, "width": lens.width, "height": lens.height, "depth_scale": scale}


def _depth(sample: Sample, scale: float) -> NDArray[np.uint16]:
    """Depth along z in steps of `scale` mm, (H, W); 0 for no depth or more than 65,535 steps."""
    metres = scale / MM
    steps = depth_steps(sample, metres)
    return np.where(sample.channels["depth"] < 65535.5 * metres, steps, 0).astype(np.uint16)


def depth_file(sample: Sample, scale: float) -> Coded:
    """The depth of `_depth`, as a PNG."""
    return Coded(sample.index, f"bop depth {scale!r}.png", lambda: encode_png(_depth(sample, scale)))


def entries(sample: Sample, numbers: Mapping[str, int], scale: float) -> list[Entry]:
    """Return every object with pixels in the picture, visible or hidden. Raises UserError if an imported picture lacks depth,
    or an object its whole mask.
    """
    if "depth" not in sample.channels:
        raise UserError(f"frame {sample.index}: expected channel depth; found none")
    valid = _depth(sample, scale) > 0
    listed = ((o, inside) for o in sample.objects if (inside := _inside(sample, o)))
    return [
        Entry(_pose(o, numbers), _info(o, inside, valid, sample.width, sample.height), o.amodal, o.rle) for o, inside in listed
    ]


def _inside(sample: Sample, o: ObjectAnnotation) -> int:
    """Number of an object's pixels in the picture, including hidden ones. Raises UserError if it is unknown."""
    whole: Rle | None = getattr(o, "amodal", None)
    inside = 0 if whole is None else rle_area(whole.height, whole.width, whole.counts)
    if whole is None or (inside and math.isnan(o.visibility + o.truncation)):
        raise UserError(
            f"bop: expected whole masks and visibility of all objects; found none of {o.id} in frame {sample.index}"
        )
    return inside


def _pose(o: ObjectAnnotation, numbers: Mapping[str, int]) -> dict[str, Any]:
    """An object's pose in the camera, in mm; an imported one keeps its number."""
    m = o.camera_from_object
    number = numbers[o.key] if o.key in numbers else (o.source or {})["obj_id"]
    return {"cam_R_m2c": m[:3, :3].ravel().tolist(), "cam_t_m2c": (m[:3, 3] * MM).tolist(), "obj_id": number}


def _info(o: ObjectAnnotation, inside: int, valid: NDArray[np.bool_], width: int, height: int) -> dict[str, Any]:
    """Pixels and boxes as BOP's calc_gt_info.py counts them; `inside` is the number of the object's pixels in the picture."""
    whole = round(o.area / o.visibility) if o.area else round(inside / (1 - o.truncation))
    measured = inside if valid.all() else int((decode_rle(height, width, o.amodal.counts) & valid).sum())
    return {
        "px_count_all": whole,
        "px_count_valid": measured,
        "px_count_visib": o.area,
        "visib_fract": o.visibility,
        "bbox_obj": _bop_box(_silhouette_box(o, width, height)) if o.area else NO_BOX,
        "bbox_visib": _bop_box(rle_box(height, width, o.rle.counts)) if o.area else NO_BOX,
    }


def _bop_box(corners: tuple[int, int, int, int] | None) -> list[int]:
    """x and y of the first pixel, and the distance to the last one: BOP's widths are a pixel too small."""
    assert corners is not None
    x0, y0, x1, y1 = corners
    return [x0, y0, x1 - x0 - 1, y1 - y0 - 1]


def _silhouette_box(o: ObjectAnnotation, width: int, height: int) -> tuple[int, int, int, int] | None:
    """The half-open box of the object's pixels on a canvas of three times the picture's sides."""
    seen = rle_box(height, width, o.amodal.counts)
    if not o.truncation or o.box2d_unclipped is None or seen is None:
        return seen
    x0, y0, x1, y1 = np.ceil(np.array(o.box2d_unclipped) - 0.5).astype(int).tolist()  # pixels whose centres are inside
    return (
        min(seen[0], max(x0, -width)),
        min(seen[1], max(y0, -height)),
        max(seen[2], min(x1, 2 * width)),
        max(seen[3], min(y1, 2 * height)),
    )


def mask_png(mask: Rle) -> bytes:
    """A mask as grey PNG, 255 on the object."""
    return encode_png(decode_rle(mask.height, mask.width, mask.counts) * np.uint8(255))


def runs(mask: Rle) -> dict[str, Any]:
    """A mask as COCO's run lengths, not compressed."""
    return {"counts": rle_runs(mask.height, mask.width, mask.counts).tolist(), "size": [mask.height, mask.width]}


def targets(scene: int, image: int, found: list[Entry]) -> list[dict[str, int]]:
    """Return the number of objects of each model that BOP's localisation task expects in a picture."""
    counts: dict[int, int] = {}
    for entry in found:
        if entry.info["visib_fract"] >= LEAST_VISIBLE:
            counts[entry.pose["obj_id"]] = counts.get(entry.pose["obj_id"], 0) + 1
    return [{"im_id": image, "inst_count": n, "obj_id": number, "scene_id": scene} for number, n in sorted(counts.items())]


def coco(found: list[Entry], image: int, ids: list[int]) -> list[dict[str, Any]]:
    """The visible objects in COCO's terms: run lengths of the visible pixels, boxes around all pixels in the picture."""
    return [
        {
            "id": number,
            "image_id": image,
            "category_id": entry.pose["obj_id"],
            "iscrowd": 0,
            "area": entry.info["px_count_visib"],
            "bbox": _corner_and_size(entry.mask),
            "segmentation": runs(entry.mask_visib),
            "width": entry.mask.width,
            "height": entry.mask.height,
            "ignore": entry.info["visib_fract"] < LEAST_VISIBLE,
        }
        for number, entry in zip(ids, found, strict=True)
        if entry.info["px_count_visib"]
    ]


def _corner_and_size(mask: Rle) -> list[int]:
    box = rle_box(mask.height, mask.width, mask.counts)
    assert box is not None
    x0, y0, x1, y1 = box
    return [x0, y0, x1 - x0, y1 - y0]


def ply(mesh: Mesh) -> bytes:
    """An ASCII PLY file: the vertices used by triangles, mm, with normals, and the triangles."""
    used, corners = np.unique(mesh.triangles, return_inverse=True)
    table = np.hstack([mesh.vertices[used] * np.float64(MM), mesh.normals[used]])
    head = ["ply", "format ascii 1.0", f"element vertex {len(used)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    head += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header"]
    rows = (" ".join(f"{value:.9g}" for value in row) for row in table.tolist())
    faces = (f"3 {a} {b} {c}" for a, b, c in corners.reshape(-1, 3).tolist())
    return ("\n".join([*head, *rows, *faces]) + "\n").encode("ascii")


def facts(info: ModelInfo, mesh: Mesh) -> dict[str, Any]:
    """The entry in models_info.json: box, diameter and symmetries, mm."""
    low, high = mesh.bounds * MM
    found: dict[str, Any] = {
        "diameter": MM * (diameter(mesh.corners) if info.diameter is None else info.diameter),
        **_named("min", low),
        **_named("size", high - low),
    }
    if info.symmetries is not None:
        own = info.symmetries.moved(MILLIMETRES)
        if own.discrete:
            found["symmetries_discrete"] = [np.array(motion).ravel().tolist() for motion in own.discrete]
        if own.continuous:
            found["symmetries_continuous"] = [{"axis": [*c.axis], "offset": [*c.offset]} for c in own.continuous]
    return found


def _named(name: str, values: NDArray[np.float64]) -> dict[str, float]:
    return {f"{name}_{axis}": value for axis, value in zip("xyz", values.tolist(), strict=True)}
