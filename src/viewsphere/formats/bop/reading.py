"""Reads BOP's data sets of scenes: pictures with their poses, depth and masks."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError
from viewsphere.files import read_bytes
from viewsphere.formats.bop.entries import MM, NO_BOX
from viewsphere.formats.bop.source_models import foreign_models, load, model_files
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.placed_objects import placed
from viewsphere.geometry.box import clip_to_image
from viewsphere.geometry.mask import encode_rle, rle_area, rle_box
from viewsphere.geometry.rotation import compose, quaternion_from_matrix, rigid
from viewsphere.model.sample import Rle, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, Loaded, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside, is_name

PICTURES = ("rgb/{:06d}.png", "rgb/{:06d}.jpg", "gray/{:06d}.png", "gray/{:06d}.tif")
MOST_DIGITS = 9
"""Digits of an image's number."""

MOST_OBJECTS = 10**6
"""Limit of object numbers, which have six digits."""

UNKNOWN = np.full((8, 3), np.nan)
"""The box of an object without a model."""


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every picture of the scenes in `<split>/<scene>/`, with the lenses, poses, depth, masks and boxes that exist.

    A picture without its camera's pose counts as taken from the world's origin. Categories are the objects, named as in
    dataset_info.json of viewsphere's own exports, else `obj_<number>`. Raises StoreError with every picture that lacks its
    file, its lens or the pose of an object, and every model that cannot be read. With `keep_going` these are left out and
    reported.
    """
    problems: list[str] = []
    files = sorted(path.glob("*/*/scene_camera.json"))
    if not files:
        raise StoreError(f"{path}: expected a BOP data set (<split>/<scene>/scene_camera.json); found no such file")
    frames = tuple(frame for file in files for frame in scene_frames(path, file.parent, problems))
    cads = model_files(path)
    named = categories(path, sorted({*cads, *(gt["obj_id"] for frame in frames for gt in frame.gt)}))
    models = foreign_models(path, cads, named, problems)
    if not keep_going:
        refuse_broken(problems)
    if not frames:
        raise StoreError(f"{path}: expected images that can be used; found none")
    return ForeignDataset(
        name=path.resolve().name,
        digest=_digest(files, problems),
        categories=tuple({category.id: category for category, _ in named.values()}.values()),
        splits=tuple(dict.fromkeys(frame.split for frame in frames)),
        channels=("rgb", "depth") if all(frame.depth for frame in frames) else ("rgb",),
        count=len(frames),
        poses=0,
        max_objects=max(1, *(len(frame.gt) for frame in frames)),
        frames=partial(_samples, frames, named, {number: model.info.box3d_object for number, model in models.items()}),
        models=tuple(models.values()),
        left_out=tuple(problems),
    )


@dataclass(frozen=True)
class Frame:
    """A picture, the records of its objects, and the start of its masks' paths: `<scene>/<kind>/<image>_`."""

    split: str
    scene: Path
    image: int
    rgb: Path
    depth: Path | None
    step: float  # metres
    camera: Camera
    gt: tuple[dict[str, Any], ...]
    info: tuple[dict[str, Any], ...]

    def mask(self, kind: str, n: int) -> str | None:
        """Run lengths of a mask; None if there is no such file."""
        file = file_inside(self.scene, f"{kind}/{self.image:06d}_{n:06d}.png")
        if not file.is_file():
            return None
        try:
            with opened(file) as image:
                mask = np.asarray(image.convert("L")) > 127
        except MISTAKES as error:
            raise StoreError(f"{file}: expected a mask; found: {one_line(error)}") from None
        self.check(file, mask)
        return encode_rle(mask)

    def check(self, file: Path, found: NDArray[Any]) -> None:
        """Raise StoreError for a file whose size differs from the picture's."""
        width, height = self.camera.width, self.camera.height
        if found.shape != (height, width):
            raise StoreError(f"{file}: expected {width} x {height} pixels; found {' x '.join(map(str, found.shape[::-1]))}")


def _digest(files: list[Path], left_out: list[str]) -> str:
    """SHA-256 of all scenes' JSON, and of the messages about pictures that were left out."""
    digest = hashlib.sha256()
    for file in (file for camera in files for file in sorted(camera.parent.glob("scene_*.json"))):
        digest.update(
            f"{file.parent.name}/{file.name}\0{hashlib.sha256(read_bytes(file, 'MAX_RECORD_BYTES')).hexdigest()}".encode()
        )
    digest.update("\n".join(left_out).encode(errors="backslashreplace"))
    return digest.hexdigest()


def scene_frames(root: Path, scene: Path, problems: list[str]) -> Iterator[Frame]:
    """The pictures of a scene."""
    file_inside(root, scene.relative_to(root).as_posix())
    cameras, gts, infos = (load(file_inside(scene, f"scene_{name}.json")) for name in ("camera", "gt", "gt_info"))
    for number in sorted(cameras, key=lambda text: (len(text), text)):
        try:
            if not number.isdecimal() or len(number) > MOST_DIGITS:
                raise ValueError("found no number of an image")
            yield _frame(scene, int(number), cameras[number], gts.get(number, []), infos.get(number, []))
        except MISTAKES as error:
            problems.append(f"{scene}: image {number:.20}: expected a lens, poses and a picture; {one_line(error)}")


def _frame(scene: Path, image: int, said: dict[str, Any], gt: list[Any], info: list[Any]) -> Frame:
    named = (file_inside(scene, name.format(image)) for name in PICTURES)
    rgb = next((file for file in named if file.is_file()), None)
    if rgb is None:
        raise FileNotFoundError("found no picture")
    if not is_name(scene.parent.name):
        raise ValueError(f"found a split {scene.parent.name!r}")
    with opened(rgb) as picture:
        width, height = picture.size
    (fx, skew, cx), (_, fy, cy), _ = _matrix(said["cam_K"], 3).tolist()
    lens = {"fx": fx, "fy": fy, "cx": cx + 0.5, "cy": cy + 0.5, "skew": skew}
    pose = _pose(said, "w2c") if "cam_R_w2c" in said else np.eye(4)
    depth, step = file_inside(scene, f"depth/{image:06d}.png"), float(said.get("depth_scale", 1.0)) / MM
    if not 0 < step < math.inf:
        raise ValueError(f"found depth_scale {said['depth_scale']!r:.40}")
    for one in gt:
        _pose(one, "m2c")
        if type(one["obj_id"]) is not int or not 0 <= one["obj_id"] < MOST_OBJECTS:
            raise ValueError(f"found obj_id {one['obj_id']!r:.40}")
    return Frame(
        split=scene.parent.name,
        scene=scene,
        image=image,
        rgb=rgb,
        depth=depth if depth.is_file() else None,
        step=step,
        camera=Camera(Intrinsics(width=width, height=height, **lens, rolling=None), pose[:3, :3], pose[:3, 3]),
        gt=tuple(gt),
        info=tuple(_checked(one) for one in info),
    )


def _checked(said: Mapping[str, Any]) -> dict[str, Any]:
    """Return the checked counts, share and boxes of an object's visibility; raises ValueError for impossible numbers."""
    boxes = {name: [*map(int, said[name])] for name in ("bbox_obj", "bbox_visib")}
    whole, share = int(said["px_count_all"]), float(said["visib_fract"])
    if whole < 0 or not 0 <= share <= 1 or any(len(box) != 4 for box in boxes.values()):
        raise ValueError(f"found {said!r:.80} where counts, a share and boxes are expected")
    return {"px_count_all": whole, "visib_fract": share, **boxes}


def _matrix(values: Any, rows: int) -> NDArray[np.float64]:
    found = np.array(values, np.float64).reshape(rows, -1)
    if found.size != 3 * rows or not np.isfinite(found).all():
        raise ValueError(f"found {values!r:.60} where {3 * rows} numbers are expected")
    return found


def object_pose(gt: Mapping[str, Any]) -> NDArray[np.float64]:
    """An object's pose in the camera, (4, 4), metres."""
    return _pose(gt, "m2c")


def _pose(said: Mapping[str, Any], which: str) -> NDArray[np.float64]:
    """The pose under these names, (4, 4), metres. Raises ValueError if its rotation is missing or invalid."""
    turn, shift = _matrix(said[f"cam_R_{which}"], 3), _matrix(said[f"cam_t_{which}"], 1)[0]
    try:
        quaternion_from_matrix(turn)
    except ValueError:
        raise ValueError(f"found cam_R_{which} {said[f'cam_R_{which}']!r:.60} where a rotation is expected") from None
    return rigid(turn, shift / MM)


def categories(path: Path, objects: list[int]) -> dict[int, tuple[Category, str]]:
    """The category of each object, and its name."""
    known = load(path / "dataset_info.json").get("objects")
    found: dict[str, Category] = {}
    named, keys = dict[int, tuple[Category, str]](), set[str]()
    for number in objects:
        said: Any = known.get(str(number)) if isinstance(known, dict) else None
        facts = cast(dict[str, Any], said if isinstance(said, dict) else {})
        key = str(facts.get("key", ""))
        key = key if is_name(key) and key not in keys else f"obj_{number:06d}"
        keys.add(key)
        name = str(facts.get("category") or key)
        category = found.setdefault(name, Category(len(found) + 1, name, str(facts.get("supercategory") or "")))
        named[number] = category, key
    return named


def _samples(
    frames: tuple[Frame, ...], named: Mapping[int, tuple[Category, str]], boxes: Mapping[int, NDArray[np.float64]]
) -> Iterator[ForeignFrame]:
    for index, frame in enumerate(frames):
        files: dict[str, Path | Loaded] = {"rgb": frame.rgb}
        if frame.depth:
            files["depth"] = Loaded(".png", _depth(frame.depth, frame))
        objects = tuple(_object(frame, n, *named[gt["obj_id"]], boxes.get(gt["obj_id"])) for n, gt in enumerate(frame.gt))
        said = {"scene_id": frame.scene.name, "im_id": frame.image}
        whole = all("amodal" in o.extra for o in objects)
        sample = Sample(index, frame.split, frame.camera, None, objects, {}, {}, source=said, instant=index)
        yield ForeignFrame(replace(sample, requested=("amodal",) if whole else ()), files)


def _depth(file: Path, frame: Frame) -> bytes:
    """A depth map in the same steps, with their length, as the store keeps it."""
    try:
        with opened(file) as image:
            steps = np.asarray(image if image.mode.startswith("I;16") else image.convert("I")).astype(np.uint16)
    except MISTAKES as error:
        raise StoreError(f"{file}: expected depth of 16 bits; found: {error}") from None
    frame.check(file, steps)
    return encode_png(steps, unit=frame.step)


def _object(frame: Frame, n: int, category: Category, key: str, box: NDArray[np.float64] | None) -> Any:
    """The n-th object of a picture, whose model has this box (8, 3); its `source` holds obj_id."""
    size = width, height = frame.camera.width, frame.camera.height
    seen, whole = frame.mask("mask_visib", n), frame.mask("mask", n)
    info = frame.info[n] if n < len(frame.info) else None
    pose = object_pose(frame.gt[n])
    world = compose(rigid(frame.camera.R.T, frame.camera.center), pose)
    standing = placed(UNKNOWN if box is None else box, world, rigid(frame.camera.R, frame.camera.t), frame.camera.intrinsics)
    known = {name: value for name, value in standing.items() if name not in ("view", "pose_category")}
    known |= {"key": key, "camera_from_object": pose, "quaternion": quaternion_from_matrix(pose[:3, :3])}
    if whole is not None:
        tight = rle_box(height, width, whole)
        known["extra"] = {"amodal": Rle(height, width, whole), "box2d_amodal": tight and tuple(map(float, tight))}
    if info is not None:
        known["visibility"] = float(info["visib_fract"])
        everything, outer = int(info["px_count_all"]), _corners(info["bbox_obj"])
        inside = rle_area(height, width, whole) if whole is not None else math.nan
        known["truncation"] = max(0.0, (everything - inside) / everything) if everything else math.nan
        known |= {"box2d_unclipped": outer, "box2d_projected": outer and clip_to_image(outer, width, height)}
    visible = None if info is None else _corners(info["bbox_visib"])
    return foreign_object(n + 1, category, size, {"obj_id": frame.gt[n]["obj_id"]}, seen, visible, **known)


def _corners(box: list[int]) -> tuple[float, float, float, float] | None:
    """Half-open corners of one of BOP's boxes, whose widths are a pixel too small; None for the box of an invisible object."""
    x, y, w, h = box
    return None if box == NO_BOX else (float(x), float(y), float(x + w + 1), float(y + h + 1))
