"""COCO instances (https://cocodataset.org/#format-data) with the extra keys of Ruiz et al. 2019.

    annotations/instances_<split>.json
    <split>/<image id>.png, <split>/MASK/<image id>.png     (_<object id> if frames hold several objects)
    MODELS/<key>/<key>.obj, .glb, ...

Large data sets have numbered sub-folders. Image and annotation ids count from 1 and come from the plan:
they do not depend on what is finished. Segmentations are polygons that pycocotools rasterises to the
identical mask. Imported annotations stay as they were, but for their ids.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats.coco.reading import read as read
from viewsphere.geometry.mask import mask_polygons
from viewsphere.model.channel import missing
from viewsphere.model.paper_json import faces, json_bytes, transformation_matrix, vehicles
from viewsphere.model.sample import Box, ObjectAnnotation, Sample

if TYPE_CHECKING:
    from viewsphere.store import Category, Dataset

CHANNELS = ("rgb",)

_NAMES = {
    1: "person bicycle car motorcycle airplane bus train truck boat",
    10: "traffic_light fire_hydrant",
    13: "stop_sign parking_meter bench bird cat dog horse sheep cow elephant bear zebra giraffe",
    27: "backpack umbrella",
    31: "handbag tie suitcase frisbee skis snowboard sports_ball kite baseball_bat baseball_glove skateboard surfboard "
    "tennis_racket bottle",
    46: "wine_glass cup fork knife spoon bowl banana apple sandwich orange broccoli carrot hot_dog pizza donut cake chair "
    "couch potted_plant bed",
    67: "dining_table",
    70: "toilet",
    72: "tv laptop mouse remote keyboard cell_phone microwave oven toaster sink refrigerator",
    84: "book clock vase scissors teddy_bear hair_drier toothbrush",
}
CATEGORY_IDS: dict[str, int] = dict(
    chain.from_iterable(
        ((name.replace("_", " "), first + i) for i, name in enumerate(names.split())) for first, names in _NAMES.items()
    )
)
"""COCO's 80 categories and their ids, which have gaps (https://github.com/cocodataset/cocoapi)."""

_OTHER_SPELLINGS = {
    **{"hairdryer": "hair drier", "bike": "bicycle", "motorbike": "motorcycle", "aeroplane": "airplane"},
    **{"sofa": "couch", "tvmonitor": "tv"},
}
_FIRST_FREE_ID = 91
_FOLDER_SIZE = 10_000


def category_ids(dataset: Dataset) -> dict[int, int]:
    """COCO id of each category of the data set. With imported pictures in it, the ids they came with, and free ones for the
    others; else COCO's own for its 80 names, however spelled, and free ones above 90.
    """
    if any(part.frames and not part.settings for part in dataset.plan.parts):
        return {category.id: category.id for category in dataset.categories}
    return official_ids(dataset.categories)


def official_ids(categories: tuple[Category, ...]) -> dict[int, int]:
    """COCO's id of each category, or a free one.

    Of two categories with one name of COCO's, the first has it. Free ids follow the recipe's order.
    """
    known = {_plain(name): number for name, number in CATEGORY_IDS.items()}
    known |= {other: CATEGORY_IDS[name] for other, name in _OTHER_SPELLINGS.items()}
    ids: dict[int, int] = {}
    for category in categories:
        own = known.get(_plain(category.name))
        ids[category.id] = own if own and own not in ids.values() else _FIRST_FREE_ID - 1 + category.id
    return ids


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())


def export(dataset: Dataset, folder: Path) -> None:
    """Write the finished frames: instances JSON of each split, images, masks and models.

    Raises UserError if the data set has no picture: channel `rgb`, or else `rgba`.
    """
    if missing(CHANNELS, dataset.plan.channels):
        raise UserError(f"{dataset.root}: format coco: expected channel rgb, found none: add it to the recipe's channels")
    write_annotations(dataset, folder, pictures=True)
    dataset.link_models(folder / "MODELS")


def image_file(dataset: Dataset, sample: Sample) -> str:
    """Name of a frame's image in its split's folder."""
    return f"{_stem(dataset, sample)}{Path(sample.picture_file or '.png').suffix}"


def mask_file(dataset: Dataset, sample: Sample, annotation: ObjectAnnotation) -> str:
    """Name of an object's mask in its split's folder."""
    several = f"_{annotation.id:03d}" if dataset.plan.most_objects(sample.index) > 1 else ""
    return f"MASK/{_stem(dataset, sample)}{several}.png"


def _stem(dataset: Dataset, sample: Sample) -> str:
    number = dataset.plan.folder_of(sample.index, _FOLDER_SIZE)
    inside = "" if number is None else f"{number:04d}/"
    return f"{inside}{sample.index + 1:012d}"


def write_annotations(dataset: Dataset, folder: Path, *, pictures: bool = False) -> None:
    """Write `annotations/instances_<split>.json` of every split, frame by frame, and if asked the images and masks."""
    (folder / "annotations").mkdir(parents=True, exist_ok=True)
    ids = category_ids(dataset)
    head = _head(dataset, ids)
    with ExitStack() as stack:
        files = {
            split: stack.enter_context(_Instances(folder / "annotations" / f"instances_{split}.json", head))
            for split in dataset.splits
        }
        for sample in dataset:
            masks = {o.id: o.mask for o in sample.objects if o.area}
            annotations = [
                _foreign_annotation(dataset, sample, o, ids)
                if o.source is not None
                else _annotation(dataset, sample, o, ids, masks[o.id])
                for o in sample.objects
                if o.area or (o.source is not None and o.box2d is not None)
            ]
            files[sample.split].add(_image(dataset, sample), annotations)
            if pictures and sample.picture_file is not None:
                dataset.link(sample.picture_file, folder / sample.split / image_file(dataset, sample))
                for o in sample.objects:
                    if o.source is None and o.area:
                        _write_mask(folder / sample.split / mask_file(dataset, sample, o), masks[o.id])


def _write_mask(file: Path, mask: NDArray[np.bool_]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(encode_png(mask))


class _Instances:
    """An instances file that is written frame by frame: annotations wait in a file of their own until
    images are complete.
    """

    def __init__(self, file: Path, head: dict[str, Any]) -> None:
        self._images = file.open("w+b")
        self._annotations = file.with_suffix(".part").open("w+b")
        self._part = file.with_suffix(".part")
        self._images.write(json_bytes(head)[:-1] + b',"images":[')
        self._separators = [b"\n", b"\n"]

    def __enter__(self) -> _Instances:
        return self

    def add(self, image: dict[str, Any], annotations: list[dict[str, Any]]) -> None:
        """Append a frame."""
        for i, (file, values) in enumerate(((self._images, [image]), (self._annotations, annotations))):
            for value in values:
                file.write(self._separators[i] + json_bytes(value))
                self._separators[i] = b",\n"

    def __exit__(self, *failure: object) -> None:
        if failure[0] is None:
            self._images.write(b'\n],"annotations":[')
            self._annotations.seek(0)
            shutil.copyfileobj(self._annotations, self._images)
            self._images.write(b"\n]}\n")
        self._images.close()
        self._annotations.close()
        self._part.unlink()


def _head(dataset: Dataset, ids: Mapping[int, int]) -> dict[str, Any]:
    return {
        "info": {"description": dataset.name, "version": "1.0", "contributor": f"viewsphere {dataset.plan.version}"},
        "licenses": [],
        "categories": [{"id": ids[c.id], "name": c.name, "supercategory": c.supercategory} for c in dataset.categories],
        "models": vehicles(dataset.models),
    }


def _image(dataset: Dataset, sample: Sample) -> dict[str, Any]:
    if sample.known_camera is None:
        source = dict(sample.source or {})
        named = {"imported_file_name": source["file_name"]} if "file_name" in source else {}
        size = {"width": sample.width, "height": sample.height}
        return {**source, **named, "id": sample.index + 1, "file_name": image_file(dataset, sample), **size}
    camera, pose = sample.camera, sample.pose
    keys = [o.key for o in sample.objects]
    lens = camera.distortion
    return {
        "id": sample.index + 1,
        "file_name": image_file(dataset, sample),
        "width": camera.width,
        "height": camera.height,
        "id_model": keys[0] if len(keys) == 1 else keys,
        "id_pose": pose.index,
        "pose_category": pose.category,
        **({"frame": pose.time.frame, "seconds": pose.time.seconds} if pose.time else {}),
        "render_resolution": [camera.width, camera.height],
        "render_scale": 1.0,
        "distance": pose.distance,
        "elevation": pose.elevation_deg,
        "azimuth": pose.azimuth_deg,
        "tilt": pose.tilt_deg,
        "transformation_matrix": {**transformation_matrix(camera), "P": camera.P.tolist()},
        "distortion": None if lens is None else lens.model_dump(mode="json"),
    }


def _foreign_annotation(dataset: Dataset, sample: Sample, o: ObjectAnnotation, ids: Mapping[int, int]) -> dict[str, Any]:
    """An imported object's annotation as it was, but for its ids, and without the file of a mask that did not come with it."""
    source = {k: v for k, v in (o.source or {}).items() if k != "path_mask"}
    own = {
        "id": dataset.plan.annotation_id(sample.index, o.id),
        "image_id": sample.index + 1,
        "category_id": ids[o.category_id],
    }
    return {"iscrowd": 0, "area": o.area, **source, **own}


def _annotation(
    dataset: Dataset, sample: Sample, o: ObjectAnnotation, ids: Mapping[int, int], mask: NDArray[np.bool_]
) -> dict[str, Any]:
    return {
        "id": dataset.plan.annotation_id(sample.index, o.id),
        "image_id": sample.index + 1,
        "category_id": ids[o.category_id],
        "iscrowd": 0,
        "area": o.area,
        "bbox": _corner_and_size(o.box2d),
        "segmentation": [[int(c) for c in polygon] for polygon in mask_polygons(mask)],
        "width": sample.camera.width,
        "height": sample.camera.height,
        "path_mask": mask_file(dataset, sample, o),
        "bbox_3D_pxs": faces(o.box3d_pixels),
        "bbox_projected": _corner_and_size(o.box2d_projected),
        "bbox_unclipped": _corner_and_size(o.box2d_unclipped),
        "visibility": o.visibility,
        "truncation": o.truncation,
        "id_object": o.id,
        "id_model": o.key,
        **({"id_track": o.track} if o.track else {}),
        "world_from_object": o.world_from_object.tolist(),
        "camera_from_object": o.camera_from_object.tolist(),
        "quaternion": o.quaternion,
        "view": o.view.__dict__,
        "pose_category": o.pose_category,
        "size": o.size,
        "real_size": o.real_size,
    }


def _corner_and_size(box: Box | None) -> list[float] | None:
    """COCO's [x, y, width, height] of (x0, y0, x1, y1)."""
    return None if box is None else [box[0], box[1], box[2] - box[0], box[3] - box[1]]
