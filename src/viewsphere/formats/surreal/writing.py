"""Writes SURREAL's tree."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.deflate import compressed
from viewsphere.codecs.mat import COMPRESSED, HEAD
from viewsphere.codecs.mp4 import Encoder, encoder, write_mp4
from viewsphere.errors import UserError
from viewsphere.files import read_bytes
from viewsphere.formats.shared.viewpoint_mat import mat
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import opaque
from viewsphere.formats.shared.writing.sequences import check_whole, scene
from viewsphere.formats.shared.writing.timeline import Timeline
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree
from viewsphere.formats.surreal.body import MOST_TOLD, UNKNOWN, joints, part_numbers
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

Float = NDArray[np.float64]

MOST = 100
"""Greatest number of pictures in a clip."""

NOTHING = 1e10
"""Blender's depth of infinitely distant points."""

RATE = 30.0
"""Frame rate of a clip with only one picture."""

CAMERA_FROM_WORLD = np.array([[0.0, 0, -1], [0, 1, 0], [-1, 0, 0]])
"""SURREAL's rotation, (3, 3): a mirror image, and its own inverse."""

CLIPS, SEQUENCES = 4, 2
"""Number of clips and sequences to keep for the following samples."""


@dataclass(frozen=True, eq=False)
class _Clip:
    """Some instants of a sequence: the clip's path without an ending, its number from 1, and the pictures. Also, for each
    picture, the indices of the 24 joints among the person's points, and the camera's position in the clip's world, (3,)
    float32.
    """

    path: str
    number: int
    samples: tuple[Sample, ...]
    joints: tuple[NDArray[np.intp], ...]
    place: NDArray[np.float32]

    @property
    def joints3d(self) -> NDArray[np.float32]:
        """The joints in the clip's world, (3, 24, T), metres."""
        own = [_person(sample).keypoints3d_camera[places].T for sample, places in zip(self.samples, self.joints, strict=True)]
        world = np.einsum("ij,jkt->ikt", CAMERA_FROM_WORLD, np.stack(own, axis=-1))
        return (world + self.place[:, None, None]).astype(np.float32)


class Surreal(Tree):
    """A folder for each sequence."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        check_whole(dataset, "surreal")
        self._timeline = Timeline(dataset)
        self._models = {one.key: one for info in dataset.models for one in (info, *info.steps)}
        self._sequence = lru_cache(maxsize=SEQUENCES)(dataset.sequence)
        self._clip = lru_cache(maxsize=CLIPS)(self._made)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """The maps of a picture, numbered in its clip."""
        clip, k = self._clip_of(sample), sample.instant % MOST + 1
        depth, flow = sample.channels["depth"], sample.channels["flow_backward"]
        maps = {
            "depth": np.where(np.isinf(depth), NOTHING, depth),
            "segm": self._parts(sample),
            "gtflow": np.where(np.isnan(flow), 0, -flow),
            "normal": sample.channels["normals"] @ CAMERA_FROM_WORLD,
        }
        for name, array in maps.items():
            kind = np.uint8 if name == "segm" else np.float32
            yield Piece(f"{clip.path}_{name}.mat", _variable(f"{name}_{k}", array.astype(kind)))

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """A MATLAB file's header, and its variables."""
        return (mat()[:HEAD], "")

    def rest(self) -> Iterator[File]:
        """Yield the files of whole clips."""
        last = ""
        for key, places in self.dataset.shots():
            first = self.dataset.sample_at(key, places[0])
            if first.sequence != last:
                last = first.sequence
                for start in (one for one in self._sequence(last, first.sensor) if one.instant % MOST == 0):
                    clip = self._clip_of(start)
                    yield File(f"{clip.path}_info.mat", mat(**self._info(clip)))
                    yield File(f"{clip.path}.mp4", Coded(start.index, f"{clip.path}.mp4", partial(_film, clip)))

    def _clip_of(self, sample: Sample) -> _Clip:
        return self._clip(scene(sample), sample.sensor, sample.instant // MOST)

    def _made(self, sequence: str, sensor: str, number: int) -> _Clip:
        """A clip. Raises UserError for a clip that SURREAL cannot hold."""
        samples = tuple(one for one in self._sequence(sequence, sensor) if one.instant // MOST == number)
        first = samples[0]
        for place, sample in enumerate(samples):
            if found := self._strange(sample, first, place):
                raise UserError(f"surreal: frame {sample.index}: expected {found}")
        own = [self._joints(sample) for sample in samples]
        distance = float(_person(first).keypoints3d_camera[own[0][0], 2])
        place = np.array([distance, -first.camera.center[2], 0.0], np.float32)
        path = f"{first.split or 'all'}/run0/{sequence}/{sequence}_c{number + 1:04d}"
        return _Clip(path, number + 1, samples, tuple(own), place)

    def _strange(self, sample: Sample, first: Sample, place: int) -> str:
        """Return the reason why SURREAL cannot hold a sample; empty if it can."""
        now, then, start = sample.camera, first.camera, first.instant - first.instant % MOST
        if sample.instant != start + place:
            return f"all instants of a clip from {start} on; found {sample.instant} in place of {start + place}"
        if self._timeline.course(sample).each != 1:
            return "one sensor; found several"
        if len(sample.objects) != 1:
            return f"one person; found {len(sample.objects)} objects"
        if not now.lens.is_linear:
            return "a pinhole camera; found a lens that distorts"
        if now.intrinsics != then.intrinsics or not (np.array_equal(now.R, then.R) and np.array_equal(now.t, then.t)):
            return f"a camera that stays as it is all through a clip; found that it moves or zooms after frame {first.index}"
        return ""

    def _joints(self, sample: Sample) -> NDArray[np.intp]:
        o = _person(sample)
        try:
            _, places = joints(o.keypoint_names)
        except ValueError as error:
            raise UserError(f"surreal: frame {sample.index}: model {o.key}: {error}") from None
        if (behind := o.keypoints3d_camera[places, 2] <= 0).any():
            found = f"found {behind.sum()} behind it"
            raise UserError(f"surreal: frame {sample.index}: expected all joints before the camera; {found}")
        return places

    def _parts(self, sample: Sample) -> NDArray[np.int64]:
        """SURREAL's number of the part that each pixel shows, (H, W); raises UserError for parts that SURREAL lacks."""
        o = _person(sample)
        names = self._models[o.key].body_parts
        numbers = part_numbers(names, joints(o.keypoint_names)[0])
        own = np.where(sample.channels["instances"] == o.id, sample.channels["body_parts"], 0)
        found = numbers[own]
        if (strange := found == UNKNOWN).any():
            told = ", ".join(names[i - 1] for i in np.unique(own[strange])[:MOST_TOLD])
            raise UserError(
                f"surreal: frame {sample.index}: model {o.key}: expected bones of SURREAL's 24 parts of the body; "
                f"found {told}: let body_parts in the model's sidecar put them to others"
            )
        return found

    def _info(self, clip: _Clip) -> dict[str, Any]:
        first, places = clip.samples[0], clip.joints3d
        pixels = _projected(first.camera.K, places.astype(np.float64) - clip.place.astype(np.float64)[:, None, None])
        backgrounds = [self._background(sample) for sample in clip.samples]
        return {
            **({"bg": np.array([[*backgrounds]], object)} if all(backgrounds) else {}),
            "camDist": clip.place[0],
            "camLoc": clip.place[:, None],
            "clipNo": float(clip.number),
            "joints2D": np.rint(pixels).astype(np.float32),
            "joints3D": places,
            "sequence": clip.path.rpartition("/")[2],
            "source": "viewsphere",
            "stride": np.uint8(0),
            "zrot": np.array([[_turn(sample)] for sample in clip.samples], np.float32),
            "K": first.camera.K,
        }

    def _background(self, sample: Sample) -> str:
        """The name of the picture behind a sample's scene, without its folder; empty if there is none."""
        shot, instant, _ = self._timeline.position(sample)
        finish = shot.instants[instant].finish or shot.scene.finish
        return PurePath(finish.background.image or "").name


def film_encoder() -> Encoder:
    """Return the video encoder; raises MissingExtraError if ffmpeg is missing."""
    return encoder("format surreal", "")


def _film(clip: _Clip) -> bytes:
    """The video of a clip. It reads copies of the samples, so that no picture stays in memory."""
    times = [sample.time for sample in clip.samples]
    steps: Sequence[float] = np.diff(times).tolist() or [1 / RATE]
    lasts = [*steps, min(steps)][: len(times)]
    with temporary("film") as scratch_folder:
        pictures = (opaque(replace(sample, channels=copy(sample.channels)).picture) for sample in clip.samples)
        write_mp4(scratch_folder / "film.mp4", zip(pictures, lasts, strict=True), film_encoder())
        return read_bytes(scratch_folder / "film.mp4")


def _variable(name: str, array: NDArray[Any]) -> bytes:
    """A variable as stored in a MATLAB file, compressed with deflate."""
    data = compressed(np.frombuffer(mat(**{name: array})[HEAD:], np.uint8))
    return struct.pack("<II", COMPRESSED, len(data)) + data


def _projected(K: Float, away: Float) -> Float:
    """Pixels (2, 24, T) of positions (3, 24, T) in the clip's world, seen by the clip's camera."""
    found = np.einsum("ij,jkt->ikt", K @ CAMERA_FROM_WORLD, away)
    return found[:2] / found[2]


def _person(sample: Sample) -> ObjectAnnotation:
    (o,) = sample.objects
    return o


def _turn(sample: Sample) -> float:
    """Angle from the direction to the camera to the direction of the model's front (-Y), radians, counter-clockwise seen from
    above.
    """
    right, front = sample.camera.R[0, :2], -_person(sample).world_from_object[:2, 1]
    return float(np.arctan2(right @ front, right[1] * front[0] - right[0] * front[1]))
