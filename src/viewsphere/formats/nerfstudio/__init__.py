"""Posed pictures for radiance fields and Gaussian splatting: `transforms.json` for nerfstudio or instant-ngp, or NeRF's
synthetic scenes.

    <world>/transforms.json                  lenses, poses and files of all pictures; for nerfstudio the names of each split
    <world>/images/<sensor>/<index>.png      the pictures (.exr of light); without <sensor> if there is one
    <world>/depths/<sensor>/<index>.png      depth along z, 16 bits, millimetres; 0 for the background and beyond 65.5 m
    <world>/masks/<sensor>/<index>.png       with `masks`: 255 on objects, 0 for pixels that training leaves out
    <world>/points.ply                       coloured points, pixels of a coarse grid, to initialise splatting

and with `kind: nerf-synthetic`

    <world>/transforms_<split>.json          train, val and test: angle of view and poses
    <world>/<split>/<sensor>/<index>.png     the pictures, with alpha if the data set keeps `rgba`

A world is static while cameras look at it: a sequence, a scene, or a model of still pictures. Only the pictures show moving
objects of a sequence. `transform_matrix` is world_from_camera, (4, 4), with OpenGL's axes: x right, y up, z back. Lengths are
metres, z up. `cx` and `cy` count from the image's corner: a centred camera has half the width. The ray of the first pixel
passes through (0.5, 0.5), in nerfstudio and instant-ngp alike; NeRF's own code uses (0, 0), half a pixel away. Loaders require
the splits train, val and test, so a missing split repeats the world's first split.

Lenses are pinholes, OpenCV's with k1 k2 p1 p2 (for nerfstudio also k3), and its fisheye. For nerfstudio, there are also
EQUIRECTANGULAR, whose depth is along the ray, ORTHOPHOTO and FISHEYE624. nerfstudio scales poses but not orthographic
pictures: train with `--auto-scale-poses False`. NeRF's synthetic scenes have a centred
pinhole, equal in all pictures of a world. `kind: instant-ngp` calls depth `depth_path` and has `aabb_scale` 16; set it to the
size of your scene. The file also gives the first lens for all pictures, because nerfstudio's reader of instant-ngp's files
supports one lens. Data sets whose picture is scene-linear light (`files: {rgb: exr}`) export it as EXR for `kind: instant-ngp`,
which alone reads it. Skew is not supported. `import` reads the folder of one world, or one of its files.

Not verified by running these programs, but read in their code: all of the above. Not verified at all: instant-ngp's depth along
z. Sources: https://docs.nerf.studio/quickstart/data_conventions.html; https://github.com/NVlabs/instant-ngp; Mildenhall et al.,
NeRF, ECCV 2020, https://github.com/bmild/nerf.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from viewsphere.codecs.ply import ply_head
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.nerfstudio.reading import lens_of, name_of, pose_said, read, said_frames, split_of, transforms_files
from viewsphere.formats.nerfstudio.synthetic import SPLITS, synthetic_files, synthetic_layout
from viewsphere.formats.shared.cameras import Rigs, measured_png, opengl_pose, points_of, world_of
from viewsphere.formats.shared.reading.as_recipe import cameras_again, pose_of
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.posed_pictures import camera_of, picture_inside
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import light_exr, picture, suffix_of
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions, item
from viewsphere.geometry.lenses.shared.programs.nerfstudio import own_model
from viewsphere.model.channel import PICTURES, picture_of
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.listed import ListedShot
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset
from viewsphere.store.source_cameras import SourceCameras, refuse_any

SYNTHETIC = "nerf-synthetic"
FISHEYE, STANDARD = ("k1", "k2", "k3", "k4"), ("k1", "k2", "p1", "p2", "k3")
"""Names of coefficients, in OpenCV's order."""

MOST = {"nerfstudio": 5, "instant-ngp": 4, SYNTHETIC: 0}
"""Coefficients of a lens, by the kind of file."""


FOLDERS = ("", "exports/mesh", "exports/poisson", "exports/tsdf", "exports")
"""The folders in which nerfstudio's users put meshes, relative to the folder of transforms.json."""


def _source_cameras(path: Path) -> SourceCameras:
    """Return every camera of a world's folder, or of one of its files. Pictures are required only if the file does not give w
    and h. Raises StoreError if there is no such file, and for a frame that lacks its lens or its pose.
    """
    problems: list[str] = []
    shots: dict[str, ListedShot] = {}
    files = transforms_files(path)
    for file in files:
        for number, said, lists in said_frames(file):
            try:
                shot = _shot(file, said, lists)
                shots.setdefault(shot.image or str(len(shots)), shot)
            except MISTAKES as error:
                problems.append(f"{file}: frame number {number}: {one_line(error)}")
    refuse_any(problems)
    return cameras_again(path, tuple(shots.values()), files[0].parent, FOLDERS, "nerfstudio", "+z")


def _shot(file: Path, said: Mapping[str, Any], lists: Mapping[str, set[str]]) -> ListedShot:
    name, size = name_of(said), (0, 0)
    if not (said.get("w") and said.get("h")):
        _, size = picture_inside(file.parent, name.removeprefix("./"), ".png", ".jpg")
    lens, pose = lens_of(said, size), pose_said(said)
    camera_of(lens, pose)
    return ListedShot(split=split_of(file, name, lists), image=name, world_from_camera=pose_of(pose), camera=lens)


MILLIMETRE = 0.001
POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])


class _Options(Frozen):
    """The program that reads the export, and the pixels used for training."""

    kind: Literal["nerfstudio", "instant-ngp", "nerf-synthetic"] = Field(
        default="nerfstudio", description="whose files: `nerfstudio`, `instant-ngp`, or `nerf-synthetic`, NeRF's own scenes"
    )
    masks: bool = Field(default=False, description="masks of the objects, as nerfstudio leaves out what is around them")


def _needs(options: _Options) -> tuple[str, ...]:
    """Depth and objects on request."""
    depth = () if options.kind == SYNTHETIC else ("depth",)
    return (*depth, "instances") if options.masks else depth


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, and lenses that the files cannot express."""
    if options.masks and options.kind != "nerfstudio":
        yield f"expected masks with kind nerfstudio; found {options.kind}"
    if options.kind != "instant-ngp" and picture_of(scope.channels) == "rgb_linear":
        yield "expected kind: instant-ngp for pictures of scene-linear light, or rgb in channels; found kind: " + options.kind
    yield from refusals.lacking_labels(scope, _needs(options))
    yield from refusals.known_cameras(scope)
    problems = ((name, _lens_problem(lens, options.kind)) for name, lens in refusals.lenses(scope))
    yield from (f"{problem} of {name}" for name, problem in problems if problem)
    if len(models := {_model_of(lens) for lens in dict(refusals.lenses(scope)).values()}) > 1:
        yield f"expected lenses of one model; found {' and '.join(sorted(models))}"


class _Nerfstudio(Tree):
    """A folder for each world."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._options, self._kind = options, options.kind
        self._rigs = Rigs(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its depth, and its entry."""
        lens, now, world = sample.camera.intrinsics, self._rigs.moment(sample), world_of(self.dataset, sample)
        problem = _lens_problem(lens, self._kind)
        if problem:
            raise UserError(f"nerfstudio: frame {sample.index}: {problem}")
        stem = self.stem(sample).partition("/")[2]
        stem = f"{now.folder}/{stem}" if now.folder else stem
        if self._kind == SYNTHETIC:
            yield from synthetic_files(sample, world, stem)
            return
        is_light = picture_of(sample.channels) == "rgb_linear"
        name = f"images/{stem}{'.exr' if is_light else suffix_of(sample, '.png', '.jpg')}"
        yield File(f"{world}/{name}", light_exr(sample) if is_light else picture(sample, ".png", ".jpg"))
        yield File(f"{world}/depths/{stem}.png", measured_png(sample, MILLIMETRE))
        depth = "depth_path" if self._kind == "instant-ngp" else "depth_file_path"
        entry = {"file_path": name, depth: f"depths/{stem}.png", **_said_of(lens, self._kind)}
        entry["transform_matrix"] = opengl_pose(sample.camera).tolist()
        if self._options.masks:
            yield File(f"{world}/masks/{stem}.png", _mask(sample))
            entry["mask_path"] = f"masks/{stem}.png"
        yield item(f"{world}/transforms.json", entry, f"{_model_of(lens)} {self.dataset.plan.part_of(sample.index)}")
        yield item(f"{world}/transforms.json", name, f"split {sample.split}")
        if self._kind == "nerfstudio":
            yield _points(f"{world}/points.ply", sample)

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The header of a file, and its frames."""
        if path.endswith(".ply"):
            return (ply_head(POINT, counts[""]), "")
        if self._kind == SYNTHETIC:
            return synthetic_layout(path, counts)
        lists = [name for name in counts if name.startswith("split ")]
        sections = [name for name in counts if name not in lists]
        model, _, part = sections[0].partition(" ")
        if len(sections) > 1:
            raise UserError(f"nerfstudio: {path}: expected lenses of one kind in a world; found several")
        said: dict[str, Any] = {"camera_model": model, "ply_file_path": "points.ply"}
        usual = self._rigs.usual(int(part))
        if self._kind == "instant-ngp":
            first = {} if usual is None else _said_of(usual.sensors[0].intrinsics, self._kind)
            said = {**first, "aabb_scale": 16, "integer_depth_scale": MILLIMETRE, "enable_depth_loading": True}
            lists = []
        text = json.dumps(said, separators=(",", ":"))[:-1].encode()
        own = [f"split {name}" for name in SPLITS if f"split {name}" in lists]
        named = [(name, f"split {name}" if f"split {name}" in own else own[0]) for name in SPLITS] if own else []
        parts = [part for name, section in named for part in (f',\n"{name}_filenames":['.encode(), section, b"]")]
        return (text, *parts, b',\n"frames":[\n', sections[0], b"\n]}\n")


def _mask(sample: Sample) -> Coded:
    return Coded(sample.index, "objects 255.png", lambda: encode_png((sample.channels["instances"] > 0).astype(np.uint8) * 255))


def _points(path: str, sample: Sample) -> Piece:
    found = points_of(sample)
    rows = np.empty(len(found.world), POINT)
    for name, column in zip(POINT.names or (), (*found.world.T, *found.colors.T), strict=True):
        rows[name] = column
    return Piece(path, rows.tobytes(), count=len(rows))


preparer, writer, verify = functions(_Nerfstudio)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("cameras", "poses", "depth", "masks", "points"),
    pictures=(*PICTURES, "rgb_linear"),
    read_by=("nerfstudio", "instant-ngp", "NeRF", "Gaussian splatting"),
    options=_Options,
    channels=("rgb",),
    panoramas=True,
    parallel_rays=True,
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
    as_recipe=_source_cameras,
)


def _lens_problem(lens: Intrinsics, kind: str) -> str | None:
    """Return the part of a lens that files of this kind cannot express; None for a lens that they can."""
    if lens.skew:
        return f"expected cameras without skew; found {lens.skew:g}"
    if kind == "nerfstudio" and own_model(lens):
        return None
    if lens.lens.opencv is None:
        return f"expected lenses of OpenCV's models; found {lens.lens.name}"
    own = lens.lens.opencv.coefficients
    if own and not MOST[kind]:
        return f"expected pinhole cameras; found {len(own)} coefficients"
    if any(own[MOST[kind] :]):
        return f"expected lenses of at most {MOST[kind]} coefficients; found {len(own)}"
    if kind == SYNTHETIC and (lens.fx, lens.cx, lens.cy) != (lens.fy, lens.width / 2, lens.height / 2):
        found = f"fx {lens.fx:g}, fy {lens.fy:g}, cx {lens.cx:g}, cy {lens.cy:g}"
        return f"expected square pixels and a centred principal point; found {found}"
    return None


def _model_of(lens: Intrinsics) -> str:
    """The name of a lens' model."""
    if own := own_model(lens):
        return own[0]
    return "OPENCV_FISHEYE" if lens.lens.opencv and lens.lens.opencv.is_fisheye else "OPENCV"


def _said_of(lens: Intrinsics, kind: str) -> dict[str, Any]:
    """A lens' numbers by their names: sizes and K in pixels from the corner, and coefficients."""
    said: dict[str, Any] = {"w": lens.width, "h": lens.height, "fl_x": lens.fx, "fl_y": lens.fy, "cx": lens.cx, "cy": lens.cy}
    if model := own_model(lens):
        said |= model[1]
    elif own := lens.lens.opencv:
        said |= dict(zip(FISHEYE if own.is_fisheye else STANDARD, own.coefficients[: MOST[kind]], strict=False))
        if kind == "instant-ngp" and own.is_fisheye:
            said["is_fisheye"] = True
    return said
