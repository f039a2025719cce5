"""Render for CNN's training set of viewpoints: a small picture of each object, named by its viewing angles.

    syn_images_cropped_bkg_overlaid/<synset>/<md5>/    the pictures, each named
        <synset>_<md5>_a<azimuth>_e<elevation>_t<tilt>_d<distance>_<index>_<object>.jpg
    syn_lmdbs/<category>_<split>.txt, all_<split>.txt  a line for each picture: path, class number, azimuth, elevation, tilt
    view_distribution/<category>.txt                   a line for each picture: azimuth, elevation, tilt, distance, not rounded
    truncation_distribution/<category>.txt             a line for each picture: left, top, right, bottom
    synsets.txt                                        synset and name of each class, from number 0
    models.txt                                         md5 and key of each model

A picture is a crop around the object's visible pixels. Angles are whole degrees, the distance whole metres, formatted by `%03d`
(`e-05`). Azimuth 0 faces the model's front and grows counter-clockwise seen from above. Tilt is PASCAL3D+'s theta: the camera's
roll, clockwise seen from behind it, 0 to 359. In the lists, elevation is also 0 to 359 (355 is -5), because the tools read
names so. In view_distribution the tilt has the opposite sign, so that the tools' renderer gives the same pictures (its models
look along +x). A truncation is the offset of the visible pixels' box from the box of the whole model, right and down for each
side, as a share of that box's width and height. Models that reach behind the camera have no truncation.

synset: the twelve categories of PASCAL3D+ have their WordNet numbers (car: 02958343). Others have their name, with `-` for
characters other than plain letters, digits and points. md5: of the model's key. The last two numbers of a name separate
pictures of equal angles; the tools stop reading at the distance. Invisible objects have no picture.

Not stored: the surroundings of objects, masks, cameras, sequences, sensors. The tools render one model without a background and
add one later. These pictures are crops of whole pictures, so other objects may hide a part. Source: H. Su, C. R. Qi, Y. Li, L.
J. Guibas, Render for CNN, ICCV 2015, https://github.com/ShapeNet/RenderForCNN.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator

import numpy as np

from viewsphere.codecs.pictures import encode_picture
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import JPEG_QUALITY, opaque
from viewsphere.formats.shared.writing.refusals import known_views
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.model.sample import ObjectAnnotation, ObjectView, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

PICTURES = "syn_images_cropped_bkg_overlaid"
SYNSETS = {
    "aeroplane": "02691156", "bicycle": "02834778", "boat": "02858304", "bottle": "02876657", "bus": "02924116",
    "car": "02958343", "chair": "03001627", "diningtable": "04379243", "motorbike": "03790512", "sofa": "04256520",
    "train": "04468005", "tvmonitor": "03211117",
}  # fmt: skip


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown viewpoints, and names that the format cannot distinguish."""
    yield from known_views(scope)
    first = dict[str, str]()
    for category in scope.categories:
        other = first.setdefault(_word(category.name), category.name)
        if other != category.name:
            yield f"expected names of categories that differ in letters and digits; found {other!r}, {category.name!r}"


def _word(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9.]", "-", name)


class _RenderForCnn(Tree):
    """The tree of pictures and of their lists."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        self._numbers = {category.name: number for number, category in enumerate(dataset.categories)}

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """The pictures of a sample's objects, and their lines."""
        split = sample.split or "all"
        for o in sample.objects:
            if o.box2d is None:
                continue
            path, name, view = self._path(sample, o), _word(o.category), _rounded(o.view)
            angles = (round(angle) % 360 for angle in (view.azimuth_deg, view.elevation_deg, view.tilt_deg))
            listed = (path, self._numbers[o.category], *angles)
            yield File(path, _cut(sample, o))
            yield line(f"syn_lmdbs/{name}_{split}.txt", *listed)
            yield line(f"syn_lmdbs/all_{split}.txt", *listed)
            seen_from = (view.azimuth_deg % 360, view.elevation_deg, 0.0 - view.tilt_deg, view.distance)
            yield line(f"view_distribution/{name}.txt", *map(float, seen_from))
            if o.box2d_unclipped is not None:
                yield line(f"truncation_distribution/{name}.txt", *_truncation(o.box2d, o.box2d_unclipped))

    def rest(self) -> Iterator[File]:
        """The names of classes and of models."""
        synsets = "".join(f"{_synset(name)} {name}\n" for name in self._numbers)
        yield File("synsets.txt", synsets.encode())
        yield File("models.txt", "".join(f"{_md5(info.key)} {info.key}\n" for info in self.dataset.models).encode())

    def _path(self, sample: Sample, o: ObjectAnnotation) -> str:
        synset, md5, view = _synset(o.category), _md5(o.key), _rounded(o.view)
        turned = f"a{round(view.azimuth_deg) % 360:03}_e{round(view.elevation_deg):03}_t{round(view.tilt_deg) % 360:03}"
        name = f"{synset}_{md5}_{turned}_d{round(view.distance):03}_{sample.index:08}_{o.id}.jpg"
        return f"{PICTURES}/{synset}/{md5}/{name}"


def _rounded(view: ObjectView) -> ObjectView:
    """The view to nine decimal places: the last digits differ between processors, and would change some names."""
    return ObjectView(*(round(value, 9) + 0.0 for value in vars(view).values()))


def _synset(category: str) -> str:
    return SYNSETS.get(category, _word(category))


def _md5(key: str) -> str:
    return hashlib.md5(key.encode(), usedforsecurity=False).hexdigest()


def _cut(sample: Sample, o: ObjectAnnotation) -> Coded:
    """The picture of an object's box."""
    assert o.box2d is not None
    x0, y0, x1, y1 = np.array([*np.floor(o.box2d[:2]), *np.ceil(o.box2d[2:])], int)

    def make() -> bytes:
        return encode_picture(np.ascontiguousarray(opaque(sample.picture)[y0:y1, x0:x1]), "jpeg", JPEG_QUALITY)

    return Coded(sample.index, f"cut {o.id}.jpg", make)


def _truncation(seen: tuple[float, ...], whole: tuple[float, ...]) -> Iterator[float]:
    """The offsets of the sides, right and down, from the sides of the whole box, as shares of its size."""
    width, height = whole[2] - whole[0], whole[3] - whole[1]
    for side, other, size in zip(seen, whole, (width, height, width, height), strict=True):
        yield float((side - other) / size) if size else 0.0


preparer, writer, verify = functions(_RenderForCnn)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("viewpoints", "pictures of objects", "truncations"),
    read_by=("RenderForCNN",),
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
