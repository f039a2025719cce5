"""HDF5 files as BlenderProc writes them: all data of a picture in one container, for h5py.

    <split>/<index>.hdf5

Each file holds the gzipped arrays that `keys` names:

    colors                               uint8 (H, W, 3); (H, W, 4) if only the picture without its background is stored;
                                         uint16 of `rgb16`, float32 of `rgb_linear` if only these are
    depth, distance                      float32 (H, W), metres along the z axis and along the ray; 1e10 for the background
    normals                              float32 (H, W, 3), (n + 1) / 2 of camera axes x right, y up, z backwards; else 0.5
    nocs                                 float32 (H, W, 4), the place in the object's box; 1 on an object, else all 0
    forward_flow, backward_flow          float32 (H, W, 2), pixels right and down, to the next and the previous frame; else 0
    forward_flow_state, ...              uint8 (H, W): 0 visible there, 1 occluded, 2 outside, 3 behind the camera, 4 unknown
    class_segmaps, instance_segmaps      the visible category and object, both from 1; 0 is background

JSON, in byte strings: `instance_attribute_maps` lists idx, category_id, name (the model) and category of the visible objects,
background first. `camera_pose` holds cam_K, cam_R_w2c and cam_t_w2c, world to camera (OpenCV axes, metres, world Z up), with
the centre of the first pixel at (0, 0), and the lens if it has distortion. `object_states` lists the poses of all objects
(matrix_world, location). `frame` holds index, split, sequence, sensor, instant and time.

BlenderProc numbers the files of one run from 0, and stereo pairs share arrays. Here each picture is a file, by its number in
the data set. BlenderProc's NOCS are halves of the model's own coordinates; here the box's diagonal is 1, as in Wang et al.
2019. Not verified against its output: the value of empty depth, and the JSON besides the camera. There is no
`blender_proc_version`, and unknown values of imported pictures are left out. One release of h5py always writes the same bytes.
Writing needs the extra `hdf5`. Source: https://github.com/DLR-RM/BlenderProc.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.errors import MissingExtraError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.refusals import sequences
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions
from viewsphere.model.channel import ALL_PICTURES
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

NOTHING = np.float32(1e10)
"""Blender's depth for pixels that see nothing."""
LIBRARIES = ("v108", "v110")
"""The oldest HDF5 version that must read the files, and the newest version whose layout they may use."""

Key = Literal[
    "colors", "depth", "distance", "normals", "nocs", "forward_flow", "backward_flow", "forward_flow_state",
    "backward_flow_state", "class_segmaps", "instance_segmaps",
]  # fmt: skip
SOURCES: dict[str, str] = {
    "colors": "rgb", "depth": "depth", "distance": "depth_ray", "normals": "normals", "nocs": "nocs", "forward_flow": "flow",
    "backward_flow": "flow_backward", "forward_flow_state": "flow_state", "backward_flow_state": "flow_backward_state",
    "class_segmaps": "categories", "instance_segmaps": "instances",
}  # fmt: skip


class _Options(Frozen):
    """The contents of the containers."""

    keys: tuple[Key, ...] = Field(
        default=("colors", "depth", "class_segmaps", "instance_segmaps"),
        min_length=1,
        description="the arrays, as the format names them; labels that are not kept are computed",
    )


def _check() -> None:
    """Raise MissingExtraError if h5py is missing."""
    _library()


def _needs(options: _Options) -> tuple[str, ...]:
    """The channels of these keys."""
    return tuple(SOURCES[key] for key in options.keys)


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: flow of still pictures."""
    if any("flow" in key for key in options.keys):
        yield from sequences(scope)


class _Hdf5(Tree):
    """The tree of files with these keys."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._keys = tuple(dict.fromkeys(options.keys))
        most = {"class_segmaps": max((category.id for category in dataset.categories), default=0)}
        self._types = {key: np.min_scalar_type(most.get(key, dataset.max_objects)) for key in SOURCES if "segmaps" in key}

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """The container of a sample."""
        folder = self.stem(sample).rpartition("/")[0]
        yield File(f"{folder}/{sample.index}.hdf5", Coded(sample.index, f"{self._keys}.hdf5", lambda: self._container(sample)))

    def _container(self, sample: Sample) -> bytes:
        file = io.BytesIO()
        with _library().File(file, "w", libver=LIBRARIES) as container:
            for key in self._keys:
                array = self._array(sample, key)
                if array is not None:
                    container.create_dataset(key, data=array, compression="gzip", track_times=False)
            for key, value in _told(sample).items():
                container.create_dataset(key, data=np.bytes_(json_bytes(value)), track_times=False)
        return file.getvalue()

    def _array(self, sample: Sample, key: str) -> NDArray[Any] | None:
        """Return the array of a key; None if the sample lacks it."""
        if key == "colors":
            return sample.picture
        if SOURCES[key] not in sample.channels:
            return None
        found = sample.channels[SOURCES[key]]
        return found.astype(self._types[key]) if key in self._types else _CHANGES.get(key, np.asarray)(found)


def _filled(metres: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(np.isfinite(metres), metres, NOTHING)


def _normals(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals as colours, with axes turned from OpenCV's to OpenGL's."""
    return normals * np.array([0.5, -0.5, -0.5], np.float32) + np.float32(0.5)


def _nocs(shares: NDArray[np.float32]) -> NDArray[np.float32]:
    seen = np.isfinite(shares).all(axis=-1, keepdims=True)
    return np.concatenate([np.where(seen, shares, np.float32(0)), seen.astype(np.float32)], axis=-1)


_CHANGES: dict[str, Callable[[Any], Any]] = {
    "depth": _filled, "distance": _filled, "normals": _normals, "nocs": _nocs, "forward_flow": np.nan_to_num,
    "backward_flow": np.nan_to_num,
}  # fmt: skip


def _told(sample: Sample) -> dict[str, Any]:
    """Return the metadata that the container keeps as JSON."""
    nothing: dict[str, Any] = {"idx": 0, "category_id": 0, "name": "background", "category": ""}
    seen = (o for o in sample.objects if o.area)
    named = ({"idx": o.id, "category_id": o.category_id, "name": o.key, "category": o.category} for o in seen)
    names = ("index", "split", "sequence", "sensor", "instant", "time")
    return {
        "instance_attribute_maps": [nothing, *named],
        **({} if sample.known_camera is None else {"camera_pose": _camera(sample)}),
        "object_states": [_state(o) for o in sample.objects if o.is_placed],
        "frame": {name: getattr(sample, name) for name in names},
    }


def _state(o: ObjectAnnotation) -> dict[str, Any]:
    pose = o.world_from_object
    place = {"location": pose[:3, 3].tolist(), "matrix_world": pose.tolist()}
    return {"idx": o.id, "name": o.key, "category_id": o.category_id, **place}


def _camera(sample: Sample) -> dict[str, Any]:
    camera, bent = sample.camera, sample.camera.lens.flat_record
    matrix = camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    told = {"cam_K": matrix, "cam_R_w2c": camera.R, "cam_t_w2c": camera.t}
    return (
        {key: value.ravel().tolist() for key, value in told.items()}
        | ({"distortion": bent} if bent else {})
        | (camera.shutter_record)
    )


def _library() -> Any:
    """The package h5py; raises MissingExtraError if it is missing."""
    try:
        import h5py
    except ImportError:
        raise MissingExtraError("format hdf5: expected h5py, found none: pip install 'viewsphere[hdf5]'") from None
    return h5py


preparer, writer, verify = functions(_Hdf5)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("pictures", "depth", "normals", "masks", "NOCS", "flow", "poses", "cameras"),
    read_by=("h5py", "BlenderProc"),
    pictures=ALL_PICTURES,
    options=_Options,
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    check=_check,
    panoramas=True,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
