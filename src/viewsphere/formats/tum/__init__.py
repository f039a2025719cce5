"""RGB-D sequences in TUM's layout, for SLAM systems and their evaluations; or in ICL-NUIM's, which is mirrored.

    <world>/<sensor>/rgb/<seconds>.png        the pictures; without <sensor> if there is one
    <world>/<sensor>/depth/<seconds>.png      depth along z, 16 bits, 5000 a metre; 0 for the background and beyond 13.1 m
    <world>/<sensor>/rgb.txt, depth.txt       a picture a line: seconds, file
    <world>/<sensor>/groundtruth.txt          a pose a line: seconds, tx ty tz, qx qy qz qw, world_from_camera
    <world>/<sensor>/associations.txt         a pair a line: seconds, file of the picture, seconds, file of the depth
    <world>/<sensor>/calibration.txt          fx fy cx cy k1 k2 p1 p2 k3; TUM has these numbers on its web page

A world is a sequence. For still pictures it is a scene or a model, and the time is the number of the frame. Seconds count from
the sequence's beginning, to the microsecond. Lengths are metres, z up; cameras look along z, x right, y down. `cx` and `cy`
count from the centre of the first pixel: a centred camera has (width - 1) / 2.

With `kind: icl-nuim`, file names are frame numbers instead of seconds, and `associations.txt` has the depth first. Poses are in
`<world>.gt.freiburg`, as above, and `<world>.gt.sim`, three rows of four numbers and an empty line each. As in POV-Ray, y is up
in cameras and world: fy is negative, and swapping the world's y and z mirrors it.

Not supported: fisheyes, lenses with more than five coefficients (ICL-NUIM: any), skew, and changing lenses. `import` reads one
sensor's folder of either kind, with a `calibration.txt`. Not verified: that ICL-NUIM's loaders need no other file names.
Sources: Sturm et al., IROS 2012, https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats; Handa et al., ICRA 2014,
https://www.doc.ic.ac.uk/~ahanda/VaFRIC/iclnuim.html.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.cameras import Rigs, measured_png, world_from_camera, world_of
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import known_cameras, lenses, no_skew, pinhole
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions, line
from viewsphere.formats.tum.reading import read
from viewsphere.geometry.rotation import quaternion_from_matrix
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

STEP = 1 / 5000
"""Size of a depth step, metres."""

HEADS = {
    "rgb.txt": "# color images\n# timestamp filename\n",
    "depth.txt": "# depth maps\n# timestamp filename\n",
    "groundtruth.txt": "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n",
    "calibration.txt": "# fx fy cx cy k1 k2 p1 p2 k3\n",
}
MOST = 5
"""Greatest number of a lens' coefficients."""


class _Options(Frozen):
    """The benchmark whose sequences the export resembles."""

    kind: Literal["tum", "icl-nuim"] = Field(
        default="tum", description="`tum`: right-handed, files by seconds; `icl-nuim`: mirrored, files by frames"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: lenses that a line of numbers cannot hold."""
    yield from known_cameras(scope)
    yield from no_skew(scope)
    if options.kind == "icl-nuim":
        yield from pinhole(scope)
    for name, lens in lenses(scope):
        if not _is_held(lens):
            yield f"expected lenses of k1 k2 p1 p2 k3; found another of {name}"


class _Tum(Tree):
    """A folder for each sensor of each world."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._mirrored = options.kind == "icl-nuim"
        self._rigs = Rigs(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its depth, its pose, and the lines that name them."""
        lens, now, world = sample.camera.intrinsics, self._rigs.moment(sample), world_of(self.dataset, sample)
        if lens.skew or not _is_held(lens):
            raise UserError(f"tum: frame {sample.index}: expected a lens of k1 k2 p1 p2 k3; found another")
        folder = f"{world}/{now.folder}" if now.folder else world
        number = sample.instant if sample.sequence else sample.index
        stamp = str(number) if self._mirrored else f"{sample.time if sample.sequence else number:.6f}"
        between = self.stem(sample).partition("/")[2].rpartition("/")[0]
        name = f"{between}/{stamp}.png" if between else f"{stamp}.png"
        yield File(f"{folder}/rgb/{name}", picture(sample, ".png"))
        yield File(f"{folder}/depth/{name}", measured_png(sample, STEP))

        color, depth = (stamp, f"rgb/{name}"), (stamp, f"depth/{name}")
        pose = _mirrored(world_from_camera(sample.camera)) if self._mirrored else world_from_camera(sample.camera)
        w, *xyz = quaternion_from_matrix(pose[:3, :3])
        motion = (stamp, *pose[:3, 3].tolist(), *xyz, w)
        yield Piece(f"{folder}/calibration.txt", b"", _numbers(lens, -1 if self._mirrored else 1))
        if self._mirrored:
            yield line(f"{folder}/associations.txt", *depth, *color)
            yield line(f"{folder}/{world}.gt.freiburg", *motion)
            rows = "".join(" ".join(map(str, row)) + "\n" for row in pose[:3].tolist())
            yield Piece(f"{folder}/{world}.gt.sim", f"{rows}\n".encode())
        else:
            yield line(f"{folder}/associations.txt", *color, *depth)
            yield line(f"{folder}/groundtruth.txt", *motion)
            yield line(f"{folder}/rgb.txt", *color)
            yield line(f"{folder}/depth.txt", *depth)

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The header of TUM's files, and the lines; the lens is the name of its section."""
        name = path.rpartition("/")[2]
        head = HEADS.get(name, "").encode()
        if name != "calibration.txt":
            return (head, "")
        if len(counts) > 1:
            raise UserError(f"tum: {path}: expected one lens for all pictures of a sensor; found several")
        return (head, f"{next(iter(counts))}\n".encode())


def _is_held(lens: Intrinsics) -> bool:
    own = lens.lens.opencv
    return own is not None and not own.is_fisheye and not any(own.coefficients[MOST:])


def _numbers(lens: Intrinsics, up: int) -> str:
    own = lens.lens.opencv.coefficients[:MOST] if lens.lens.opencv else ()
    values = (lens.fx, up * lens.fy, lens.cx - 0.5, lens.cy - 0.5, *own, *[0.0] * (MOST - len(own)))
    return " ".join(map(str, values))


def _mirrored(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """A camera's pose, (4, 4), with y up in the camera and in the world, so that both are left-handed."""
    return pose[[0, 2, 1, 3]] * (1.0, -1.0, 1.0, 1.0)


preparer, writer, verify = functions(_Tum)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("depth", "trajectories"),
    read_by=("TUM's RGB-D tools", "SLAM systems", "evo"),
    options=_Options,
    channels=("rgb", "depth"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
