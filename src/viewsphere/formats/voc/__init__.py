"""PASCAL VOC, in the layout of the VOC2012 development kit, for torchvision, supervision, datumaro and most trainers of
detectors.

    VOCdevkit/VOC2012/JPEGImages/<index>.jpg             the pictures; .png with `pictures: png`
    VOCdevkit/VOC2012/Annotations/<index>.xml            size; for each object name, pose, truncated, occluded, difficult, box
    VOCdevkit/VOC2012/SegmentationClass/<index>.png      palette picture: 0 background, else the category's number
    VOCdevkit/VOC2012/SegmentationObject/<index>.png     palette picture: 0 background, else the object's place in the XML
    VOCdevkit/VOC2012/ImageSets/Main/<split>.txt         names of a split's pictures; Segmentation/: of those with masks
    VOCdevkit/VOC2012/labelmap.txt                       names and colours of the categories' numbers, for datumaro

Boxes enclose the visible pixels, counted from 1, with both ends inside: xmin = floor(x) + 1, xmax = ceil(x + w). datumaro reads
them so with `coordinate_mode="voc-one-based"`, supervision always; torchvision returns the numbers unchanged. Category numbers
count from 1 in the data set's order; their colours are VOC's palette. Invisible objects have no entry.

truncated: more than 15 % of the object is outside the picture. occluded: other objects hide more than 5 % of the part inside.
Both numbers follow the annotators' guidelines. pose: Frontal, Rear, Left or Right if the camera is within 20 degrees of that
side, and its elevation and tilt are at most 45 degrees; else Unspecified. Left means that the object shows its own left side
and faces the picture's left. difficult: see the option.

Not stored: sequences, sensors and cameras; VOC's void line (255) around objects, because all pixels are known; the class lists
of the classification task (`<category>_<split>.txt`) and `trainval.txt`, which follow from the XML, and from `train.txt` and
`val.txt`. torchvision reads only splits named train, val and trainval, and JPEG pictures. supervision ignores sub-folders,
which data sets of more than 10,000 pictures have. datumaro skips splits with `_` in their name. Not verified: the meaning of
`Left`, which the guidelines do not define.

`viewsphere import voc` imports a folder of another origin. Its pictures are those of the lists in ImageSets/Main (without
trainval if train and val exist). Without lists, all annotations go to `train`. Objects keep their flags and poses; masks are
SegmentationObject's, without the void line. Parts (head, hand, foot) are ignored. The import also reads the trees of
supervision (annotations, images), with polygons, of FiftyOne (labels, data), and of datumaro with a labelmap.txt, in which
pictures without objects, or with masks alone, have no XML. datumaro and FiftyOne count pixels from 0. Only a box that begins at
0 reveals this; then the import reads the whole tree so, else boxes are a pixel too large. Exports write such numbers unchanged.
Source: M. Everingham et al., The PASCAL Visual Object Classes Challenge, http://host.robots.ox.ac.uk/pascal/VOC/voc2012/, and
its annotation guidelines of 2009.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.refusals import most_categories, most_objects, plain_names
from viewsphere.formats.shared.writing.tree import functions
from viewsphere.formats.voc.reading import read
from viewsphere.formats.voc.writing import Options, Voc
from viewsphere.plugins.format import FormatSpec

MOST = 254  # 255 is void
NAMES = r"[^:#\x00-\x1f][^:\x00-\x1f]*"
"""Allowed names of categories, for XML and for a line of labelmap.txt."""


def _refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Reasons to refuse: more categories or objects than 8 bits can number, and names that the files cannot hold."""
    yield from most_categories(scope, MOST)
    yield from most_objects(scope, MOST)
    yield from plain_names(scope, NAMES, "of one line, without : and without # in front")


preparer, writer, verify = functions(Voc)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "class masks", "instance masks", "truncation", "occlusion", "pose categories"),
    read_by=("torchvision", "supervision", "datumaro"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    panoramas=True,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
