"""ObjectNet3D: pictures whose objects are aligned with CAD models, in MATLAB files, for its toolbox and scipy.

    Annotations/<index>.mat                      `record`: size; for each object its box, CAD model, viewpoint and anchors
    Images/<index>.JPEG                          the pictures
    CAD/off/<category>/<number>.off              the models, numbers from 01
    CAD/off/<category>/<number>_<point>.off      one of a model's named points, a single vertex
    CAD/mat/<category>.mat                       a struct array: vertices, faces, and a field for each named point
    CAD/cads.mat                                 `class_names`, and `cads`, a cell with vertices and faces for each of these
    Image_sets/<split>.txt, classes.txt          names of the pictures, and of the categories

Every picture has a record, with an empty list if it shows no object. `viewpoint` has azimuth (0 faces the model's front, then
counter-clockwise seen from above), elevation, and theta (the camera's roll, clockwise seen from behind it), all in degrees. It
also has distance (metres), focal (1), viewport (the focal length in pixels), and px, py: the projection of the model's origin.
CAD models are in metres, front -Y, up +Z, with the origin at the centre of their box. cad_index and faces count from 1; OFF
files count from 0. The centre of the first pixel is (1, 1), and boxes (of the visible pixels) name the first and the last
pixel.

The format's projection assumes a camera that looks at the model, and shifts the picture to px, py. It is exact if the origin is
on the optical axis, and close elsewhere. Additional fields hold the true projection: `record.K` (pixels as above) and, for each
object, `RT`, 3 x 4, which transforms points of its CAD model to the camera (x right, y down, z ahead); and `id`, the object's
id. The benchmark compares the rotation of `RT` for an origin on the axis. An object whose origin is behind the camera has
distance 0; the toolbox draws nothing for it.

Anchors are the model's named points; `_` replaces characters that MATLAB names cannot have. Visible anchors have status 1 and a
location. truncated: more than 15 % of the object is outside the picture; occluded: other objects hide more than 5 % of the part
inside.

Not stored: masks, sequences and sensors; and `shapenet`, similar models of another collection, because the models are the true
ones. azimuth_coarse and elevation_coarse are exact. Not verified: pixels counted from 1, and status 2 (occluded) and 4
(outside) of anchors. Writing needs the extra `mat`. Source: Y. Xiang et al., ObjectNet3D: A Large Scale Database for 3D Object
Recognition, ECCV 2016, https://cvgl.stanford.edu/projects/objectnet3d/, and its toolbox,
https://github.com/yuxng/ObjectNet3D_toolbox.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.viewpoint_mat import Cads, Options, no_viewpoints, scipy_io
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


def _check() -> None:
    """Raise MissingExtraError if scipy is missing."""
    scipy_io("objectnet3d")


def _needs(options: Options) -> tuple[str, ...]:
    """Labels on request."""
    return ("keypoints",) if options.anchors else ()


def _refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Yield the reasons why viewpoints cannot describe a data set."""
    yield from no_viewpoints(scope)


class _ObjectNet3d(Tree):
    """The tree of a release."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._cads = Cads(dataset, options, "objectnet3d")
        if "classes" in dataset.splits:
            raise UserError("objectnet3d: expected splits whose lists have other names than that of categories; found classes")

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its record."""
        split, _, stem = self.stem(sample).partition("/")
        name = stem.rpartition("/")[2]
        seen = [o for o in sample.objects if o.box2d is not None]
        yield File(f"Images/{name}.JPEG", picture(sample, ".jpg"))
        yield File(f"Annotations/{name}.mat", self._cads.record(sample, seen, f"{name}.JPEG", masks=False))
        yield line(f"Image_sets/{split}.txt", name)

    def rest(self) -> Iterator[File]:
        """The models, and the names of the categories."""
        names = list(self._cads.by_category)
        for category, infos in self._cads.by_category.items():
            if infos:
                yield File(f"CAD/mat/{category}.mat", self._cads.file(category))
            for number, info in enumerate(infos, 1):
                yield File(f"CAD/off/{category}/{number:02}.off", self._cads.off(info))
                for point, text in self._cads.points(info):
                    yield File(f"CAD/off/{category}/{number:02}_{point}.off", text)
        yield File("CAD/cads.mat", self._cads.cells(names))
        yield File("Image_sets/classes.txt", "".join(f"{name}\n" for name in names).encode())


preparer, writer, verify = functions(_ObjectNet3d)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("viewpoints", "CAD models", "boxes", "anchors"),
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
)
