"""TAP-Vid and TAPVid-3D: points tracked through videos, for the benchmarks' own evaluation.

    <split>/<sequence>.pkl                  `kind: tapvid`
    <split>/<sequence>.npz                  `kind: tapvid3d`
    <split>/<sequence>_<sensor>.pkl, .npz   for rigs of several cameras

TAP-Vid: a pickle as in TAP-Vid-DAVIS, but one for each video, so that files stay small; `dict.update` joins them. It is a
dictionary, by the video's name, of `video`, uint8 (T, H, W, 3); `points`, float32 (N, T, 2), x and y as shares of width and
height, with the picture's corner as origin, 0 for a point without a position; `occluded`, bool (N, T), true for a point that is
hidden, outside or behind the camera. There are no queries: readers create them. The pickles need numpy of any version, and
nothing else.

TAPVid-3D: arrays `images_jpeg_bytes` (T), a JPEG each; `fx_fy_cx_cy`, pixels, with the picture's corner as origin;
`tracks_XYZ`, float32 (T, N, 3), metres in the camera's axes of that instant (x right, y down, z ahead), 0 for a point without a
position; `visibility`, bool (T, N); `queries_xyt`, float32 (N, 3), pixels and the number of the picture of each point's query;
`extrinsics_w2c`, float64 (T, 4, 4). Points of the sky, which have no position, are left out. The names are those that the
benchmark's programs read; its readme has others.

The points are the recipe's `tracks`. Not stored: times, whether an invisible point is hidden or outside, objects; JPEG loses
some colour. Not verified with the originals: the corner as pixel origin of queries_xyt. Sources: Doersch et al. 2022, "TAP-Vid:
A Benchmark for Tracking Any Point in a Video"; Koppula et al. 2024, "TAPVid-3D: A Benchmark for Tracking Any Point in 3D",
https://github.com/google-deepmind/tapnet.
"""

from __future__ import annotations

import io
import pickle
import zipfile
from collections.abc import Iterator
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.pictures import encode_picture
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import JPEG_QUALITY, opaque
from viewsphere.formats.shared.writing.sequences import check_whole, scene
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.geometry.rotation import rigid
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

DATE = (1980, 1, 1, 0, 0, 0)
"""The date of all members of archives, fixed so that equal arrays make equal files."""

UNIX = 3
"""The system that all archives name as their origin."""


class _Options(Frozen):
    """The benchmark."""

    kind: Literal["tapvid", "tapvid3d"] = Field(
        default="tapvid", description="`tapvid`: where points are in the pictures; `tapvid3d`: in the camera's axes"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: still pictures and, for TAPVid-3D, distorted lenses."""
    yield from refusals.sequences(scope)
    if options.kind == "tapvid3d":
        yield from refusals.pinhole(scope)


class Tapvid(Tree):
    """A tree with a file for each video."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        check_whole(dataset, "tapvid")
        self._make, self._ending = {"tapvid": (self._pickled, "pkl"), "tapvid3d": (self._archived, "npz")}[options.kind]

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """Yield nothing, because a file holds a whole sequence."""
        yield from ()

    def rest(self) -> Iterator[File]:
        """The videos, each encoded when it is written."""
        last = ""
        for key, places in self.dataset.shots():
            first = self.dataset.sample_at(key, places[0])
            if first.sequence == last:
                continue
            last = first.sequence
            shot = self.dataset.labelled(key)
            sensors = [sensor.name for sensor in shot.rig.sensors] if shot else [first.sensor]
            for sensor in (sensors[i] for i in sorted({place % len(sensors) for place in places})):
                name = scene(first) if len(sensors) == 1 else f"{scene(first)}_{sensor}"
                path = f"{first.split or 'all'}/{name}.{self._ending}"
                yield File(path, Coded(first.index, path, partial(self._make, name, last, sensor)))

    def _pickled(self, name: str, sequence: str, sensor: str) -> bytes:
        samples, tracks = self.dataset.sequence(sequence, sensor), self.dataset.tracks(sequence, sensor)
        size = (samples[0].width, samples[0].height)
        found = {
            "video": np.stack([opaque(sample.picture) for sample in samples]),
            "points": np.nan_to_num(tracks.xy.transpose(1, 0, 2) / size, posinf=0, neginf=0).astype("<f4"),
            "occluded": tracks.state.T != 0,
        }
        return pickled({name: found})

    def _archived(self, name: str, sequence: str, sensor: str) -> bytes:
        samples, tracks = self.dataset.sequence(sequence, sensor), self.dataset.tracks(sequence, sensor)
        lens = samples[0].camera.intrinsics
        if any(sample.camera.intrinsics != lens for sample in samples):
            raise UserError(f"tapvid: kind tapvid3d: expected one lens all through a sequence; found that {sequence} zooms")
        kept = ~np.isinf(tracks.xyz[..., 2]).any(axis=0) & np.isin(tracks.query[:, 0], tracks.instants)
        queries = tracks.query[kept][:, [1, 2, 0]]
        queries[:, 2] = np.searchsorted(tracks.instants, queries[:, 2])
        return archive(
            images_jpeg_bytes=np.array([_jpeg(self.dataset, sample) for sample in samples]),
            fx_fy_cx_cy=np.array([lens.fx, lens.fy, lens.cx, lens.cy]),
            tracks_XYZ=np.nan_to_num(tracks.xyz[:, kept]).astype("<f4"),
            visibility=tracks.state[:, kept] == 0,
            queries_xyt=queries.astype("<f4"),
            extrinsics_w2c=np.stack([rigid(sample.camera.R, sample.camera.t) for sample in samples]),
        )


def _jpeg(dataset: Dataset, sample: Sample) -> bytes:
    file = sample.picture_file or ""
    return dataset.read(file) if file.endswith(".jpg") else encode_picture(opaque(sample.picture), "jpeg", JPEG_QUALITY)


preparer, writer, verify = functions(Tapvid)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("point tracks", "occlusion", "cameras"),
    read_by=("tapnet",),
    options=_Options,
    channels=("rgb", "tracks"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)


class _Portable(pickle.Pickler):
    """A pickler of arrays by shape, type and bytes: numpy's own pickles name modules that other versions lack."""

    def reducer_override(self, obj: Any) -> Any:
        """Return the call that restores an array; other values as usual."""
        if isinstance(obj, np.ndarray):
            return np.ndarray, (obj.shape, obj.dtype.str, bytearray(np.ascontiguousarray(obj).tobytes()))
        return NotImplemented


def pickled(value: Any) -> bytes:
    """A pickle of dictionaries, texts and arrays that every version of numpy reads; equal values, equal bytes."""
    out = io.BytesIO()
    _Portable(out, protocol=4).dump(value)
    return out.getvalue()


def archive(**arrays: NDArray[Any]) -> bytes:
    """The archive of `np.savez(file, **arrays)`; equal arrays, equal bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as members:
        for name, array in arrays.items():
            head, member = io.BytesIO(), zipfile.ZipInfo(f"{name}.npy", DATE)
            member.create_system = UNIX
            np.lib.format.write_array(head, array, allow_pickle=False)
            members.writestr(member, head.getvalue())
    return out.getvalue()
