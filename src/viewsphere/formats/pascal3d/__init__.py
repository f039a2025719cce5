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

Data sets that were made elsewhere are imported by their folder: `viewsphere import pascal3d`, without MATLAB or scipy. Read are
all records in Annotations/<category>_<source>; what a picture shows is each category's own folder's, the rest its first one's.
Splits are those of the lists in ImageSets/Main, `<category>_<split>.txt` or `<split>.txt`, and in Image_sets,
`<category>_imagenet_<split>.txt`; a picture of no list is in `train`. CAD/<category>.mat are the data set's models, without
colours, their anchors its keypoints; OFF files are not read. An object's `view` and pose_category are its viewpoint's, around
the middle of its model's box, of a coarse one without a distance; truncated, occluded, difficult and the viewpoint are in its
`source`, and the flags go out as they came. A picture's world is its camera's axes. K and RT, where they are, are its lens and
poses. Elsewhere the lens has the length focal x viewport: where one object has a viewpoint, px, py is where its axis meets the
picture, and the pose is exactly the format's projection; where several have, that is the picture's middle, each is turned the
shortest way to its px, py, and its pose is as near to the format's projection as said above. Where lengths differ, the lens and
poses are not known. Masks are SegmentationObject's, of `pascal` pictures alone: the numbers are places in `record.objects`, or
as the boxes tell, and a mask that neither overlaps its object's box by half nor lies in it is none. Not verified: which of both
they are in PASCAL3D+'s own files. A picture of another size than imgsize is refused where there is K; else the picture counts.

Lost: sequences and sensors. `interval_azimuth`, `interval_elevation` and `error`, which tell of human annotators, are left out;
azimuth_coarse and elevation_coarse are the exact ones. Not verified: that pixels count from 1, and status 2 (occluded) and 4
(outside) of anchors. Writing needs the extra `mat`. Source: Y. Xiang, R. Mottaghi, S. Savarese, Beyond PASCAL: A Benchmark for
3D Object Detection in the Wild, WACV 2014, https://cvgl.stanford.edu/projects/pascal3d.html.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.pascal3d.again import again
from viewsphere.formats.pascal3d.reading import read
from viewsphere.formats.pascal3d.writing import CLASSES, MOST, Pascal3d
from viewsphere.formats.shared.refusals import most_categories, most_objects
from viewsphere.formats.shared.tree import functions
from viewsphere.formats.shared.viewpoint_mat import Options, no_viewpoints, scipy_io
from viewsphere.plugins.format import FormatSpec


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


preparer, writer, verify = functions(Pascal3d)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("viewpoints", "CAD models", "boxes", "masks", "anchors"),
    read_by=("scipy", "MATLAB"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    needs=needs,
    refuses=refuses,
    check=check,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
    again=again,
)
