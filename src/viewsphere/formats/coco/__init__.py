"""COCO instances (https://cocodataset.org/#format-data) with the extra keys of Ruiz et al. 2019.

    annotations/instances_<split>.json; with the annotation captions, captions_<split>.json; with keypoints, these, too
    images/<split>/<image id>.png, images/<split>/MASK/<image id>.png     (_<object id> if frames hold several objects)
    MODELS/<key>/<key>.obj, .glb, ...

Large data sets have numbered sub-folders. Image and annotation ids count from 1 and come from the plan: they do not depend
on what is finished. `Options` say how categories are numbered and where pictures lie. Segmentations are polygons that
pycocotools rasterises to the identical mask, or run lengths. Imported annotations are kept unchanged, except for their ids.

With the annotation keypoints, categories have `keypoints`, the names of all points of their models, and `skeleton`; objects
have `keypoints`, x, y, v of each name, and `num_keypoints`: v is 2 for a visible point, 1 for an occluded one, and 0 for
others, of which x and y are 0. As COCO's annotators gave whole pixels, (0, 0) is the centre of the first one, half a pixel less
than in boxes and polygons; Detectron2 reads them so. They are in the instances file, where trainers look; datumaro looks for
them in files `person_keypoints_<split>.json` only. COCOeval has to be given sigmas for each category (`params.kpt_oks_sigmas`),
as its default ones are of 17 points.

Data sets that were made elsewhere are imported by their folder or by one file: `viewsphere import coco`. A split's annotations
are those of instances files, else of person_keypoints files, else of whatever JSON there is; what image_info files name of
other splits has none, where its pictures are there. Folders of splits, each with labels.json and `data` (FiftyOne) or
_annotations.coco.json (Roboflow), are read, too; a file called so, annotations.json (supervision) or coco_annotations.json
(BlenderProc) alone is `train`. A split's `info`, `licenses` and all that categories say (`keypoints`, `skeleton`) are kept,
and go out again; in a merged data set `info.sources` has what each said, and licences of one id get ids of their own. Pictures
are turned as their EXIF tag says, and kept as PNG without it, unless the width and height in the file are those of the pixels
as they are stored.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere.errors import UserError
from viewsphere.formats.coco.categories import keeps_ids, notes
from viewsphere.formats.coco.entries import Entries, Entry, files, seen
from viewsphere.formats.coco.instances import instances
from viewsphere.formats.coco.options import Options
from viewsphere.formats.coco.proving import verify
from viewsphere.formats.coco.reading import read
from viewsphere.formats.shared.export_files import put
from viewsphere.model.channel import missing
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec

if TYPE_CHECKING:
    from viewsphere.store import Dataset

CHANNELS = ("rgb",)


def preparer(dataset: Dataset, folder: Path, options: Options) -> Callable[[Sample], Entry]:
    """Puts a sample's images and masks in place, and makes its entries of the instances JSON."""
    entries = Entries(dataset, options)

    def prepare(sample: Sample) -> Entry:
        masks = seen(sample)
        for _, name, content in files(dataset, sample, masks, options):
            put(dataset, content, folder / name)
        return entries.of(sample, masks)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None], options: Options) -> Generator[Callable[[Entry], None]]:
    """Write the instances JSON of each split, and models.

    Raises UserError if the data set has no picture: channel `rgb`, or else `rgba`.
    """
    if missing(CHANNELS, dataset.plan.channels):
        raise UserError(f"{dataset.root}: format coco: expected channel rgb, found none: add it to the recipe's channels")
    for line in () if keeps_ids(dataset) else notes(dataset.categories, options):
        note(f"note: {line}")
    with instances(dataset, folder / "annotations", options) as append:
        yield append
    dataset.link_models(folder / "MODELS")


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "masks", "keypoints", "captions", "poses", "3D boxes"),
    read_by=("pycocotools", "torchvision", "datumaro", "supervision", "FiftyOne"),
    options=Options,
    channels=CHANNELS,
    notes=notes,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
