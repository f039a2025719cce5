"""NeRF's synthetic scenes: a file for each split, with one angle of view for all of its pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats.shared.cameras import opengl_pose
from viewsphere.formats.shared.writing.export_files import Coded, Content
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, item
from viewsphere.model.sample import Sample

SPLITS = ("train", "val", "test")


def synthetic_files(sample: Sample, world: str, stem: str) -> Iterator[File | Piece]:
    """A picture and its entry; each file has a section for its split and its angle of view."""
    split, lens = sample.split or SPLITS[0], sample.camera.intrinsics
    yield File(f"{world}/{split}/{stem}.png", _with_alpha(sample))
    entry = {"file_path": f"./{split}/{stem}", "transform_matrix": opengl_pose(sample.camera).tolist()}
    section = f"{split} {2 * math.atan(lens.width / 2 / lens.fx)!r}"
    yield from (item(f"{world}/transforms_{name}.json", entry, section) for name in dict.fromkeys((*SPLITS, split)))


def synthetic_layout(path: str, counts: Mapping[str, int]) -> Layout:
    """A split's frames, or the first split's frames if it has none."""
    sections = [section.rsplit(" ", 1) for section in counts]
    angle = sections[0][1]
    if len({other for _, other in sections}) > 1:
        raise UserError(f"nerfstudio: {path}: expected one lens for all pictures of a world; found several")
    splits, own = [split for split, _ in sections], path.rpartition("transforms_")[2].removesuffix(".json")
    chosen = next(name for name in (own, *SPLITS, *splits) if name in splits)
    return (f'{{"camera_angle_x":{angle},\n"frames":[\n'.encode(), f"{chosen} {angle}", b"\n]}\n")


def _with_alpha(sample: Sample) -> Content:
    """The picture as PNG, with its alpha if that is stored."""
    file = sample.files.get("rgba")
    if "rgba" not in sample.channels:
        return picture(sample, ".png")
    if file and file.endswith(".png"):
        return file
    return Coded(sample.index, "rgba.png", lambda: encode_png(sample.channels["rgba"]))
