"""A recording of AirSim: a log of poses and picture files, depth as PFM, and the settings of the cameras.

    <sequence>/airsim_rec.txt                          the log: VehicleName TimeStamp POS_X ... Q_Z ImageFile, tabs between
    <sequence>/images/img_<sensor>_0_0_<time>.png      type 0, Scene
    <sequence>/images/img_<sensor>_0_1_<time>.pfm      type 1, DepthPlanar: metres along z
    <sequence>/images/img_<sensor>_0_2_<time>.pfm      type 2, DepthPerspective: metres along the pixel's ray
    <sequence>/images/img_<sensor>_0_4_<time>.pfm      type 4, DisparityNormalized: disparity / picture width
    <sequence>/images/img_<sensor>_0_5_<time>.png      type 5, Segmentation: a colour for each object
    <sequence>/images/img_<sensor>_0_7_<time>.png      type 7, Infrared: object ids, equal in red, green and blue
    <sequence>/settings.json                           every sensor's picture size and angle of view
    seg_rgbs.txt                                       the colours of Segmentation: id, tab, [r, g, b]

Each sensor is a vehicle with camera 0, as in AirSim's mode ComputerVision, so the pose in a line is the camera's pose. `;`
joins the image files of a line. TimeStamp counts milliseconds and file names count nanoseconds from the start of the sequence.
Still pictures have a folder for each split; their number in the data set replaces the milliseconds.

Positions are in metres, NED: x north, y east, z down. North is viewsphere's y, east its x. The quaternion (w, x, y, z) rotates
body axes (x ahead, y right, z down) into NED; the camera looks along x. AirSim stores the highest row of a PFM first, against
the format's rule, and so does this export; most readers of PFM show it upside down. Depth of the background is 65504. Unknown
disparity is 0. `FOV_Degrees` is the horizontal angle; the principal point is the centre of the picture.

Segmentation uses the colours of PASCAL VOC by object id, with 0 for the background, instead of AirSim's own table.

Not stored: categories, boxes, the split of a sequence, motor measurements, and flow, because AirSim does not document its
units. Not verified: the depth 65504, the largest 16-bit float; and the settings, which no AirSim has loaded. Source: Shah et
al. 2017, "AirSim: High-Fidelity Visual and Physical Simulation for Autonomous Vehicles", https://microsoft.github.io/AirSim/.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded, Content
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import scene
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.geometry.rotation import product, quaternion_from_matrix, transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

Kind = Literal["scene", "depth_planar", "depth_perspective", "disparity_normalized", "segmentation", "infrared"]
KINDS: Mapping[Kind, tuple[int, str, str]] = {
    "scene": (0, "png", "rgb"),
    "depth_planar": (1, "pfm", "depth"),
    "depth_perspective": (2, "pfm", "depth_ray"),
    "disparity_normalized": (4, "pfm", "disparity"),
    "segmentation": (5, "png", "instances"),
    "infrared": (7, "png", "instances"),
}
"""The number of each image type, its file ending, and its channel."""

HEAD = "VehicleName TimeStamp POS_X POS_Y POS_Z Q_W Q_X Q_Y Q_Z ImageFile".replace(" ", "\t")
NOTHING = 65504.0
MOST = 255
NED = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
BODY = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""The rotation from a body's axes (ahead, right, down) to a camera's (right, down, ahead)."""


class _Options(Frozen):
    """The image types to record."""

    images: tuple[Kind, ...] = Field(
        default=("scene", "depth_planar", "segmentation"),
        min_length=1,
        description=f"types of images: {', '.join(KINDS)}; disparity_normalized is of two rectified cameras",
    )


def _needs(options: _Options) -> tuple[str, ...]:
    """Return the channels that the images need."""
    return tuple(dict.fromkeys(KINDS[kind][2] for kind in options.images if kind != "scene"))


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: unknown labels or cameras, lenses that need more than an angle of view, and more objects than
    colours.
    """
    yield from refusals.lacking_labels(scope, _needs(options))
    yield from refusals.known_cameras(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.centred(scope)
    if {"segmentation", "infrared"} & set(options.images):
        yield from refusals.most_objects(scope, MOST)
    if "disparity_normalized" in options.images:
        yield from refusals.stereo(scope)


class AirSim(Tree):
    """The recordings of a data set."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._kinds = tuple(dict.fromkeys(options.images))

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """The images of a sensor at an instant, a line of the log, and the sensor's settings."""
        root = scene(sample) if sample.sequence else sample.split or "all"
        seconds = sample.time if sample.sequence else sample.index / 1000
        names: list[str] = []
        for kind in self._kinds:
            number, ending, _ = KINDS[kind]
            names.append(f"img_{sample.sensor}_0_{number}_{round(seconds * 1e9)}.{ending}")
            yield File(f"{root}/images/{names[-1]}", _image(sample, kind))
        values = (sample.sensor, round(seconds * 1e3), *_pose(sample.camera), ";".join(names))
        yield Piece(f"{root}/airsim_rec.txt", ("\t".join(map(str, values)) + "\n").encode())
        yield Piece(f"{root}/settings.json", b"", json.dumps([sample.sensor, self._settings(sample.camera)]))

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The log with its header, and the settings; each sensor's settings are the name of a section."""
        if not path.endswith("settings.json"):
            return (f"{HEAD}\n".encode(), "")
        told = sorted(json.loads(section) for section in counts)
        names = [name for name, _ in told]
        if len(set(names)) < len(names):
            raise UserError(f"airsim: expected sensors of one lens each; found several in {path.partition('/')[0]}")
        said = {"SettingsVersion": 1.2, "SimMode": "ComputerVision", "Vehicles": dict(told)}
        return (json.dumps(said, indent=2).encode(), b"\n")

    def rest(self) -> Iterator[File]:
        """The colours of objects."""
        if "segmentation" in self._kinds:
            rows = (f"{number}\t{color}\n" for number, color in enumerate(palette().tolist()))
            yield File("seg_rgbs.txt", "".join(rows).encode())

    def _settings(self, camera: Camera) -> dict[str, object]:
        angle = math.degrees(2 * math.atan(camera.width / (2 * camera.intrinsics.fx)))
        sizes = {"Width": camera.width, "Height": camera.height, "FOV_Degrees": angle}
        captured = [{"ImageType": KINDS[kind][0], **sizes} for kind in self._kinds]
        return {"VehicleType": "ComputerVision", "Cameras": {"0": {"CaptureSettings": captured}}}


def _pose(camera: Camera) -> list[float]:
    """Return the position of a camera, x y z, and the rotation of its body, w x y z; NED."""
    place = transform(NED, camera.center)
    turned = quaternion_from_matrix(product(product(NED, np.ascontiguousarray(camera.R.T)), BODY))
    return [value + 0.0 for value in (*place.tolist(), *turned)]


def _image(sample: Sample, kind: Kind) -> Content:
    if kind == "scene":
        return picture(sample, ".png")
    make = {"segmentation": _colors, "infrared": _grey}.get(kind) or partial(_floats, channel=KINDS[kind][2])
    return Coded(sample.index, f"airsim {kind}", partial(make, sample))


def _colors(sample: Sample) -> bytes:
    return encode_png(palette()[sample.channels["instances"]])


def _grey(sample: Sample) -> bytes:
    return encode_png(np.dstack([sample.channels["instances"].astype(np.uint8)] * 3))


def _floats(sample: Sample, channel: str) -> bytes:
    """A PFM file with the highest row first."""
    array: NDArray[np.float32] = sample.channels[channel]
    if channel == "disparity":
        array = np.nan_to_num(array / np.float32(sample.width))
    else:
        array = np.where(np.isfinite(array), array, np.float32(NOTHING))
    return f"Pf\n{sample.width} {sample.height}\n-1\n".encode() + array.astype("<f4").tobytes()


preparer, writer, verify = functions(AirSim)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("cameras", "depth", "disparity", "instances"),
    read_by=("pandas", "AirSim's read_pfm"),
    options=_Options,
    channels=("rgb",),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
