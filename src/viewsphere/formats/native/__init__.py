"""The layout and JSON of Ruiz et al. 2019's own tool, key for key, its faults mended; docs/formats.md lists
them.

    dataset1.json
    MODELS/<key>/<key>.obj, .glb, ...
    Pose-<index>/RGB|MASK|DEPTH/<object>-<pose>.png|.tiff

Pictures that were imported without a camera are left out: the layout is one of poses.

An object's name is its model's key; where a pose has several frames, or a frame several objects, the
frame's and the object's numbers follow it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.native.reading import read as read
from viewsphere.model.channel import picture_of
from viewsphere.model.paper_json import faces, json_bytes, transformation_matrix, vehicles
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from viewsphere.store import Dataset

_FOLDER_SIZE = 10_000


def export(dataset: Dataset, folder: Path) -> None:
    """Write the finished frames: `dataset1.json`, pictures, masks and depth by pose, models."""
    with TemporaryFile(dir=folder) as entries:
        known = (sample for sample in dataset if sample.known_camera and sample.known_pose)
        places = [place for sample in known for place in _write_frame(dataset, sample, folder, entries)]
        with (folder / "dataset1.json").open("wb") as file:
            file.write(b'{"vehicles":' + json_bytes(vehicles(dataset.models)) + b',\n"poses":{')
            _write_poses(file, entries, sorted(places))
            file.write(b"\n}}\n")
    dataset.link_models(folder / "MODELS")


Place = tuple[int, int, int, int]
"""Where an object's entry waits: pose, position of the pose's keys, position of the entry, its end."""


def _write_poses(file: IO[bytes], entries: IO[bytes], places: list[Place]) -> None:
    """Copy the entries, gathered by pose; the keys of a pose are those of its first frame."""
    last = None
    for pose, head, start, stop in places:
        entries.seek(head)
        if pose != last:
            file.write((b"}},\n" if last is not None else b"\n") + entries.read(start - head))
        else:
            file.write(b",\n")
            entries.seek(start)
        file.write(entries.read(stop - start))
        last = pose
    if last is not None:
        file.write(b"}}")


def _write_frame(dataset: Dataset, sample: Sample, folder: Path, entries: IO[bytes]) -> list[Place]:
    """Put a frame's files in their pose's folder and its JSON into `entries`."""
    pose_folder = folder / _pose_folder(dataset, sample)
    files: dict[str, str] = {}
    places: list[Place] = []
    for o in sample.objects:
        name = object_name(dataset, sample.index, o.id, o.key)
        stem = f"{_group(dataset, sample)}{name}-{sample.pose.index:04d}"
        for channel in () if files else sample.files:
            files[channel] = stem + Path(sample.files[channel]).suffix
        mask = pose_folder / "MASK" / f"{stem}.png"
        mask.parent.mkdir(parents=True, exist_ok=True)
        mask.write_bytes(encode_png(o.mask))
        head = entries.tell()
        pose = json_bytes({**_pose(dataset, sample), "vehicles_rendered": {}})
        entries.write(json_bytes(str(sample.pose.index)) + b":" + pose[:-2])
        start = entries.tell()
        entries.write(json_bytes(name) + b":" + json_bytes(_rendered(sample, o, f"{stem}.png", files)))
        places.append((sample.pose.index, head, start, entries.tell()))
    for channel, kind in ((picture_of(files), "RGB"), ("depth", "DEPTH")):
        if channel in files:
            dataset.link(sample.files[channel], pose_folder / kind / files[channel])
    return places


def _pose_folder(dataset: Dataset, sample: Sample) -> str:
    index = sample.pose.index
    group = f"Poses-{index // _FOLDER_SIZE:04d}/" if dataset.plan.poses > _FOLDER_SIZE - 2 else ""
    return f"{group}Pose-{index}"


def object_name(dataset: Dataset, frame: int, object_id: int, key: str) -> str:
    """An object's name in its pose: its model's key, with numbers where that is not unique."""
    plan = dataset.plan
    one_a_pose = dataset.max_objects == 1 and plan.frames <= len(plan.models) * plan.poses
    return key if one_a_pose else f"{key}_{frame + 1}_{object_id}"


def _group(dataset: Dataset, sample: Sample) -> str:
    """Sub-folder of a pose's folders, where they would hold too many files."""
    plan = dataset.plan
    number, count = (n * dataset.max_objects // max(plan.poses, 1) for n in (sample.index, plan.frames))
    return f"{number // _FOLDER_SIZE:04d}/" if count > _FOLDER_SIZE else ""


def _pose(dataset: Dataset, sample: Sample) -> dict[str, Any]:
    pose = sample.pose
    return {
        "distance": pose.distance,
        "elevation": pose.elevation_deg,
        "azimuth": pose.azimuth_deg,
        "tilt": pose.tilt_deg,
        "pose_category": pose.category,
        **({"frame": pose.time.frame, "seconds": pose.time.seconds} if pose.time else {}),
        "folder": _pose_folder(dataset, sample),
        "transformation_matrix": transformation_matrix(sample.camera),
    }


def _rendered(sample: Sample, o: ObjectAnnotation, mask: str, files: Mapping[str, str]) -> dict[str, Any]:
    """An object's entry; all objects of a frame share the files of its first one, but for the mask."""
    lens = sample.camera.distortion
    return {
        "path_rgb": files.get(picture_of(files) or ""),
        "path_mask": mask,
        "path_depth": files.get("depth"),
        "render_resolution": [sample.camera.width, sample.camera.height],
        "render_scale": 1.0,
        "bbox_3D_pxs": faces(o.box3d_pixels),
        "bbox_2D": o.box2d,
        "visibility": o.visibility,
        "truncation": o.truncation,
        "id_model": o.key,
        **({"id_track": o.track} if o.track else {}),
        "split": sample.split,
        "transformation_matrix": transformation_matrix(sample.camera),
        **({"distortion": lens.model_dump(mode="json")} if lens else {}),
    }
