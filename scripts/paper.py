"""The pictures of docs/paper.md, made anew from the recipes, those of docs/gallery.md that sheets.py does not make, and
that of docs/materials.md.
"""

from __future__ import annotations

import colorsys
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from viewsphere import Recipe, plugins, render
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels.shared.drawing.colors import PALETTE
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.scene import Background, Finish, Scene
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.distances import Distances
from viewsphere.preview import INK, PAPER, draw_sample
from viewsphere.run.opening import prepare
from viewsphere.run.shots.stages import Stages

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
WIDTH = 1400
GAP = 6
VIRIDIS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
FACE_COLORS = {
    "front": (230, 75, 60),
    "back": (150, 90, 200),
    "left": (50, 130, 220),
    "right": (20, 170, 180),
    "top": (45, 165, 95),
    "bottom": (240, 170, 40),
}

Picture = Any  # (H, W, 3) uint8


@dataclass(frozen=True)
class Pick:
    """A frame of a recipe: its model's number, and a viewpoint; the recipe's nearest viewpoint is taken."""

    model: int
    azimuth: float
    elevation: float
    distance: float


def recipe(name: str, changes: dict[str, Any] | None = None) -> Recipe:
    return Recipe.load(ROOT / "recipes" / f"{name}_poses.yaml", changes)


def frames(made_of: Recipe, picks: Sequence[Pick]) -> list[Sample]:
    """The picked frames of a recipe, rendered in memory."""
    planned, stages = prepare(made_of), Stages()
    views = [planned.pose_list[i] for i in range(planned.poses)]
    table = np.array([(v.azimuth_deg, v.elevation_deg, v.distance) for v in views])
    samples = []
    for pick in picks:
        wanted = (pick.azimuth, pick.elevation, pick.distance)
        pose = int(np.abs(table - wanted).sum(axis=1).argmin())
        if tuple(table[pose]) != wanted:
            raise SystemExit(f"{made_of.name}: expected a pose at {wanted}; the nearest is {tuple(table[pose])}")
        samples += stages.render(planned.take(planned.model_specs[pick.model].key, [pose], stages.box))
    return samples


def save(name: str, picture: Picture, quality: int = 85) -> None:
    file = IMAGES / name
    Image.fromarray(np.asarray(picture)).save(file, quality=quality, optimize=True)
    height, width = picture.shape[:2]
    print(f"{file.relative_to(ROOT)}: {width} x {height}, {file.stat().st_size // 1000} kB")


def grid(tiles: Sequence[Picture], columns: int, width: int = WIDTH) -> Picture:
    """A grid of tiles of one shape, shrunk to a page's width."""
    each = (width - (columns - 1) * GAP) // columns
    height = round(each * tiles[0].shape[0] / tiles[0].shape[1])
    rows = -(-len(tiles) // columns)
    sheet = Image.new("RGB", (columns * (each + GAP) - GAP, rows * (height + GAP) - GAP), PAPER)
    for i, tile in enumerate(tiles):
        small = Image.fromarray(tile).resize((each, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (i % columns * (each + GAP), i // columns * (height + GAP)))
    return np.asarray(sheet)


def crop(picture: Picture, o: ObjectAnnotation, size: tuple[int, int]) -> Picture:
    """The part of a picture around an object, pixel for pixel."""
    assert o.box2d is not None
    height, width = picture.shape[:2]
    x = round((o.box2d[0] + o.box2d[2] - size[0]) / 2)
    y = round((o.box2d[1] + o.box2d[3] - size[1]) / 2)
    x, y = min(max(x, 0), width - size[0]), min(max(y, 0), height - size[1])
    return picture[y : y + size[1], x : x + size[0]]


def titled(picture: Picture, text: str) -> Picture:
    """A picture with a line of text over it."""
    image = Image.fromarray(picture)
    pen, font = ImageDraw.Draw(image, "RGBA"), ImageFont.load_default(size=17)
    pen.rectangle((0, 0, font.getlength(text) + 14, 26), fill=(*PAPER, 215))
    pen.text((7, 3), text, fill=INK, font=font)
    return np.asarray(image)


def bigger(picture: Picture, size: int) -> Picture:
    return np.asarray(Image.fromarray(picture).resize((size, size), Image.Resampling.LANCZOS))


# The five data sets


def strip(name: str, picks: Sequence[Pick], boxes: bool = False) -> None:
    samples = frames(recipe(name), picks)
    save(f"paper_{name}.jpg", grid([draw_sample(s, ["boxes"] if boxes else []) for s in samples], 4))


def car() -> None:
    strip("car", [Pick(0, 35, 20, 5), Pick(13, 90, 5, 5), Pick(26, 150, 30, 5), Pick(39, 325, 10, 5),
                  Pick(52, 215, 15, 5), Pick(65, 0, 0, 7), Pick(78, 300, 45, 7), Pick(97, 60, 90, 5)])  # fmt: skip


def bike() -> None:
    strip("bike", [Pick(0, 40, 20, 4), Pick(1, 80, 0, 4), Pick(2, 120, 20, 4), Pick(3, 300, 20, 4),
                   Pick(4, 260, 0, 6), Pick(5, 220, 20, 4), Pick(1, 0, 0, 4), Pick(3, 60, 20, 8)])  # fmt: skip


def chair() -> None:
    strip("chair", [Pick(0, 30, 20, 4), Pick(1, 60, 10, 4), Pick(2, 140, 30, 4), Pick(3, 20, 40, 4),
                    Pick(4, 110, 20, 4), Pick(5, 40, 10, 4), Pick(0, 90, 0, 5), Pick(3, 150, 80, 4)])  # fmt: skip


def boat() -> None:
    strip("boat", [Pick(0, 40, 10, 7), Pick(1, 120, 20, 7), Pick(3, 300, 30, 7), Pick(4, 60, 20, 7),
                   Pick(5, 90, 0, 7), Pick(6, 210, 20, 7), Pick(8, 150, 40, 8), Pick(9, 30, 60, 7)])  # fmt: skip


def hairdryer() -> None:
    strip("hairdryer", [Pick(0, 0, 10, 2), Pick(1, 40, 30, 2), Pick(2, 80, 10, 2), Pick(3, 120, 30, 2),
                        Pick(4, 60, 10, 2), Pick(5, 160, 10, 2), Pick(0, 100, 30, 3), Pick(3, 20, 10, 4)])  # fmt: skip


# Fig. 1: everything known of one car


def fig1() -> None:
    """The paper's figure: left, model and picture; middle, 3D box and sizes; right, depth, 2D box and mask."""
    pick = Pick(4, 35, 20, 5)
    (sample,) = frames(recipe("car"), [pick])
    channels = ["rgb", "triangles", "normals_geometric"]
    (fine,) = frames(recipe("car", {"channels": channels, "camera.size": [1536, 1536]}), [pick])
    (o,) = sample.objects
    each = (WIDTH - 2 * GAP) // 3
    tiles = [
        titled(bigger(wireframe(fine), each), f"3D model: {o.key}.obj, .glb"),
        titled(box3d_picture(sample, o, each), "3D box: vertices 0-7, named faces"),
        titled(depth_picture(sample, each), "depth, metres along z"),
        titled(bigger(sample.rgb, each), "RGB"),
        facts(sample, o, each),
        titled(mask_picture(sample, o, each), "2D box, mask (RLE and polygon)"),
    ]
    save("paper_fig1.jpg", grid(tiles, 3))


def wireframe(sample: Sample) -> Picture:
    """The exported mesh in clay, triangles outlined."""
    seen = np.asarray(sample.triangles) >= 0
    light = np.clip(np.asarray(sample.normals_geometric) @ np.array([-0.35, -0.75, -0.56]), 0, 1)
    clay = np.where(seen, 120 + 130 * light, 250.0)
    triangles = np.asarray(sample.triangles)
    edge = np.zeros(seen.shape, bool)
    edge[:, 1:] |= triangles[:, 1:] != triangles[:, :-1]
    edge[1:] |= triangles[1:] != triangles[:-1]
    clay[edge] *= 0.62
    return np.repeat(clay.astype(np.uint8)[..., None], 3, axis=2)


def box3d_picture(sample: Sample, o: ObjectAnnotation, size: int) -> Picture:
    scale = size / sample.camera.width
    image = Image.fromarray(bigger(sample.rgb, size))
    pen, small, large = (ImageDraw.Draw(image, "RGBA"), *(ImageFont.load_default(size=s) for s in (15, 18)))
    points = [tuple(p) for p in (o.box3d_pixels * scale).tolist()]
    centre = o.box3d_camera.mean(axis=0)
    for name, face in Box3d.numbered_faces().items():
        middle = o.box3d_camera[list(face)].mean(axis=0)
        if middle @ (middle - centre) < 0:  # the triangle faces the camera
            pen.polygon([points[i] for i in face], fill=(*FACE_COLORS[name], 70))
            x, y = np.mean([points[i] for i in face], axis=0)
            pen.text((x, y), name, fill=(255, 255, 255), font=large, anchor="mm", stroke_width=2, stroke_fill=INK)
    for a, b in Box3d.layout()["edges"]:
        pen.line((points[a], points[b]), fill=(255, 255, 255, 230), width=2)
    middle = np.mean(points, axis=0)
    for i, point in enumerate(points):
        x, y = np.array(point) + 13 * (np.array(point) - middle) / np.linalg.norm(np.array(point) - middle)
        pen.text((x, y), str(i), fill=(255, 255, 255), font=small, anchor="mm", stroke_width=2, stroke_fill=INK)
    return np.asarray(image)


def colored(values: Any) -> Picture:
    """Values in 0..1 as colours, dark to light."""
    at = np.clip(values, 0, 1) * (len(VIRIDIS) - 1)
    channels = [np.interp(at, range(len(VIRIDIS)), [c[i] for c in VIRIDIS]) for i in range(3)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def depth_picture(sample: Sample, size: int) -> Picture:
    """Depth as a picture, near being light, with a scale below."""
    depth = np.asarray(sample.depth)
    near, far = np.floor(depth.min() * 2) / 2, np.ceil(np.percentile(depth[np.isfinite(depth)], 90) * 2) / 2
    picture = colored(1 - (depth - near) / (far - near))
    picture[~np.isfinite(depth)] = 0
    image = Image.fromarray(bigger(picture, size))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(size=15)
    left, right, top = 60, size - 60, size - 44
    bar = np.repeat(colored(1 - np.linspace(0, 1, right - left))[None], 14, axis=0)
    image.paste(Image.fromarray(bar), (left, top))
    pen.rectangle((left - 1, top - 1, right, top + 14), outline=(255, 255, 255))
    for k in range(5):
        at, x = near + k / 4 * (far - near), left + k / 4 * (right - left)
        pen.text(
            (x, top + 18),
            f"{at:.1f} m" + ("+" if k == 4 else ""),
            fill=(255, 255, 255),
            font=font,
            anchor="mt",
            stroke_width=2,
            stroke_fill=INK,
        )
    return np.asarray(image)


def mask_picture(sample: Sample, o: ObjectAnnotation, size: int) -> Picture:
    scale = size / sample.camera.width
    grey = np.asarray(sample.rgb).astype(np.float64)
    mask = np.asarray(o.mask)
    grey[mask] = 0.45 * grey[mask] + 0.55 * np.array(PALETTE[1])
    image = Image.fromarray(bigger(grey.round().astype(np.uint8), size))
    pen, font = ImageDraw.Draw(image, "RGBA"), ImageFont.load_default(size=15)
    for polygon in o.polygons:
        points = [(x * scale, y * scale) for x, y in zip(polygon[::2], polygon[1::2], strict=True)]
        pen.line([*points, points[0]], fill=(255, 255, 255, 255), width=2)
    assert o.box2d is not None
    x0, y0, x1, y1 = (v * scale for v in o.box2d)
    pen.rectangle((x0, y0, x1, y1), outline=PALETTE[0], width=3)
    numbers = ", ".join(f"{v:g}" for v in o.box2d)
    pen.text((x0, y1 + 5), f"[{numbers}], {o.area:,} px", fill=(255, 255, 255), font=font, stroke_width=2, stroke_fill=INK)
    return np.asarray(image)


def facts(sample: Sample, o: ObjectAnnotation, size: int) -> Picture:
    """A picture of the labels in numbers: sizes, pose, matrices."""
    assert o.real_size is not None
    rows = [("category", f"{o.category} ({o.supercategory}), model {o.key}")]
    rows += [("real size", "width {:.2f}, height {:.2f}, length {:.2f} m".format(*o.real_size))]
    rows += [("3D box", "width {:.2f}, height {:.2f}, length {:.2f} m".format(*o.size))]
    view = o.view
    rows += [("pose", f"azimuth {view.azimuth_deg:g}°, elevation {view.elevation_deg:g}°, distance {view.distance:g} m")]
    rows += [("pose category", o.pose_category)]
    rows += [("visible", f"{o.visibility:.0%}; cut off by the border: {o.truncation:.0%}")]
    rows += [("quaternion", ", ".join(f"{v:.3f}" for v in o.quaternion))]
    for i in (1, 7):
        metres, pixels = (", ".join(f"{v:.{n}f}" for v in p[i]) for p, n in ((o.box3d, 2), (o.box3d_pixels, 1)))
        rows += [(f"box vertex {i}", f"({metres}) m, at pixel ({pixels})")]
    image = Image.new("RGB", (size, size), (255, 255, 255))
    pen, bold, font = ImageDraw.Draw(image), ImageFont.load_default(size=16), ImageFont.load_default(size=15)
    y = 16
    for name, text in rows:
        pen.text((16, y), name, fill=(110, 114, 122), font=font)
        pen.text((130, y), text, fill=INK, font=font)
        y += 27
    motion = np.column_stack([sample.camera.R, sample.camera.t])
    for name, matrix in (("K", sample.camera.K), ("[R | t]", motion)):
        y += 12
        pen.text((16, y + 23), name, fill=(110, 114, 122), font=bold)
        for row in matrix:
            for k, value in enumerate(row):
                text = f"{value:.1f}" if name == "K" else f"{round(value, 3) + 0.0:.3f}"
                pen.text((195 + 85 * k, y), text, fill=INK, font=font, anchor="ra")
            y += 23
    return np.asarray(image)


# Fig. 2: place models, choose viewpoints, run


def fig2() -> None:
    made_of = recipe("car")
    side = (WIDTH - 2 * GAP) // 3
    placed = frames(made_of, [Pick(m, 35, 20, 5) for m in (1, 8, 17, 33, 50, 61, 72, 84, 93)])
    models = grid([s.rgb for s in placed], 3, side)
    channels = ["rgb", "depth", "instances", "parts", "normals"]
    (sample,) = frames(recipe("car", {"channels": channels}), [Pick(17, 320, 30, 5)])
    normals = ((np.asarray(sample.normals) * (1, -1, -1) + 1) * 127.5).round().astype(np.uint8)
    labels = [draw_sample(sample, ["boxes", "boxes3d"]), draw_sample(sample, ["masks"]), normals, part_picture(sample)]
    tiles = [bigger(models, side), pose_sphere(made_of, side), bigger(grid(labels, 2, side), side)]
    titles = ["1  models are placed", "2  poses are chosen: 2 x 19 x 72", "3  frames and labels are made"]
    save("paper_fig2.jpg", grid([titled(t, text) for t, text in zip(tiles, titles, strict=True)], 3))


def part_picture(sample: Sample) -> Picture:
    """The picture of the label `parts`, every part in its own colour."""
    parts = np.asarray(sample.parts)
    colors = np.random.default_rng(5).integers(60, 250, (int(parts.max()) + 1, 3)).astype(np.uint8)
    colors[0] = 30
    return colors[parts]


def pose_sphere(made_of: Recipe, size: int) -> Picture:
    """All cameras of a recipe as dots around its first model, seen from outside."""
    planned, stages = prepare(made_of), Stages()
    spec = planned.model_specs[17].model_copy(update={"scale": 3.6})  # twice the car's length, to be visible among the cameras
    lens = Intrinsics(width=2 * size, height=2 * size, fx=3.0 * size, fy=3.0 * size, cx=size, cy=1.24 * size)
    pose = Viewpoint(index=0, azimuth_deg=30, elevation_deg=17, distance=24.5)
    x, y, z = stages.box(spec).mean(axis=0).tolist()
    shot = Shot(
        key="sphere",
        things=(Thing(id=1, model=spec),),
        rig=Rig.single(lens),
        scene=Scene(finish=Finish(background=Background(color=(1.0, 1.0, 1.0)))),
        instants=(looking(pose, (x, y, z), index=0),),
        channels=("rgb", "depth", "instances"),
    )
    (sample,) = stages.render(shot)
    things = (Thing(id=1, model=spec),)
    cameras = Distances(planned, stages.box).cameras(things, range(planned.poses))
    return bigger(_dots(sample, cameras), size)


def _dots(sample: Sample, cameras: Any) -> Picture:
    camera: Camera = sample.camera
    image = Image.fromarray(sample.rgb)
    pen = ImageDraw.Draw(image, "RGBA")
    local = cameras @ camera.R.T + camera.t
    radius = np.linalg.norm(cameras, axis=1)
    pixels = local @ camera.K.T
    pixels = pixels[:, :2] / pixels[:, 2:]
    middle = float(camera.t[2])
    depth = np.asarray(sample.depth)
    for i in np.argsort(-local[:, 2]):
        x, y = pixels[i]
        inside = 0 <= x < camera.width and 0 <= y < camera.height
        if inside and depth[int(y), int(x)] < local[i, 2]:
            continue
        color = PALETTE[1] if radius[i] < radius.mean() else PALETTE[0]
        near = local[i, 2] < middle
        r = 3.2 if near else 2.4
        pen.ellipse((x - r, y - r, x + r, y + r), fill=(*color, 255 if near else 110))
    return np.asarray(image)


# Fig. 3: pictures and masks


def fig3() -> None:
    size = (462, 316)
    tiles = []
    for samples in (
        frames(recipe("bike"), [Pick(2, 80, 0, 4), Pick(3, 60, 20, 4), Pick(1, 300, 20, 4)]),
        frames(recipe("hairdryer"), [Pick(0, 80, 10, 2), Pick(2, 40, 30, 2), Pick(5, 60, 30, 2)]),
    ):
        tiles += [crop(s.rgb, s.objects[0], size) for s in samples]
        masks = [np.repeat(np.where(s.objects[0].mask, 255, 0).astype(np.uint8)[..., None], 3, axis=2) for s in samples]
        tiles += [crop(m, s.objects[0], size) for m, s in zip(masks, samples, strict=True)]
    save("paper_fig3.jpg", grid(tiles, 3, 3 * size[0] + 2 * GAP), quality=80)


# Places, distractors (company), billboards (planes)

STREET = {
    "models[0].scale": "as_is",
    "viewpoints.azimuth": {"start": 0, "stop": 350, "step": 10},
    "viewpoints.elevation": [8, 15, 40],
    "viewpoints.distance": [9, 12, 16],
    "camera": {"size": [640, 480], "fov_deg": 40},
}


def street() -> None:
    """Cars on the road of a neighbourhood, partly hidden by its objects; below, the labels."""
    place = {"source": "zoo:neighbourhood"}
    samples = []
    for pick, scene in (
        (Pick(17, 120, 8, 9), {"place": place}),
        (Pick(61, 300, 15, 12), {"place": place, "company": 1}),
        (Pick(39, 20, 40, 16), {"place": place, "company": 2}),
        (Pick(8, 60, 15, 16), {"place": {**place, "labels": "own"}}),
    ):
        samples += frames(recipe("car", {**STREET, "scene": scene}), [pick])
    save("paper_street.jpg", grid([s.rgb for s in samples] + [labelled(s) for s in samples], 4))


def labelled(sample: Sample) -> Picture:
    """Masks and boxes of the models, other labelled objects tinted; the title gives the models' visibility."""
    first = [o for o in sample.objects if o.category == sample.objects[0].category]
    grey = np.repeat(np.asarray(Image.fromarray(sample.rgb).convert("L"))[..., None], 3, axis=2)
    others = [o for o in sample.objects if o.category != first[0].category and o.area]
    categories = list(dict.fromkeys(o.category for o in others))
    for o in others:
        hue = (categories.index(o.category) + 1) * 0.618 % 1
        color = 255 * np.array(colorsys.hsv_to_rgb(hue, 0.75, 0.95))
        grey[o.mask] = (0.5 * grey[o.mask] + 0.5 * color).astype(np.uint8)
    shown = replace(sample, objects=tuple(first), channels={"rgb": grey})
    picture = draw_sample(shown, ["masks", "boxes"])
    seen = ", ".join(f"{o.visibility:.0%}" for o in first if o.area)
    return titled(picture, f"visible: {seen}" + (f"; {len(categories) + 1} categories" if others else ""))


def chairs() -> None:
    """Two or three chairs in one picture, and chairs before billboards."""
    plane = {"image": str(IMAGES / "zoo_neighbourhood.jpg"), "height": 1.3, "at": [0.1, 1.0, 10]}
    samples = []
    for pick, changes in (
        (Pick(0, 30, 20, 4), {"scene.company": 1}),
        (Pick(2, 150, 10, 5), {"scene.company": 1}),
        (Pick(1, 20, 30, 5), {"scene.company": {"count": 2, "layout": "row"}, "splits.by": "frame"}),
        (Pick(5, 10, 10, 5), {"scene.planes": plane}),
    ):
        samples += frames(recipe("chair", changes), [pick])
    save("paper_chairs.jpg", grid([s.rgb for s in samples] + [labelled(s) for s in samples], 4))


# The gallery


FURNITURE = ("table", "sofa", "bed", "shelf", "cabinet", "lamp", "refrigerator", "television", "rug")


def family(
    name: str, azimuth: float = 35, fill: float = 0.85, elevation: float = 15, width: int = WIDTH, quality: int = 85
) -> None:
    """Twenty draws of a family."""
    made_of = Recipe(
        name=name,
        models=[{"source": f"zoo:{name}", "count": 20}],
        viewpoints={"azimuth": azimuth, "elevation": elevation, "distance": {"fill": fill}},
        camera={"size": [320, 240], "fov_deg": 30},
        scene={"ground": "on"},
    )
    save(f"zoo_{name}.jpg", grid([s.rgb for s in render(made_of)], 5, width), quality)


def neighbourhood() -> None:
    """Cars on six streets."""
    picks = [Pick(17, 40, 8, 9), Pick(61, 280, 8, 9), Pick(39, 190, 15, 12),
             Pick(8, 330, 40, 16), Pick(50, 60, 8, 9), Pick(84, 140, 40, 9)]  # fmt: skip
    samples = frames(recipe("car", {**STREET, "scene": {"place": "zoo:neighbourhood"}}), picks)
    save("zoo_neighbourhood.jpg", grid([s.rgb for s in samples], 3, 1276))


def place(name: str, model: str, distance: tuple[float, float], elevation: float, fov: float, exposure: float) -> None:
    """A model in six draws of a place, from where it is seen."""
    tiles: list[Any] = []
    for seed in range(6):
        made_of = Recipe(
            name=name,
            seed=seed,
            models=[{"source": model}],
            viewpoints={"kind": "sphere", "count": 1, "elevation": elevation, "distance": distance},
            min_visibility=0.5,
            camera={"size": [480, 320], "fov_deg": fov},
            scene={
                "place": f"zoo:{name}",
                "sky": {"daylight": {"turbidity": 2.5}},
                "sun": {"azimuth": 60, "elevation": 38},
                "view": {"exposure": exposure, "transform": "filmic"},
            },
        )
        tiles.append(next(iter(render(made_of))).rgb)
    save(f"zoo_{name}.jpg", grid(tiles, 3, 1440), 80)


def conditions() -> None:
    """Each place under four conditions: one shot a row, whose labels are the same in all."""
    low, high = {"azimuth": 60, "elevation": 14}, {"azimuth": 75, "elevation": 42}
    day: dict[str, Any] = {"sky": {"daylight": {"turbidity": 2.5}}}
    out = {"morning": {"sun": low}, "rain": {"rain": 30}, "fog": {"fog": 60}, "night": {"sky": "night", "sun": "auto"}}
    clouds = {"sky": {"daylight": {"clouds": 1}}}
    rooms = {"morning": {"sun": low}, "noon": {"sun": high}, "overcast": clouds, "night": out["night"]}
    tiles: list[Any] = []
    for name, model, distance, elevation, changes in (
        ("neighbourhood", "zoo:car", 9.0, 12.0, out),
        ("town", "zoo:car", 10.0, 11.0, out),
        ("room", "zoo:chair", 2.0, 14.0, rooms),
        ("flat", "zoo:chair", 2.0, 14.0, rooms),
        ("table_top", "zoo:mug", 0.55, 28.0, rooms),
    ):
        made_of = Recipe(
            name=name,
            seed=4,
            models=[{"source": model}],
            viewpoints={"kind": "sphere", "count": 1, "elevation": elevation, "distance": distance},
            min_visibility=0.5,
            camera={"size": [480, 320], "fov_deg": 62 if changes is out else 80},
            scene={"place": f"zoo:{name}", "sun": high, **day},
            variations=changes,
        )
        tiles += [titled(sample.rgb, f"{name}, {sample.variation}") for sample in render(made_of)]
    save("conditions.jpg", grid(tiles, 4, 1440), 80)


def engines() -> None:
    """Five chairs by the raster engine and by Cycles, whose Python VIEWSPHERE_BLENDER_PYTHON names; one row an engine."""
    picks = [Pick(0, 30, 20, 4), Pick(1, 60, 10, 4), Pick(2, 140, 30, 4), Pick(3, 20, 40, 4), Pick(4, 110, 20, 4)]
    camera = {"size": [128, 128], "fov_deg": 19}
    tiles = []
    for engine in ("raster", {"name": "cycles", "quality": "draft"}, {"name": "cycles", "quality": "final"}):
        samples = frames(recipe("chair", {"camera": camera, "engine": engine}), picks)
        tiles.append(np.concatenate([s.rgb for s in samples], axis=1))
    save("cycles_chairs.jpg", np.concatenate(tiles).repeat(2, axis=0).repeat(2, axis=1))


def materials() -> None:
    """Each material as the ground under a chair, and as what a chair on a floor of slabs is made of, three materials a row."""
    tiles = []
    for name in plugins.names("materials"):
        for scene in ({"ground": {"material": name}}, {"ground": "on", "materials": [{"texture": name}]}):
            made_of = Recipe(
                name="materials",
                seed=7,
                models=[{"source": "zoo:chair"}],
                viewpoints={"azimuth": 30, "elevation": 22, "distance": {"fill": 0.85}},
                camera={"size": [320, 240], "fov_deg": 30},
                scene={"sun": {"azimuth": 100, "elevation": 55}, **scene},
            )
            picture = Image.fromarray(next(iter(render(made_of))).rgb)
            if len(tiles) % 2 == 0:
                ImageDraw.Draw(picture).text((8, 6), name, fill="white", stroke_width=2, stroke_fill="black", font_size=22)
            tiles.append(np.asarray(picture))
    save("materials.jpg", grid(tiles, 6))


HOUSEHOLD = ("mug", "bottle", "bowl", "can", "plate", "book", "box", "laptop", "monitor", "plant")

PICTURES: dict[str, Callable[[], None]] = {
    **{
        f.__name__: f
        for f in (
            *(neighbourhood, car, bike, chair, boat, hairdryer, fig1, fig2, fig3),
            *(street, chairs, engines, materials, conditions),
        )
    },
    "zoo_car": partial(family, "car"),
    "zoo_bicycle": partial(family, "bicycle", 50),
    "zoo_chair": partial(family, "chair"),
    "zoo_boat": partial(family, "boat", fill=0.65),
    "zoo_hair_drier": partial(family, "hair_drier", 50),
    **{f"zoo_{name}": partial(family, name, width=1200, quality=68) for name in FURNITURE},
    **{f"zoo_{name}": partial(family, name, elevation=25, width=940) for name in HOUSEHOLD},
    "zoo_bus": partial(family, "bus", 40, width=960),
    "zoo_truck": partial(family, "truck", 320, width=940),
    "zoo_motorcycle": partial(family, "motorcycle", 60, width=860),
    "zoo_traffic_light": partial(family, "traffic_light", 25, width=900),
    "zoo_traffic_cone": partial(family, "traffic_cone", 30, width=800, elevation=25),
    "zoo_bollard": partial(family, "bollard", 30, width=800, elevation=25),
    "zoo_backpack": partial(family, "backpack", 310, width=900, elevation=20),
    "zoo_shop": partial(family, "shop", 30, width=1000),
    "zoo_fountain": partial(family, "fountain", 20, width=900, elevation=22),
    "zoo_person": partial(family, "person", 25),
    "zoo_town": partial(place, "town", "zoo:car", (9.0, 12.0), 11.0, 60.0, 0.3),
    "zoo_room": partial(place, "room", "zoo:chair", (1.3, 2.2), 14.0, 85.0, 3.5),
    "zoo_table_top": partial(place, "table_top", "zoo:mug", (0.5, 0.6), 28.0, 65.0, 3.8),
}
"""The function that makes each picture; the pictures on the chairs' billboards come first."""


def main() -> None:
    wanted = sys.argv[1:] or list(PICTURES)
    for name in wanted:
        if name not in PICTURES:
            raise SystemExit(f"expected pictures of {', '.join(PICTURES)}; found {name}")
        PICTURES[name]()


if __name__ == "__main__":
    main()
