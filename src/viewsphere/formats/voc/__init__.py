"""PASCAL VOC, as the VOC2012 development kit has it; read by torchvision, supervision, datumaro and most trainers of detectors.

    VOCdevkit/VOC2012/JPEGImages/<index>.jpg             the pictures; .png with `pictures: png`
    VOCdevkit/VOC2012/Annotations/<index>.xml            size; of each object name, pose, truncated, occluded, difficult, box
    VOCdevkit/VOC2012/SegmentationClass/<index>.png      palette picture: 0 background, else the category's number
    VOCdevkit/VOC2012/SegmentationObject/<index>.png     palette picture: 0 background, else the object's place in the XML
    VOCdevkit/VOC2012/ImageSets/Main/<split>.txt         names of a split's pictures; in Segmentation/, of those with masks
    VOCdevkit/VOC2012/labelmap.txt                       names and colours of the categories' numbers, for datumaro

Boxes are around the visible pixels and count pixels from 1, both ends inside: xmin = floor(x) + 1, xmax = ceil(x + w).
datumaro takes them as such with `coordinate_mode="voc-one-based"`, supervision always; torchvision gives the numbers as they
are. Categories' numbers count from 1 in the data set's order; their colours are VOC's palette. Objects of which nothing is seen
have no entry.

truncated: more than 15 % of the object lies outside of the picture. occluded: others hide more than 5 % of what lies inside.
Both numbers are those of the annotators' guidelines. pose: Frontal, Rear, Left or Right, where the camera stands within 20
degrees of that side, no more than 45 degrees above or below and tilted; else Unspecified. Left is seen of an object that shows
its own left side: it faces the picture's left. difficult: see the option.

Lost: sequences, sensors and cameras. Masks have no void line (255) around objects, as VOC's own have: all pixels are known. The
class lists of the classification task (`<category>_<split>.txt`) and `trainval.txt` are not written: they follow from the XML,
and from `train.txt` and `val.txt`. torchvision takes only splits named train, val and trainval, and pictures that are JPEG;
supervision looks at no sub-folders, which data sets of more than 10,000 pictures have; datumaro passes over splits with `_` in
their name. Not verified: what `Left` means, of which the guidelines say nothing.

Data sets that were made elsewhere are imported by their folder: `viewsphere import voc`. Their pictures are those of the lists
in ImageSets/Main (trainval is passed over where there are train and val), or else of all annotations, which then are in
`train`. Objects keep their flags and poses; masks are SegmentationObject's, without the void line. Parts (head, hand, foot) are
not read. Others' trees are read, too: supervision's (annotations, images), with polygons, and FiftyOne's (labels, data);
datumaro's, whose pictures have no XML where they show nothing, or masks alone, if there is a labelmap.txt. datumaro and
FiftyOne count pixels from 0, which only a box that begins at 0 tells: then all of the tree are taken so, else they come out a
pixel too large. Such numbers go out as they came. Source: M. Everingham et al., The PASCAL Visual Object Classes Challenge,
http://host.robots.ox.ac.uk/pascal/VOC/voc2012/, and its annotation guidelines of 2009.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.shared.refusals import most_categories, most_objects, plain_names
from viewsphere.formats.shared.tree import functions
from viewsphere.formats.voc.reading import read
from viewsphere.formats.voc.writing import Options, Voc
from viewsphere.plugins.format import FormatSpec

MOST = 254  # 255 is void
NAMES = r"[^:#\x00-\x1f][^:\x00-\x1f]*"
"""Names of categories that XML and a line of labelmap.txt can hold."""


def refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Numbers of 8 bits, and names that fill a line."""
    yield from most_categories(scope, MOST)
    yield from most_objects(scope, MOST)
    yield from plain_names(scope, NAMES, "of one line, without : and without # in front")


preparer, writer, verify = functions(Voc)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "class masks", "instance masks", "truncation", "occlusion", "pose categories"),
    read_by=("torchvision", "supervision", "datumaro"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    refuses=refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
