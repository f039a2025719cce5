"""Pictures for the page: a frame's colours and its channels in colour, small, as WebP."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from viewsphere.errors import UserError
from viewsphere.labels import Extent, channel_labels, stand_in_for
from viewsphere.labels.disparity import extent as disparity_extent
from viewsphere.labels.match_states import picture as state_colors
from viewsphere.labels.motion_boundaries import COLOR as BOUNDARY
from viewsphere.labels.shared.drawing.depth_colors import extent as depth_extent
from viewsphere.labels.shared.drawing.depth_colors import nearness
from viewsphere.labels.shared.drawing.flow_colors import longest_of
from viewsphere.labels.shared.drawing.flow_colors import picture as flow_colors
from viewsphere.labels.shared.drawing.passes import DRAWINGS, shown_picture
from viewsphere.labels.shared.drawing.passes import picture as pass_colors
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.report.unknown import number

Picture = NDArray[np.uint8]

VIRIDIS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    np.float64,
)
"""Nine even steps of matplotlib's viridis (CC0): equal steps in lightness, also to colour-blind eyes; near is light."""

PART_COLORS = np.array(
    [(68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119), (221, 170, 119)], np.uint8
)


@dataclass(frozen=True)
class Scale:
    """Sizes of a frame's pictures: width in pixels and WebP quality of the colours, width of the other layers; `quick` ones are
    made in a third of the time, and a tenth larger.
    """

    width: int
    quality: int
    layer_width: int
    quick: bool = False


SCALES = (
    Scale(640, 82, 400),
    Scale(560, 80, 320),
    Scale(480, 78, 280),
    Scale(400, 75, 240),
    Scale(320, 70, 200),
    Scale(240, 65, 160),
    Scale(160, 55, 120),
    Scale(112, 45, 96),
)
PROBES = 8
THREADS = 4

Layers = dict[str, Any]

Within = Mapping[str, Mapping[str, Extent]]
"""The value ranges of layers, by the names of sequences and layers."""


def layers_within(
    dataset: Sequence[Sample],
    positions: Sequence[int],
    budget: int,
    progress: Callable[[int], None] | None = None,
    within: Within | None = None,
) -> list[Layers]:
    """The layers of the samples at these positions, at the largest scale that fits into `budget` bytes of text.

    `within` has the value ranges of each sequence's layers, by its name. Only one sample is in memory at a time, since its
    arrays are many times larger than its pictures. The scale is tried on a few frames first. Raises UserError if the smallest
    scale does not fit.
    """
    probes = [positions[i] for i in np.unique(np.linspace(0, len(positions) - 1, PROBES).astype(int))] if positions else []
    for scale in SCALES:
        probed = [_weight(_at(dataset, scale, within or {}, i)) for i in probes]
        if sum(probed) / max(1, len(probed)) * len(positions) > 0.97 * budget:
            continue
        layers_of_frames = list(_all(dataset, positions, scale, progress, within or {}))
        if sum(map(_weight, layers_of_frames)) <= budget:
            return layers_of_frames
    raise UserError(
        f"report: expected pictures of at most {budget / 1e6:.1f} MB, found {len(positions):,} frames that need more: "
        "ask for fewer with --frames"
    )


def _all(
    dataset: Sequence[Sample], positions: Sequence[int], scale: Scale, progress: Callable[[int], None] | None, within: Within
) -> Iterator[Layers]:
    with ThreadPoolExecutor(THREADS) as pool:
        for done, found in enumerate(pool.map(partial(_at, dataset, scale, within), positions), 1):
            if progress is not None:
                progress(done)
            yield found


def _at(dataset: Sequence[Sample], scale: Scale, within: Within, position: int) -> Layers:
    sample = dataset[position]
    return layers(sample, scale, within.get(sample.sequence))


def _weight(found: Mapping[str, Any]) -> int:
    return sum(len(value) for value in found.values() if isinstance(value, str))


def layers(sample: Sample, scale: Scale, within: Mapping[str, Extent] | None = None) -> Layers:
    """The frame's pictures as data URLs, by name, for the channels that it has, and the ranges of numbers: of depth in metres,
    of disparity and of flow in pixels. `within`: the ranges of all the sequence.

    `rgb` is the picture, with alpha where only the picture with alpha is kept; all others are transparent where they have no
    value.
    """
    layers: Layers = {}
    for name in layer_names(sample):
        drawn = layer(sample, name, scale, within)
        layers[name] = "data:image/webp;base64," + base64.b64encode(drawn.webp).decode("ascii")
        if drawn.range is not None:
            layers[f"{name}Range"] = [number(end) for end in drawn.range]
    return layers


@dataclass(frozen=True)
class _Layer:
    """A small picture as lossy WebP, and the value range of its colours, if any."""

    webp: bytes
    range: tuple[float, float] | None = None


Painter = Callable[[Sample, Scale, Mapping[str, Extent]], _Layer]


def layer_names(sample: Sample) -> list[str]:
    """Return the names of the layers that can be drawn of a sample; only the picture's, if a stand-in replaces it."""
    if stand_in_for(sample.channels) is not None:
        return ["rgb"]
    drawable = ({*PAINTERS} - {"rgb", "coordinates"}) & {*sample.channels}
    picture = picture_of(sample.channels)
    drawable = (drawable - {picture}) | {"rgb"} if picture else drawable
    drawable |= {"coordinates"} if {"coordinates", "instances"} <= {*sample.channels} else set()
    return [name for name in PAINTERS if name in drawable]


def layer(sample: Sample, name: str, scale: Scale, within: Mapping[str, Extent] | None = None) -> _Layer:
    """One of a sample's layers, by a name of `layer_names`."""
    return PAINTERS[name](sample, scale, within or {})


def _rgb(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    picture = _shrunk(shown_picture(sample), scale) if picture_of(sample.channels) else scan_picture(sample, scale)
    return _Layer(_webp(picture, scale.quality, method=1 if scale.quick else 4))


SCAN = 640
"""Width of the stand-in for a LiDAR's picture, and its height below the range image."""

LEAST_STRIP = 32
"""Minimum height of its range image."""

NO_RETURN = (16, 18, 24)


def scan_size(sample: Sample) -> tuple[int, int]:
    """Width and height of the stand-in for a LiDAR's picture: its range image, and below it its points from above."""
    return SCAN, SCAN + max(LEAST_STRIP, round(SCAN * sample.height / sample.width))


def scan_picture(sample: Sample, scale: Scale) -> Picture:
    """A LiDAR's range image, with a row for each ring and light near points, and below it a map of its points; (H, W, 3)."""
    paint = stand_in_for(sample.channels)
    assert paint is not None
    width, height = (round(side * min(1.0, scale.width / SCAN)) for side in scan_size(sample))
    rows = sample.channels["lidar"]
    ranges = np.full((sample.height, sample.width), np.inf, np.float32)
    ranges[rows["ring"], rows["column"]] = rows["range"]
    _, _, colors = depth_colors(ranges)
    strip = np.where(colors[..., 3:] > 0, colors[..., :3], np.array(NO_RETURN, np.uint8))
    strip = np.asarray(Image.fromarray(strip).resize((width, height - width), Image.Resampling.NEAREST))
    return np.vstack([strip, paint(sample, width)])


def _depth(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    near, far, picture = depth_colors(_thinned(sample.channels["depth"], scale.layer_width))
    return _Layer(_webp(picture, 75), (near, far))


def _normals(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    return _Layer(_webp(normal_colors(_thinned(sample.channels["normals"], scale.layer_width)), 75))


def _coordinates(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    coordinates, instances = (_thinned(sample.channels[name], scale.layer_width) for name in ("coordinates", "instances"))
    return _Layer(_webp(coordinate_colors(coordinates, instances, sample.objects), 75))


def _parts(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    return _Layer(_webp(_part_colors(_thinned(sample.channels["parts"], scale.layer_width)), 60))


def _materials(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    return _Layer(_webp(_part_colors(_thinned(sample.channels["materials"], scale.layer_width)), 60))


def _body_parts(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    return _Layer(_webp(_part_colors(_thinned(sample.channels["body_parts"], scale.layer_width)), 60))


def _beside(name: str) -> Painter:
    """The painter of a channel that is shown as `preview` shows it, clear where it has no value."""

    def paint(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
        drawing, array = channel_labels()[name].drawing, sample.channels[name]
        picture = drawing and drawing.picture(sample)
        assert picture is not None
        known = np.isfinite(array) if array.ndim == 2 else np.isfinite(array[..., 0])
        thin, shown = _thinned(picture, scale.layer_width), _thinned(known, scale.layer_width)
        return _Layer(_webp(_rgba(thin, shown), 75))

    return paint


def _flow(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    flow = sample.channels["flow"]
    longest = within["flow"][1] if "flow" in within else longest_of(flow)
    thin = _thinned(flow, scale.layer_width)
    return _Layer(_webp(_rgba(flow_colors(thin, longest), np.isfinite(thin[..., 0])), 75), (0, longest))


def _disparity(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    disparity = sample.channels["disparity"]
    far, near = within.get("disparity") or disparity_extent(disparity)
    thin = _thinned(disparity, scale.layer_width)
    known = np.isfinite(thin)
    share = np.clip((np.where(known, thin, far) - far) / max(near - far, 1e-9), 0, 1)
    return _Layer(_webp(_rgba(_viridis(share), known), 75), (near, far))


def _flow_state(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    thin = _thinned(sample.channels["flow_state"], scale.layer_width)
    return _Layer(_webp(_rgba(state_colors(thin), thin < 4), 60))


def _motion_boundaries(sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    lines = _widened(sample.channels["motion_boundaries"] > 0, scale.layer_width)
    return _Layer(_webp(_rgba(np.full((*lines.shape, 3), BOUNDARY, np.uint8), lines), 60))


def _pass(name: str, sample: Sample, scale: Scale, within: Mapping[str, Extent]) -> _Layer:
    return _Layer(_webp(pass_colors(name, _thinned(sample.channels[name], scale.layer_width)), 75))


PAINTERS: dict[str, Painter] = {
    "rgb": _rgb,
    "depth": _depth,
    "normals": _normals,
    "coordinates": _coordinates,
    "nocs": _beside("nocs"),
    "position": _beside("position"),
    "semantic": _beside("semantic"),
    "panoptic": _beside("panoptic"),
    "parts": _parts,
    "materials": _materials,
    "body_parts": _body_parts,
    "flow": _flow,
    "disparity": _disparity,
    "flow_state": _flow_state,
    "motion_boundaries": _motion_boundaries,
    **{name: partial(_pass, name) for name in DRAWINGS},
}


def _widened(lines: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """Lines for a picture of at most this width, thickened so that no pixel of them gets lost."""
    if lines.shape[1] <= width:
        return lines
    size = (width, max(1, round(lines.shape[0] * width / lines.shape[1])))
    return np.asarray(Image.fromarray(lines.astype(np.uint8) * 255).resize(size, Image.Resampling.BOX)) > 0


def _webp(picture: Picture, quality: int, method: int = 4) -> bytes:
    """A picture (H, W, 3 or 4) uint8 as lossy WebP; a greater `method` takes longer for fewer bytes."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "WEBP", quality=quality, method=method, alpha_quality=90)
    return file.getvalue()


def depth_colors(depth: NDArray[np.float32]) -> tuple[float, float, Picture]:
    """Near and far metres, and the depth between them in viridis, near light, (H, W, 4); clear where nothing is hit."""
    near, far = depth_extent(depth)
    return near, far, _rgba(_viridis(nearness(depth, (near, far))), np.isfinite(depth))


def _viridis(share: NDArray[np.floating]) -> Picture:
    """Colours (..., 3) of shares from 0 (dark) to 1 (light)."""
    steps = np.arange(len(VIRIDIS)) / (len(VIRIDIS) - 1)
    return np.stack([np.interp(share, steps, VIRIDIS[:, c]) for c in range(3)], axis=-1).round().astype(np.uint8)


def normal_colors(normals: NDArray[np.float32]) -> Picture:
    """Normals as colours, (H, W, 4): red is right, green up, blue towards the camera."""
    colors = (normals * np.array([1, -1, -1]) * 0.5 + 0.5) * 255
    return _rgba(np.clip(colors, 0, 255).round().astype(np.uint8), np.any(normals != 0, axis=-1))


def coordinate_colors(
    coordinates: NDArray[np.float32], instances: NDArray[np.int32], objects: Sequence[ObjectAnnotation]
) -> Picture:
    """Points as colours within their object's box, (H, W, 4): red left, green back, blue up."""
    colors = np.zeros((*coordinates.shape[:2], 3), np.uint8)
    known = np.zeros(coordinates.shape[:2], bool)
    for o in objects:
        if not o.is_placed:
            continue
        seen = (instances == o.id) & np.isfinite(coordinates).all(axis=-1)
        low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
        share = (coordinates[seen] - low) / np.maximum(high - low, 1e-9)
        colors[seen] = (np.clip(share, 0, 1) * 255).round().astype(np.uint8)
        known |= seen
    return _rgba(colors, known)


def _part_colors(parts: NDArray[np.int32]) -> Picture:
    """A colour for each part id, (H, W, 4); neighbouring ids differ."""
    return _rgba(PART_COLORS[(parts - 1) % len(PART_COLORS)], parts > 0)


def _rgba(colors: Picture, shown: NDArray[np.bool_]) -> Picture:
    return np.dstack([np.where(shown[..., None], colors, 0).astype(np.uint8), shown.astype(np.uint8) * 255])


def _thinned(array: NDArray[Any], width: int) -> NDArray[Any]:
    """Pixels on an even grid, at most `width` in a row; values are never mixed."""
    step = max(1.0, array.shape[1] / width)
    rows, columns = (((np.arange(int(n / step)) + 0.5) * step).astype(int) for n in array.shape[:2])
    return array[rows[:, None], columns]


def _shrunk(picture: Picture, scale: Scale) -> Picture:
    height = max(1, round(picture.shape[0] * scale.width / picture.shape[1]))
    if scale.width >= picture.shape[1]:
        return picture
    way = Image.Resampling.HAMMING if scale.quick else Image.Resampling.LANCZOS
    return np.asarray(Image.fromarray(picture).resize((scale.width, height), way))
