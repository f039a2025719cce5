"""COCO instances (https://cocodataset.org/#format-data) with the extra keys of Ruiz et al. 2019.

    annotations/instances_<split>.json; with the annotation captions, also captions_<split>.json
    images/<split>/<image id>.png, images/<split>/MASK/<image id>.png     (_<object id> if frames hold several objects)
    MODELS/<key>/<key>.obj, .glb, ...

Large data sets have numbered sub-folders. Image and annotation ids count from 1 and follow the plan, not the finished frames.
`Options` select the numbering of categories and the place of pictures. Segmentations are polygons that pycocotools rasterises
to the identical mask, or run lengths. Imported annotations stay unchanged, except for their ids.

With the annotation keypoints, categories have `keypoints`, the names of all points of their models, and `skeleton`. Objects
have `keypoints`, x, y, v for each name, and `num_keypoints`. v is 2 for a visible point, 1 for an occluded point, and 0 for
others, whose x and y are 0. COCO's annotators gave whole pixels, so (0, 0) is the centre of the first pixel, half a pixel less
than in boxes and polygons; Detectron2 reads them so. Keypoints are in the instances file, where trainers look; datumaro reads
them only from `person_keypoints_<split>.json`. Pass sigmas for each category to COCOeval (`params.kpt_oks_sigmas`), because its
default has 17 points.

`viewsphere import coco` imports a folder or one file of another origin. A split's annotations are those of instances files,
else of person_keypoints files, else of any JSON. image_info files of other splits add pictures without annotations, if the
pictures exist. The import also reads folders of splits, each with labels.json and `data` (FiftyOne) or _annotations.coco.json
(Roboflow). Such a file, annotations.json (supervision) or coco_annotations.json (BlenderProc) alone is the split `train`.

The import keeps a split's `info`, `licenses` and all keys of categories (`keypoints`, `skeleton`), and exports write them
again. In a merged data set, `info.sources` holds the `info` of each, and licences that share an id get new ids. Pictures are
rotated by their EXIF tag and stored as PNG without it, unless the file's width and height are those of the stored pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere.formats.coco.categories import CHANNELS, Options, notes
from viewsphere.plugins.format import FormatSpec, Remark

if TYPE_CHECKING:
    from collections.abc import Collection

    from viewsphere.formats.coco.writing import Entry
    from viewsphere.model.sample import Sample
    from viewsphere.store import Dataset
    from viewsphere.store.foreign import ForeignDataset

# Plans read only the options, so each function imports its code when it is called.


def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None], options: Options
) -> AbstractContextManager[Callable[[Entry], None]]:
    """Write the instances JSON of each split, and models."""
    from viewsphere.formats.coco.writing import writer

    return writer(dataset, folder, note, options)


def _preparer(dataset: Dataset, folder: Path, options: Options) -> Callable[[Sample], Entry]:
    """Puts a sample's images and masks in place, and makes its entries of the instances JSON."""
    from viewsphere.formats.coco.writing import preparer

    return preparer(dataset, folder, options)


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: Options) -> Iterator[Remark]:
    """Every fault of an export."""
    from viewsphere.formats.coco.cross_check import verify

    return verify(dataset, folder, sampled, options)


def _read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """A COCO data set from another source."""
    from viewsphere.formats.coco.reading import read

    return read(path, keep_going=keep_going)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "masks", "keypoints", "captions", "poses", "3D boxes"),
    read_by=("pycocotools", "torchvision", "datumaro", "supervision", "FiftyOne"),
    options=Options,
    channels=CHANNELS,
    notes=notes,
    panoramas=True,
    writer=_writer,
    preparer=_preparer,
    verify=_verify,
    read=_read,
)
