"""BOP, the benchmark for 6D object pose estimation, for bop_toolkit, BlenderProc's users and pose estimators.

    camera.json, dataset_info.json           the first lens; the model of each object
    models/obj_<object>.ply, models_info.json
    test_targets_bop19.json, test_targets_bop24.json     for the split `test`, if there is one

`scenewise`:

    <split>/<scene>/scene_camera.json, scene_gt.json, scene_gt_info.json, scene_gt_coco.json
    <split>/<scene>/rgb/<image>.png, depth/<image>.png
    <split>/<scene>/mask/<image>_<n>.png, mask_visib/<image>_<n>.png      n: place in the picture's list in scene_gt.json

`imagewise`, and the same files in `webdataset`'s tars:

    <split>/<scene>/<scene>_<image>.rgb.png, .depth.png, .camera.json, .gt.json, .gt_info.json, .mask.json, .mask_visib.json
    <split>/shard-<number>.tar, key_to_shard.json        at most 1,000 pictures each, in the data set's order, not shuffled

Numbers have six digits. A scene holds the pictures of one camera of a sequence, or a thousand still pictures (fewer with more
than ten objects each). Its number is that of its first picture in the data set, and its images count from 0. A scene whose
pictures are in several splits has a part in each. Objects count from 1 in the data set's order of models. Shards are numbered
by thousands of pictures of the whole data set, so a split may lack some numbers.

Models and poses are in millimetres. Models have z up and their origin at their box's centre; cameras look along z, x right, y
down; matrices are row by row. The pixel (0, 0) is the centre of the first pixel, as in BOP's own back-projection: cx and cy are
half a pixel smaller than elsewhere in viewsphere. Depth is along z in steps of depth_scale mm, 16 bits, 0 for none or beyond
its range.

All objects with pixels in the picture are listed, also hidden ones. px_count_all and visib_fract count on a canvas of three
times the picture's width and height. Boxes in scene_gt_info are x, y, and the distance to the last pixel (a pixel less than the
width). Both follow BOP's scripts. These scripts decide visibility by depth with a tolerance; masks here are exact. bbox_obj of
an object that extends beyond the picture may be a pixel off; for an object that reaches behind the camera, it is the box of the
part in the picture. bop_toolkit's mask readers fail on pictures without objects.

`import` reads trees of scenes, also those of other origins, with their models, from the first of `models`, `models_cad`,
`models_reconst`, `models_eval` and `models_fine`. In an export of imported data, objects count from 1 in the order of their
models; objects without a model keep their numbers.

Not stored: colours and parts of models (PLY files have no colours), categories except in dataset_info.json, names of sensors
and sequences, times. Deforming models are refused. There is no models_eval: the toolkit's remesh script creates it. Source:
Hodan et al., BOP: Benchmark for 6D Object Pose Estimation (ECCV 2018), https://bop.felk.cvut.cz, and
https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Literal

from pydantic import Field

from viewsphere.codecs import tar
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.bop.as_recipe import source_cameras
from viewsphere.formats.bop.entries import (
    Entry,
    camera,
    coco,
    depth_file,
    entries,
    facts,
    mask_png,
    ply,
    runs,
    sensor,
    targets,
)
from viewsphere.formats.bop.reading import read
from viewsphere.formats.shared.writing.export_files import Coded, Content
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.refusals import known_cameras, lacking_labels, pinhole
from viewsphere.formats.shared.writing.tree import FOLDER_SIZE, LIST, OBJECT, File, Layout, Piece, Tree, functions, item
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


class _Options(Frozen):
    """The layout of files, and the resolution of depth."""

    layout: Literal["scenewise", "imagewise", "webdataset"] = Field(
        default="scenewise",
        description="`scenewise`: JSON files of whole scenes, a PNG for each mask; `imagewise`: all files of a picture by "
        "themselves, masks as run lengths; `webdataset`: the same in tar shards",
    )
    depth_scale: float = Field(
        default=1.0,
        gt=0,
        le=1000,
        description="millimetres of a step of depth: depth ends at 65,535 of these; many of BOP's own data sets have 0.1",
    )


KINDS = (".png", ".jpg")
SCENE = 1000
"""Numbers of still pictures in a scene, and of pictures in a shard."""


def _needs(options: _Options) -> tuple[str, ...]:
    """The required labels: whole masks, which all layouts contain."""
    return ("amodal",)


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, lenses that K does not describe, and objects without whole masks."""
    yield from lacking_labels(scope, _needs(options))
    yield from known_cameras(scope)
    yield from pinhole(scope)


class Bop(Tree):
    """The tree of a layout."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._options = options
        self._numbers = {key: number for number, key in enumerate(dataset.plan.models, 1)}
        for info in dataset.models:
            if info.step is not None:
                raise UserError(f"bop: expected rigid models; found {info.track or info.key}, which deforms")

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its depth and its objects."""
        scene, image = _place(self.dataset, sample)
        found = entries(sample, self._numbers, self._options.depth_scale)
        match self._options.layout:
            case "scenewise":
                yield from self._scenewise(sample, scene, image, found)
            case "imagewise":
                key = f"{_split(sample)}/{scene:06d}/{scene:06d}_{image:06d}"
                yield from (File(f"{key}.{name}", content) for name, content in self._imagewise(sample, found))
            case "webdataset":
                yield from self._shard(sample, f"{scene:06d}_{image:06d}", found)
        if sample.split == "test":
            yield from (item("test_targets_bop19.json", target) for target in targets(scene, image, found))
            yield item("test_targets_bop24.json", {"im_id": image, "scene_id": scene})

    def _scenewise(self, sample: Sample, scene: int, image: int, found: list[Entry]) -> Iterator[File | Piece]:
        folder, scale = f"{_split(sample)}/{scene:06d}", self._options.depth_scale
        name = f"rgb/{image:06d}{suffix_of(sample, *KINDS)}"
        yield File(f"{folder}/{name}", picture(sample, *KINDS))
        yield File(f"{folder}/depth/{image:06d}.png", depth_file(sample, scale))
        for n, entry in enumerate(found):
            yield File(f"{folder}/mask/{image:06d}_{n:06d}.png", mask_png(entry.mask))
            yield File(f"{folder}/mask_visib/{image:06d}_{n:06d}.png", mask_png(entry.mask_visib))
        yield _member(f"{folder}/scene_camera.json", str(image), camera(sample, scale))
        yield _member(f"{folder}/scene_gt.json", str(image), [entry.pose for entry in found])
        yield _member(f"{folder}/scene_gt_info.json", str(image), [entry.info for entry in found])
        size = {"width": sample.width, "height": sample.height}
        yield item(f"{folder}/scene_gt_coco.json", {"id": image, "file_name": name, **size}, "images")
        ids = [image * self.dataset.plan.most_objects(sample.index) + n for n in range(1, len(found) + 1)]
        for annotation in coco(found, image, ids):
            yield item(f"{folder}/scene_gt_coco.json", annotation, "annotations")

    def _imagewise(self, sample: Sample, found: list[Entry]) -> Iterator[tuple[str, Content]]:
        """Yield each file of a picture: the part of its name after the picture's key, and its content."""
        yield f"rgb{suffix_of(sample, *KINDS)}", picture(sample, *KINDS)
        yield "depth.png", depth_file(sample, self._options.depth_scale)
        yield "camera.json", json_bytes(camera(sample, self._options.depth_scale))
        yield "gt.json", json_bytes([entry.pose for entry in found])
        yield "gt_info.json", json_bytes([entry.info for entry in found])
        yield "mask.json", json_bytes({str(n): runs(entry.mask) for n, entry in enumerate(found)})
        yield "mask_visib.json", json_bytes({str(n): runs(entry.mask_visib) for n, entry in enumerate(found)})

    def _shard(self, sample: Sample, key: str, found: list[Entry]) -> Iterator[Piece]:
        number = sample.index // SCENE
        files = ((name, self._loaded(content)) for name, content in self._imagewise(sample, found))
        data = b"".join(tar.member(f"{key}.{name}", held) for name, held in files)
        yield Piece(f"{_split(sample)}/shard-{number:06d}.tar", data)
        yield _member(f"{_split(sample)}/key_to_shard.json", key, number)

    def _loaded(self, content: Content) -> bytes:
        if isinstance(content, Coded):
            return content.make()
        assert isinstance(content, str | bytes)
        return self.dataset.read(content) if isinstance(content, str) else content

    def rest(self) -> Iterator[File]:
        """The models, and the files about the whole data set."""
        models: dict[str, Any] = {}
        for info in self.dataset.models:
            mesh, number = self.dataset.mesh(info.key), self._numbers[info.key]
            models[str(number)] = facts(info, mesh)
            yield File(f"models/obj_{number:06d}.ply", ply(mesh))
        yield File("models/models_info.json", json_bytes(models))
        names = ("key", "category", "supercategory")
        objects = {str(self._numbers[m.key]): {name: getattr(m, name) for name in names} for m in self.dataset.models}
        yield File("dataset_info.json", json_bytes({"name": self.dataset.name, "objects": objects}))
        if len(self.dataset):
            yield File("camera.json", json_bytes(sensor(self.dataset[0].camera.intrinsics, self._options.depth_scale)))

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """Tars end with two empty blocks."""
        name = path.rpartition("/")[2]
        if name.endswith(".tar"):
            return "", bytes(1024)
        if name == "scene_gt_coco.json":
            known = [{"id": n, "name": str(n), "supercategory": self.dataset.name} for n in self._numbers.values()]
            head = b'{"info":{},"licenses":[],"categories":' + json_bytes(known)
            return head + b',"images":[\n', "images", b'\n],"annotations":[\n', "annotations", b"\n]}\n"
        return LIST if name.startswith("test_targets") else OBJECT


def _split(sample: Sample) -> str:
    return sample.split or "all"


def _place(dataset: Dataset, sample: Sample) -> tuple[int, int]:
    """The numbers of a picture's scene, and of the picture in it."""
    part = dataset.plan.parts[dataset.plan.part_of(sample.index)]
    if sample.sequence and sample.origin is not None:
        return sample.index - sample.instant * part.blocks[0].each, sample.instant
    of = max(1, min(SCENE, FOLDER_SIZE // max(1, part.max_objects)))
    image = (sample.index - part.first) % of
    return sample.index - image, image


preparer, writer, verify = functions(Bop)


def _member(path: str, key: str, value: Any, section: str = "") -> Piece:
    """A key of a JSON object, and its value."""
    return Piece(path, json.dumps(key).encode() + b":" + json_bytes(value), section, b",\n")


FORMAT = FormatSpec(
    about=__doc__,
    holds=("object poses", "visible and whole masks", "depth", "camera poses", "models", "symmetries"),
    read_by=("bop_toolkit", "BlenderProc", "webdataset"),
    options=_Options,
    channels=("rgb", "depth"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
    as_recipe=source_cameras,
)
