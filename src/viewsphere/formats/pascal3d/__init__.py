"""PASCAL3D+: pictures whose objects are aligned with CAD models, in MATLAB files, for its toolbox and scipy.

    Annotations/<category>_pascal/<index>.mat    `record`: size; for each object its box, CAD model, viewpoint and anchors
    Images/<category>_pascal/<index>.jpg         the pictures
    CAD/<category>.mat                           a struct array: vertices, faces, and a field for each named point
    CAD/<category>/<number>.off                  the same models, numbers from 01
    PASCAL/VOCdevkit/VOC2012/                    as in PASCAL VOC:
        SegmentationClass/<index>.png            palette picture: 0 background, else the category's number
        SegmentationObject/<index>.png           palette picture: 0 background, else the object's place in `record.objects`
        ImageSets/Main/<category>_<split>.txt    names of a split's pictures, each with 1 or -1: shows the category or not
        classes.txt                              number and name of each category

A picture appears, with all its objects, in the folder of every category that it shows; a picture without objects is left out.
`viewpoint` has azimuth (0 faces the model's front, then counter-clockwise seen from above), elevation, and theta (the camera's
roll, clockwise seen from behind it), all in degrees. It also has distance (metres), focal (1), viewport (the focal length in
pixels), and px, py: the projection of the model's origin. CAD models are in metres, front -Y, up +Z, with the origin at the
centre of their box. cad_index and faces count from 1, as in MATLAB. The centre of the first pixel is (1, 1), and boxes (of the
visible pixels) name the first and the last pixel.

The format's projection assumes a camera that looks at the model, and shifts the picture to px, py. It is exact if the origin is
on the optical axis, as for models that are rendered one at a time. Elsewhere it is close: at the edge of a picture 50 degrees
wide, up to 9 % of the model's size off. Additional fields hold the true projection: `record.K` (pixels as above) and, for each
object, `RT`, 3 x 4, which transforms points of its CAD model to the camera (x right, y down, z ahead); and `id`, the object's
id. An object whose origin is behind the camera has distance 0, and readers skip it.

Anchors are the model's named points; `_` replaces characters that MATLAB names cannot have. Visible anchors have status 1 and a
location. truncated: more than 15 % of the object is outside the picture; occluded: other objects hide more than 5 % of the part
inside. PASCAL VOC's categories keep its numbers (car: 7); others count from 21.

`viewsphere import pascal3d` imports a folder of another origin, without MATLAB or scipy. It reads all records in
Annotations/<category>_<source>. Each category's folder gives the objects of that category, the first folder the rest. Splits
are the lists in ImageSets/Main, `<category>_<split>.txt` or `<split>.txt`, and in Image_sets,
`<category>_imagenet_<split>.txt`; unlisted pictures go to `train`. CAD/<category>.mat gives the models, without colours, and
their anchors become keypoints; OFF files are ignored.

An imported object's `view` and pose_category follow its viewpoint, around the centre of its model's box; a coarse viewpoint has
no distance. `source` holds truncated, occluded, difficult and the viewpoint, and exports write the flags unchanged. A picture's
world is its camera's axes. K and RT, if present, give the lens and the poses. Otherwise the focal length is focal x viewport.
If one object has a viewpoint, px, py is the principal point, and the pose is exactly the format's projection. If several have
one, the principal point is the picture's centre; the shortest rotation turns each object to its px, py, with the error given
above. If the focal lengths differ, the lens and the poses are unknown.

Masks come from SegmentationObject, for `pascal` pictures alone. Their numbers are places in `record.objects`, or follow from
the boxes. A mask that is not inside its object's box, and overlaps it by less than half, is ignored. Not verified: which
numbering PASCAL3D+'s own files use. A picture whose size differs from imgsize is an error if there is K; otherwise the
picture's size counts.

Not stored: sequences and sensors; `interval_azimuth`, `interval_elevation` and `error`, which describe human annotators.
azimuth_coarse and elevation_coarse are exact. Not verified: pixels counted from 1, and status 2 (occluded) and 4 (outside) of
anchors. Writing needs the extra `mat`. Source: Y. Xiang, R. Mottaghi, S. Savarese, Beyond PASCAL: A Benchmark for 3D Object
Detection in the Wild, WACV 2014, https://cvgl.stanford.edu/projects/pascal3d.html.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.pascal3d.as_recipe import source_cameras
from viewsphere.formats.pascal3d.reading import read
from viewsphere.formats.shared.viewpoint_mat import KIT, Cads, Options, no_viewpoints, scipy_io
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import most_categories, most_objects
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

_MOST = 254  # 255 is void

_CLASSES = (
    "aeroplane", "bicycle", "bird", "boat", "bottle", "bus", "car", "cat", "chair", "cow", "diningtable", "dog", "horse",
    "motorbike", "person", "pottedplant", "sheep", "sofa", "train", "tvmonitor",
)  # fmt: skip
"""PASCAL VOC's categories, numbered from 1."""


def _check() -> None:
    """Raise MissingExtraError if scipy is missing."""
    scipy_io("pascal3d")


def _needs(options: Options) -> tuple[str, ...]:
    """Labels on request."""
    return ("keypoints",) if options.anchors else ()


def _refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Reasons to refuse: more categories or objects than 8 bits can number, and data that viewpoints cannot describe."""
    yield from no_viewpoints(scope)
    yield from most_categories(scope, _MOST - len(_CLASSES))
    yield from most_objects(scope, _MOST)


class _Pascal3d(Tree):
    """The tree of a release."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._cads = Cads(dataset, options, "pascal3d")
        names = [category.name for category in dataset.categories]
        others = iter(range(len(_CLASSES) + 1, _MOST + 1))
        self._numbers = {name: _CLASSES.index(name) + 1 if name in _CLASSES else next(others) for name in names}
        lists = [f"{name}_{split}" for name in names for split in dataset.splits]
        if twice := next((name for name in lists if lists.count(name) > 1), None):
            raise UserError(f"pascal3d: expected categories and splits that make different names; found {twice} twice")

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
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
        """The models, and the names of the category numbers."""
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


preparer, writer, verify = functions(_Pascal3d)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("viewpoints", "CAD models", "boxes", "masks", "anchors"),
    read_by=("scipy", "MATLAB"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    check=_check,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
    as_recipe=source_cameras,
)
