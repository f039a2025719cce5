"""Pictures for people: a contact sheet of a recipe or a data set, a model from four sides."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate, groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from viewsphere.errors import StoreError
from viewsphere.labels import drawings
from viewsphere.model.camera import Intrinsics
from viewsphere.model.channel import picture_of
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.rig import Rig
from viewsphere.model.sample import Sample
from viewsphere.model.scene import Ground, Scene
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.opening import prepare
from viewsphere.run.stages import Stages
from viewsphere.sampling.camera import looking
from viewsphere.sampling.plan import Plan
from viewsphere.store import Dataset
from viewsphere.store.index import Ranges, length, nth, numbers

Picture = NDArray[np.uint8]

INK = (30, 32, 36)
PAPER = (250, 250, 248)
MARGIN = 8
CAPTION = 18
SIDES = (("front", 0.0), ("left side", 90.0), ("back", 180.0), ("right side", 270.0))


def preview_samples(recipe: Recipe, count: int = 12, width: int = 320) -> Iterator[Sample]:
    """Render `count` frames spread over all models (or scenes) and poses, `width` pixels wide, in memory."""
    planned = prepare(recipe)
    stages = Stages()
    for subject, groups in _spread(planned, count):
        stages.read_ahead(planned, planned.cast(subject))
        stages.check_distances(planned, subject)
        for poses in [[pose] for group in groups for pose in group] if recipe.scene.is_new_each_frame else groups:
            shot = planned.take(subject, poses, stages.box)
            channels = tuple(dict.fromkeys((*shot.channels, picture_of(shot.channels) or "rgb", "depth", "instances")))
            small = shot.model_copy(update=_scaled(shot, width) | {"channels": channels})
            yield from stages.render(small)


def dataset_samples(dataset: Dataset, count: int = 12) -> list[Sample]:
    """`count` frames spread evenly over a data set."""
    picks = np.unique(np.linspace(0, len(dataset) - 1, min(count, len(dataset))).round().astype(int))
    found = [dataset[int(i)] for i in picks]
    return [sample for sample in found if sample.picture_file] or found  # some sensors may keep labels alone


def _spread(planned: Plan, count: int) -> list[tuple[str, list[list[int]]]]:
    """Subjects and their poses, those of one time step together, such that subjects follow in order and poses step through
    the grid; all where there are so few.
    """
    subjects, taken = planned.subjects, planned.rows.taken
    if count >= planned.frames:
        return [(subject, [list(numbers(poses)) for poses in taken(subject)]) for subject in subjects]
    chosen: dict[str, list[int]] = {}
    for i, number in enumerate(np.linspace(0, len(subjects) - 1, count).round().astype(int).tolist()):
        size = sum(map(length, taken(subjects[number])))
        places = chosen.setdefault(subjects[number], [])
        place = int(i * size / count * (1 + 1 / max(count, 1)))
        places.append(next((p % size for p in range(place, place + size) if p % size not in places), place % size))
    return [(subject, _grouped(taken(subject), places)) for subject, places in chosen.items()]


def _grouped(steps: Sequence[Ranges], places: Sequence[int]) -> list[list[int]]:
    """The poses at some places of all time steps' poses, parted where the time step changes."""
    edges = list(accumulate(map(length, steps), initial=0))
    found: list[tuple[int, int]] = []
    for place in places:
        step = bisect_right(edges, place) - 1
        found.append((step, nth(steps[step], place - edges[step])))
    return [[pose for _, pose in group] for _, group in groupby(found, lambda pair: pair[0])]


def _scaled(shot: Shot, width: int) -> dict[str, Any]:
    """The same cameras with narrower pictures, and all channels of each, as a shot's fields."""
    narrow = ({"intrinsics": _narrowed(sensor.intrinsics, width), "channels": None} for sensor in shot.rig.sensors)
    sensors = tuple(sensor.model_copy(update=more) for sensor, more in zip(shot.rig.sensors, narrow, strict=True))
    zooms = ({"intrinsics": now.intrinsics and _narrowed(now.intrinsics, width)} for now in shot.instants)
    instants = tuple(now.model_copy(update=more) for now, more in zip(shot.instants, zooms, strict=True))
    return {"rig": Rig(sensors=sensors), "instants": instants}


def _narrowed(lens: Intrinsics, width: int) -> Intrinsics:
    """The same view at another width; a preview is never wider than its recipe's pictures."""
    k = min(1.0, width / lens.width)
    sizes = {"width": max(1, round(lens.width * k)), "height": max(1, round(lens.height * k))}
    x, y = sizes["width"] / lens.width, sizes["height"] / lens.height
    return lens.model_copy(
        update={
            **sizes,
            "fx": lens.fx * x,
            "cx": lens.cx * x,
            "skew": lens.skew * x,
            "fy": lens.fy * y,
            "cy": lens.cy * y,
        }
    )


def four_sides(spec: ModelSpec, size: int = 320) -> Picture:
    """A model from azimuth 0, 90, 180 and 270 at elevation 15, each view with its name; (H, W, 3) uint8 sRGB.

    The first view shows the front if the model faces -Y, as all labels assume.
    """
    stages = Stages()
    low, high = stages.model(spec).bounds
    radius = float(np.linalg.norm(high - low)) / 2
    focal = 1.6 * size
    distance = radius / math.sin(math.atan(0.5 * size / focal)) * 1.02
    x, y, z = ((low + high) / 2).tolist()
    sides = (
        Viewpoint(index=i, azimuth_deg=a, elevation_deg=15, distance=distance, category=name)
        for i, (name, a) in enumerate(SIDES)
    )
    shot = Shot(
        key=spec.key,
        things=(Thing(id=1, model=spec),),
        rig=Rig.of(Intrinsics(width=size, height=size, fx=focal, fy=focal, cx=size / 2, cy=size / 2)),
        scene=Scene(ground=Ground()),
        instants=tuple(looking(side, (x, y, z), index=side.index) for side in sides),
        channels=("rgb", "instances"),
    )
    tiles = [(s.rgb, f"{s.pose.category} (azimuth {s.pose.azimuth_deg:g})") for s in stages.render(shot)]
    return _sheet(tiles, columns=4)


def contact_sheet(samples: Sequence[Sample], draw: Sequence[str] = (), columns: int = 4, width: int = 320) -> Picture:
    """All samples side by side, with the labels named in `draw` over them, (H, W, 3) uint8 sRGB."""
    return _sheet([(draw_sample(s, draw, width), _caption(s)) for s in samples], columns)


def _caption(sample: Sample) -> str:
    pose, seen = sample.known_pose, sample.objects
    if pose is None:
        return ", ".join(dict.fromkeys(o.category for o in seen)) or "nothing labelled"
    key = f"{seen[0].key}  " if seen else ""
    key += f"{pose.time.seconds:.3g} s  " if pose.time else ""
    return f"{key}az {pose.azimuth_deg:.4g}  el {pose.elevation_deg:.4g}  d {pose.distance:.4g}"


def draw_sample(sample: Sample, draw: Sequence[str] = (), width: int | None = None) -> Picture:
    """One frame with labels as they are drawn (`labels.drawings`): masks, 3D boxes (front face filled) and 2D boxes over the
    picture, depth beside it; (H, W, 3) uint8 sRGB.
    """
    chosen = [drawing for drawing in drawings() if drawing.name in draw]
    if picture_of(sample.channels) is None:
        raise StoreError(
            "preview: expected pictures (rgb or rgba), found a data set that keeps neither: preview its recipe instead"
        )
    rgb = _on_paper(sample.picture)
    for drawing in chosen:
        rgb = drawing.pixels(rgb, sample) if drawing.pixels else rgb
    scale = 1.0 if width is None else min(1.0, width / rgb.shape[1])
    size = (round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
    picture = Image.fromarray(rgb).resize(size, Image.Resampling.LANCZOS) if scale < 1 else Image.fromarray(rgb)
    pen = ImageDraw.Draw(picture, "RGBA")
    for drawing in chosen:
        if drawing.lines:
            drawing.lines(pen, sample, scale)
    others = [Image.fromarray(drawing.beside(sample)) for drawing in chosen if drawing.beside]
    return np.hstack([np.asarray(picture), *(np.asarray(other.resize(size, Image.Resampling.BILINEAR)) for other in others)])


def _on_paper(picture: Picture) -> Picture:
    """The picture, laid over paper's colour where it is transparent."""
    if picture.shape[2] == 3:
        return picture
    sheet, clear = Image.new("RGB", picture.shape[1::-1], PAPER), Image.fromarray(picture)
    sheet.paste(clear, mask=clear)
    return np.asarray(sheet)


def _sheet(tiles: Sequence[tuple[Picture, str]], columns: int) -> Picture:
    """Tiles in rows with captions below, on paper."""
    height, width = (max(t.shape[i] for t, _ in tiles) for i in (0, 1))
    columns = min(columns, len(tiles))
    rows = -(-len(tiles) // columns)
    cell = (width + MARGIN, height + CAPTION + MARGIN)
    sheet = Image.new("RGB", (columns * cell[0] + MARGIN, rows * cell[1] + MARGIN), PAPER)
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=12)
    for i, (tile, caption) in enumerate(tiles):
        x, y = MARGIN + i % columns * cell[0], MARGIN + i // columns * cell[1]
        sheet.paste(Image.fromarray(tile), (x, y))
        pen.text((x + 2, y + height + 2), _fitting(caption, font, width), fill=INK, font=font)
    return np.asarray(sheet)


def _fitting(text: str, font: ImageFont.ImageFont | ImageFont.FreeTypeFont, width: int) -> str:
    while len(text) > 2 and font.getlength(text) > width:
        text = text[:-2] + "…"
    return text
