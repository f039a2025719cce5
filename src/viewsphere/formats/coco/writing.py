"""Writes pictures, masks and the instances JSON of each split."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.formats.coco.categories import (
    CHANNELS,
    Names,
    Options,
    category_ids,
    category_points,
    has_label,
    keeps_ids,
    notes,
    object_points,
    point_names,
)
from viewsphere.formats.coco.source_metadata import Licences, imported_categories, imported_info, imported_info_of_parts
from viewsphere.formats.shared.writing.export_files import Expected, put
from viewsphere.formats.shared.writing.paper import faces, json_bytes, transformation_matrix, vehicles
from viewsphere.geometry.mask import mask_polygons
from viewsphere.model.channel import missing
from viewsphere.model.sample import Box, ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.store.credits import credited
from viewsphere.store.samples.seam_pieces import PIECE

if TYPE_CHECKING:
    from viewsphere.store import Dataset

FOLDER_SIZE = 10_000
SECOND = 1 << 40
"""Offset of the annotation ids of second parts: above the ids of all plans, and exact in JSON."""

CAPTIONS = "captions"
"""The label whose sentences are exported if a data set has it."""

Masks = Mapping[int, NDArray[np.bool_]]
"""Masks (H, W) of the visible pixels of a sample's visible objects, except imported ones, by the objects' ids."""


def preparer(dataset: Dataset, folder: Path, options: Options) -> Callable[[Sample], Entry]:
    """Puts a sample's images and masks in place, and makes its entries of the instances JSON."""
    entries = Entries(dataset, options)

    def prepare(sample: Sample) -> Entry:
        masks = seen(sample)
        for _, name, content in files(dataset, sample, masks, options):
            put(dataset, content, folder / name)
        return entries.entry(sample, masks)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None], options: Options) -> Generator[Callable[[Entry], None]]:
    """Write the instances JSON of each split, and models.

    Raises UserError if the data set has no picture: channel `rgb`, or else `rgba`.
    """
    if missing(CHANNELS, dataset.plan.channels):
        raise UserError(f"{dataset.root}: format coco: expected channel rgb, found none: add it to the recipe's channels")
    for line in () if keeps_ids(dataset) else notes(dataset.categories, options):
        note(f"note: {line}")
    with instances(dataset, folder / "annotations", options) as append:
        yield append
    dataset.link_models(folder / "MODELS")


def file_name(split: str, kind: str = "instances") -> str:
    """File name of a split's instances, or of its captions."""
    return f"{kind}_{split}.json"


def file_names(dataset: Dataset) -> list[str]:
    """The names of all files, with captions if some of the data set's pictures have them."""
    return [file_name(split, kind) for split in dataset.splits for kind in ("instances", *_caption_files(dataset))]


def _caption_files(dataset: Dataset) -> tuple[str, ...]:
    """The kinds of caption files; none if no picture has captions."""
    return (CAPTIONS,) if has_label(dataset, CAPTIONS) else ()


@contextmanager
def instances(dataset: Dataset, folder: Path, options: Options) -> Generator[Callable[[Entry], None]]:
    """Write the files of all splits into this folder. Yields a function that appends a frame to its split's file."""
    folder.mkdir(exist_ok=True)
    ids = category_ids(dataset, options)
    head = _head(dataset, ids)
    kinds = {"instances": head, **{kind: {key: head[key] for key in ("info", "licenses")} for kind in _caption_files(dataset)}}
    with ExitStack() as stack:
        files: dict[tuple[str, str], Callable[[bytes, Iterable[bytes]], None]] = {}
        for split in dataset.splits:
            info = imported_info(dataset, split) or head["info"]
            for kind, own in kinds.items():
                start = json_bytes({**own, "info": info})[:-1]
                files[split, kind] = stack.enter_context(_written(folder / file_name(split, kind), start))

        def add(entry: Entry) -> None:
            files[entry.split, "instances"](entry.image, entry.annotations)
            if (entry.split, CAPTIONS) in files:
                files[entry.split, CAPTIONS](entry.image, entry.captions)

        yield add


@contextmanager
def _written(file: Path, head: bytes) -> Generator[Callable[[bytes, Iterable[bytes]], None]]:
    """Write one file: annotations wait in a temporary file until the images, which come first, are complete."""
    with file.open("wb") as images, TemporaryFile(dir=file.parent) as waiting:
        images.write(head + b',"images":[')
        separators = {images: b"\n", waiting: b"\n"}

        def append(image: bytes, annotations: Iterable[bytes]) -> None:
            for part, values in ((images, [image]), (waiting, annotations)):
                for value in values:
                    part.write(separators[part] + value)
                    separators[part] = b",\n"

        yield append
        images.write(b'\n],"annotations":[')
        waiting.seek(0)
        shutil.copyfileobj(waiting, images)
        images.write(b"\n]}\n")


def _head(dataset: Dataset, ids: Mapping[int, int]) -> dict[str, Any]:
    info = {"description": dataset.name, "version": "1.0", "contributor": f"viewsphere {dataset.plan.version}"}
    licenses, credits = _terms(dataset)
    names, sources, imported = point_names(dataset), imported_info_of_parts(dataset), imported_categories(dataset)
    return {
        "info": {**info, **({"sources": sources} if sources else {}), **({"credits": credits} if credits else {})},
        "licenses": licenses,
        "categories": [
            {
                **{"id": ids[c.id], "name": c.name, "supercategory": c.supercategory},
                **category_points(dataset, c, names, imported.get(c.name.casefold(), {})),
            }
            for c in dataset.categories
        ],
        "models": vehicles(dataset.models),
    }


def _terms(dataset: Dataset) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The list of licences, imported ones first, and the credits of the models, each with its licence's id."""
    groups = {credit: keys for credit, keys in credited(dataset.models).items() if credit}
    licences, credits = Licences(dataset), list[dict[str, Any]]()
    for credit, keys in groups.items():
        name = credit.licence
        number = {"license": licences.add({"name": name, "url": name if name.startswith("http") else ""})} if name else {}
        credits.append({"models": keys, **credit.model_dump(exclude_none=True), **number})
    return licences.listed, credits


@dataclass(frozen=True)
class Entry:
    """The records of a sample in the files of a split: its image, its annotations, and its captions, JSON."""

    split: str
    image: bytes
    annotations: tuple[bytes, ...]
    captions: tuple[bytes, ...] = ()


class Entries:
    """The maker of samples' entries."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        self._dataset, self._options = dataset, options
        self._ids, self._names = category_ids(dataset, options), point_names(dataset)
        self._licences = Licences(dataset)

    def entry(self, sample: Sample, masks: Masks) -> Entry:
        """A sample's entry."""
        annotations = tuple(json_bytes(one) for one in self._annotations(sample, masks))
        captions = tuple(map(json_bytes, _caption_records(sample)))
        image = self._licences.numbered(_image(self._dataset, sample))
        return Entry(sample.split, json_bytes(image), annotations, captions)

    def _annotations(self, sample: Sample, masks: Masks) -> Iterator[dict[str, Any]]:
        """COCO's annotations of all visible objects, and of imported objects with a box."""
        for o in sample.objects:
            own = {
                "id": annotation_id(self._dataset, sample, o),
                "image_id": sample.index + 1,
                "category_id": self._ids[o.category_id],
            }
            if o.source is not None and (o.area or o.box2d is not None):
                yield _foreign_annotation(o, own, self._names)
            elif o.source is None and o.area:
                outline = _outline(o, o.mask if PIECE in o.extra else masks[o.id], self._options)
                mask_file = _mask_file(self._dataset, sample, o.id)
                yield own | _annotation(sample, o, outline, mask_file) | object_points(o, self._names)


def _caption_records(sample: Sample) -> Iterator[dict[str, Any]]:
    """COCO's captions of a picture, if it has any."""
    if CAPTIONS not in sample.requested:
        return
    from viewsphere.labels.captions import MOST  # which loads the code that describes scenes

    for number, caption in enumerate(sample.captions, 1):
        yield {"id": sample.index * MOST + number, "image_id": sample.index + 1, "caption": caption.text}


def seen(sample: Sample) -> Masks:
    """Every object's mask, decoded once, whole also across a seam; imported ones stay as they are."""
    masks = dict[int, NDArray[np.bool_]]()
    for o in sample.objects:
        if o.area and o.source is None:
            masks[o.id] = masks[o.id] | o.mask if o.id in masks else o.mask
    return masks


def annotation_id(dataset: Dataset, sample: Sample, o: ObjectAnnotation) -> int:
    """The number of an object's annotation; the second part of an object across a seam has one beyond all others."""
    return dataset.plan.annotation_id(sample.index, o.id) + (SECOND if o.extra.get(PIECE) == 2 else 0)


def files(dataset: Dataset, sample: Sample, masks: Masks, options: Options) -> Iterator[Expected]:
    """The files of a sample: picture and masks, with their paths from the export's folder; none without a picture."""
    if sample.picture_file is None:
        return
    folder = options.folder(sample.split)
    yield sample.index, f"{folder}/{_image_file(dataset, sample)}", sample.picture_file
    for number, mask in masks.items():
        yield sample.index, f"{folder}/{_mask_file(dataset, sample, number)}", mask


def _outline(o: ObjectAnnotation, mask: NDArray[np.bool_], options: Options) -> Any:
    """COCO's segmentation of a mask."""
    if options.segmentation == "rle":
        return {"size": [o.rle.height, o.rle.width], "counts": o.rle.counts}
    return [[int(c) for c in polygon] for polygon in mask_polygons(mask)]


def _image_file(dataset: Dataset, sample: Sample) -> str:
    """Name of a frame's image in its split's folder."""
    return f"{_stem(dataset, sample)}{PurePosixPath(sample.picture_file or '.png').suffix}"


def _mask_file(dataset: Dataset, sample: Sample, number: int) -> str:
    """Name of the mask of an object, by its id, in its split's folder."""
    several = f"_{number:03d}" if dataset.plan.most_objects(sample.index) > 1 else ""
    return f"MASK/{_stem(dataset, sample)}{several}.png"


def _stem(dataset: Dataset, sample: Sample) -> str:
    number = dataset.plan.folder_of(sample.index, FOLDER_SIZE)
    inside = "" if number is None else f"{number:04d}/"
    return f"{inside}{sample.index + 1:012d}"


def _image(dataset: Dataset, sample: Sample) -> dict[str, Any]:
    """COCO's image entry of a sample, with the paper's keys; an imported sample keeps its entry with a new id and file name."""
    if sample.known_camera is None or sample.known_pose is None:
        source = dict(sample.source or {})
        named = {"imported_file_name": source["file_name"]} if "file_name" in source else {}
        size = {"width": sample.width, "height": sample.height}
        return {**source, **named, "id": sample.index + 1, "file_name": _image_file(dataset, sample), **size}
    camera, pose = sample.camera, sample.pose
    keys = [o.key for o in sample.objects]
    return {
        "id": sample.index + 1,
        "file_name": _image_file(dataset, sample),
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
        "transformation_matrix": transformation_matrix(camera) | _projection(camera),
        "distortion": camera.lens.record,
        **camera.shutter_record,
    }


def _projection(camera: Camera) -> dict[str, list[list[float]]]:
    """P (3, 4), world to pixels without the lens' distortion; none for panoramas, whose K maps angles."""
    return {"P": camera.P.tolist()} if camera.lens.has_depth else {}


def _foreign_annotation(o: ObjectAnnotation, own: Mapping[str, int], names: Names) -> dict[str, Any]:
    """An imported object's annotation with this export's ids, without its mask file, which is not in the store. Its points
    follow the category's order if the category's points have changed since the import.
    """
    source = {k: v for k, v in (o.source or {}).items() if k != "path_mask"}
    told = o.extra.get("keypoint_names")
    points = object_points(o, names) if told and tuple(told) != names.get(o.category_id) else {}
    return {"iscrowd": 0, "area": o.area, **source, **points, **own}


def _annotation(sample: Sample, o: ObjectAnnotation, outline: Any, mask_file: str) -> dict[str, Any]:
    """The fields of a rendered object's annotation, except its ids."""
    return {
        "iscrowd": 0,
        "area": o.area,
        "bbox": _corner_and_size(o.box2d),
        "segmentation": outline,
        "width": sample.camera.width,
        "height": sample.camera.height,
        "path_mask": mask_file,
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
    """COCO's [x, y, width, height] of a box (x0, y0, x1, y1)."""
    return None if box is None else [box[0], box[1], box[2] - box[0], box[3] - box[1]]
