"""YOLO, as Ultralytics trains it: a text file beside each picture, a line an object, numbers as shares of the picture.

    data.yaml                        train, val, test, names; for pose kpt_shape, flip_idx, kpt_names
    images/<split>/<index>.png       the pictures
    labels/<split>/<index>.txt       class, and by task: `detect` centre x, centre y, width, height of the visible pixels'
                                     box; `segment` the mask's polygon; `pose` the box, then x, y, v of each point; `obb` four
                                     corners

Classes count from 0 in the data set's order of categories. `segment`: an object has one ring; several pieces are joined by
lines of no width, as Ultralytics' own converter does. `pose`: v is 2 for a visible point, 1 for an occluded one, 0 for others,
and the points of all models together are one list, of which each object has its own. Objects of which nothing is seen have no
line. Imported objects keep their own polygons, corners and points.

Data sets that were made elsewhere are imported by their data.yaml: `viewsphere import yolo`. What a line is, its numbers tell:
4 are a box, as many as kpt_shape says a box with points, others a polygon; one of four corners is an oriented box, too. Splits
are data.yaml's: folders, or lists of pictures. A picture's labels lie where the last `images` of its path is `labels`; it may
have none. A data.yaml without splits, as supervision writes it, is of `images`, or of its folders train, val and test. Trees of
Darknet, as datumaro and FiftyOne write them, have obj.names and lists, `<split>.txt`; labels lie beside their pictures. Source:
Ultralytics' documentation, https://docs.ultralytics.com/datasets/.
"""

from __future__ import annotations

from viewsphere.formats.shared.tree import functions
from viewsphere.formats.yolo.reading import read
from viewsphere.formats.yolo.writing import Options, Yolo
from viewsphere.plugins.format import FormatSpec


def needs(options: Options) -> tuple[str, ...]:
    """Labels on request."""
    return {"pose": ("keypoints",), "obb": ("obb",)}.get(options.task, ())


preparer, writer, verify = functions(Yolo)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "masks", "keypoints", "oriented boxes"),
    read_by=("ultralytics", "supervision", "datumaro"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    needs=needs,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
