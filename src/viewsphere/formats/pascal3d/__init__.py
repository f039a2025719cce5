"""PASCAL3D+: pictures whose objects are aligned with CAD models, in MATLAB files; read by its toolbox and by scipy.

    Annotations/<category>_pascal/<index>.mat    `record`: size, and of each object its box, CAD model, viewpoint and anchors
    Images/<category>_pascal/<index>.jpg         the pictures
    CAD/<category>.mat                           a struct array: vertices, faces, and a field for each named point
    CAD/<category>/<number>.off                  the same models, numbers from 01
    PASCAL/VOCdevkit/VOC2012/                    as PASCAL VOC has it:
        SegmentationClass/<index>.png            palette picture: 0 background, else the category's number
        SegmentationObject/<index>.png           palette picture: 0 background, else the object's place in `record.objects`
        ImageSets/Main/<category>_<split>.txt    names of a split's pictures, each with 1 or -1: shows the category or not
        classes.txt                              number and name of each category

A picture lies, with all its objects, in the folders of all categories that it shows; one that shows none is left out.
`viewpoint` has azimuth (0 looks the model in the face, then counter-clockwise seen from above), elevation, and theta (the
camera's roll, clockwise seen from behind it), all in degrees, distance (metres), focal (1), viewport (the focal length in
pixels), and px, py: where the model's origin is seen. CAD models are in metres, front -Y, up +Z; their origin is the centre of
their box. cad_index and faces count from 1, as all of MATLAB does; the first pixel's centre is (1, 1), and boxes (of the
visible pixels) name the first and the last pixel.

The format's projection takes the camera for one that looks at the model, and moves the picture to px, py: exact where the
origin is on the optical axis, as of models that are rendered one at a time, and near to it elsewhere (at the edge of a picture
50 degrees wide up to 9 % of the model's size off). The true one is in fields that the format does not have: `record.K` (pixels
as above) and, of each object, `RT`, 3 x 4, which takes points of its CAD model to the camera (x right, y down, z ahead); and
`id`, the object's id. An object whose origin is behind the camera has distance 0, which readers pass over.

Anchors are the model's named points; characters that names in MATLAB cannot have become `_`. status 1 and a location are those
of visible ones. truncated: more than 15 % of the object lies outside of the picture; occluded: others hide more than 5 % of
what lies inside. Categories that PASCAL VOC has keep its numbers (car: 7); others count from 21.

Lost: sequences and sensors. `interval_azimuth`, `interval_elevation` and `error`, which tell of human annotators, are left out;
azimuth_coarse and elevation_coarse are the exact ones. Not verified: that pixels count from 1, and status 2 (occluded) and 4
(outside) of anchors. Writing needs the extra `mat`. Source: Y. Xiang, R. Mottaghi, S. Savarese, Beyond PASCAL: A Benchmark for
3D Object Detection in the Wild, WACV 2014, https://cvgl.stanford.edu/projects/pascal3d.html.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats._contents import Coded
from viewsphere.formats._pictures import picture
from viewsphere.formats._refusals import most_categories, most_objects
from viewsphere.formats._tree import File, Piece, Tree, functions, line
from viewsphere.formats._viewpoint_mat import Cads, Options, no_viewpoints, scipy_io
from viewsphere.formats.pascal3d.again import again as again
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

CHANNELS = ("rgb",)
CREDITS = False
HOLDS = ("viewpoints", "CAD models", "boxes", "masks", "anchors")
READ_BY = ("scipy", "MATLAB")

KIT = "PASCAL/VOCdevkit/VOC2012"
MOST = 254  # 255 is void
CLASSES = (
    "aeroplane", "bicycle", "bird", "boat", "bottle", "bus", "car", "cat", "chair", "cow", "diningtable", "dog", "horse",
    "motorbike", "person", "pottedplant", "sheep", "sofa", "train", "tvmonitor",
)  # fmt: skip
"""PASCAL VOC's categories, from number 1 on."""


def check() -> None:
    """Raise MissingExtraError where there is no scipy."""
    scipy_io("pascal3d")


def needs(options: Options) -> tuple[str, ...]:
    """Labels on request."""
    return ("keypoints",) if options.anchors else ()


def refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Numbers of 8 bits, and what no viewpoint can tell."""
    yield from no_viewpoints(scope)
    yield from most_categories(scope, MOST - len(CLASSES))
    yield from most_objects(scope, MOST)


class Pascal3d(Tree):
    """The tree of a release."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._cads = Cads(dataset, options, "pascal3d")
        names = [category.name for category in dataset.categories]
        others = iter(range(len(CLASSES) + 1, MOST + 1))
        self._numbers = {name: CLASSES.index(name) + 1 if name in CLASSES else next(others) for name in names}
        lists = [f"{name}_{split}" for name in names for split in dataset.splits]
        if twice := next((name for name in lists if lists.count(name) > 1), None):
            raise UserError(f"pascal3d: expected categories and splits that make different names; found {twice} twice")

    def of(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its record for each category that it shows, and its maps."""
        split, _, stem = self.stem(sample).partition("/")
        name, seen = stem.rpartition("/")[2], [o for o in sample.objects if o.box2d is not None]
        shown = {o.category for o in seen}
        for category in self._numbers if shown else ():
            yield line(f"{KIT}/ImageSets/Main/{category}_{split}.txt", name, f"{1 if category in shown else -1:2}")
        if not shown:
            return
        record = self._cads.record(sample, seen, f"{name}.jpg", masks=True)
        for category in sorted(shown):
            yield File(f"Images/{category}_pascal/{name}.jpg", picture(sample, ".jpg"))
            yield File(f"Annotations/{category}_pascal/{name}.mat", record)
        objects = np.zeros((sample.height, sample.width), np.uint8)
        for number, o in enumerate(seen, 1):
            objects[o.mask] = number
        classes = np.array([0, *(self._numbers[o.category] for o in seen)], np.uint8)[objects]
        yield File(f"{KIT}/SegmentationClass/{name}.png", _indexed(sample, "classes", classes))
        yield File(f"{KIT}/SegmentationObject/{name}.png", _indexed(sample, "objects", objects))

    def rest(self) -> Iterator[File]:
        """The models, and the names of the numbers."""
        for category, infos in self._cads.by_category.items():
            if infos:
                yield File(f"CAD/{category}.mat", self._cads.file(category))
            for number, info in enumerate(infos, 1):
                yield File(f"CAD/{category}/{number:02}.off", self._cads.off(info))
        rows = "".join(f"{number} {name}\n" for name, number in sorted(self._numbers.items(), key=lambda one: one[1]))
        yield File(f"{KIT}/classes.txt", rows.encode())


def _indexed(sample: Sample, name: str, numbers: NDArray[np.uint8]) -> Coded:
    """A map (H, W) in VOC's palette."""
    return Coded(sample.index, f"pascal3d {name}.png", lambda: encode_png(numbers, palette=palette()))


preparer, writer, verify = functions(Pascal3d)
