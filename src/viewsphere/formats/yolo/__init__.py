"""YOLO, for Ultralytics' trainers: a text file for each picture, a line for each object, numbers as shares of the picture.

    data.yaml                        train, val, test, names; for pose kpt_shape, flip_idx, kpt_names
    images/<split>/<index>.png       the pictures
    labels/<split>/<index>.txt       class, and by task: `detect` centre x, centre y, width, height of the visible pixels'
                                     box; `segment` the mask's polygon; `pose` the box, then x, y, v of each point; `obb` four
                                     corners

Classes count from 0 in the data set's order of categories. `segment`: an object has one ring; lines of no width join its
pieces, as in Ultralytics' own converter. `pose`: v is 2 for a visible point, 1 for an occluded point, 0 for others. One list
joins the points of all models, and each object has its own among them. Invisible objects have no line. Imported objects keep
their own polygons, corners and points.

`viewsphere import yolo` imports a data.yaml of another origin. The count of numbers in a line decides its kind: 4 are a box,
the count that kpt_shape gives a box with points, others a polygon; a polygon of four corners is also an oriented box. Splits
are data.yaml's: folders, or lists of pictures. The path of a picture's labels has `labels` for its last `images`; a picture may
have none. A data.yaml without splits, as supervision writes it, describes `images`, or its folders train, val and test.
Darknet's trees, as datumaro and FiftyOne write them, have obj.names and lists, `<split>.txt`; their labels are next to the
pictures. Source: Ultralytics' documentation, https://docs.ultralytics.com/datasets/.
"""

from __future__ import annotations

from viewsphere.formats.shared.writing.tree import functions
from viewsphere.formats.yolo.reading import read
from viewsphere.formats.yolo.writing import Options, Yolo
from viewsphere.plugins.format import FormatSpec


def _needs(options: Options) -> tuple[str, ...]:
    """Labels on request."""
    return {"pose": ("keypoints",), "obb": ("obb",)}.get(options.task, ())


preparer, writer, verify = functions(Yolo)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "masks", "keypoints", "oriented boxes"),
    read_by=("ultralytics", "supervision", "datumaro"),
    options=Options,
    channels=("rgb",),
    names_credits=False,
    needs=_needs,
    panoramas=True,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
