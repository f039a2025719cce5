"""The table of lenses: each label of each lens on whole scenes, against a caster with the lens's published formula.

`benchmarks/measure_lenses` writes it; `test_lens_table.py` tries it. Lenses come from the registry, formulas and cameras from
the lenses' tests (`published.py`). Labels are those that a data set stores.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from lens_caster import Frame, Scene, Seen, compared, in_turn, mask_box, projected_box, weights
from published import Optics, Published, published
from viewsphere import Dataset, Recipe, generate, plan, plugins
from viewsphere.check.cycles import Compared
from viewsphere.errors import UserError
from viewsphere.geometry.mask import decode_rle
from viewsphere.model.annotations.classes import SKY
from viewsphere.plugins.lens import LensSpec
from viewsphere.run.shots.reconstruct import ViewReconstructor
from viewsphere.run.shots.scenery import Scenery

MODELS = Path(__file__).parents[2] / "shared" / "models"
SIZE = (160, 120)
QUICK = {"name": "raster", "bounces": "off", "ambient_occlusion": "off", "antialias": 1, "shadow_resolution": 64}
MOTION = {"kind": "constant", "velocity": [0.3, -0.9, 0], "spin_deg": [0, 0, 20]}
SLOW = {"kind": "constant", "velocity": [0.04, -0.05, 0], "spin_deg": [0, 0, 20]}


def orbit(azimuth: float, elevation: float, distance: float) -> dict[str, Any]:
    """Two viewpoints beside each other."""
    steps = {
        "azimuth": [azimuth, azimuth + 6],
        "elevation": [elevation, elevation + 2],
        "distance": [distance, 0.97 * distance],
    }
    return {"kind": "orbit", **steps}


SCENES: dict[str, dict[str, Any]] = {
    "street": {
        "models": [
            {"source": "zoo:car", "category": "car", "count": 1, "motion": MOTION},
            {"source": "zoo:bicycle", "category": "bicycle", "count": 1},
        ],
        "scenes": {"count": 1, "objects": 2, "layout": "row"},
        "scene": {"place": "zoo:neighbourhood"},
        "viewpoints": orbit(200, 15, 5),
    },
    "household": {
        "models": [
            {"source": "zoo:chair", "category": "chair", "count": 2},
            {"source": "zoo:post_box", "category": "post box", "count": 1, "motion": MOTION},
            {"source": "zoo:table", "category": "table", "count": 1},
        ],
        "scenes": {"count": 1, "objects": 4, "layout": "scatter"},
        "scene": {"ground": "on"},
        "viewpoints": orbit(200, 20, 2.5),
    },
    "guitar": {
        "models": [{"source": str(MODELS / "misc/acoustic_guitar.glb"), "category": "guitar", "motion": SLOW}],
        "scene": {"ground": "on"},
        "viewpoints": orbit(200, 20, 1.5),
    },
    "sedan": {
        "models": [{"source": str(MODELS / "car/NormalCar2.glb"), "category": "car", "motion": SLOW}],
        "scene": {"ground": "on"},
        "viewpoints": orbit(200, 20, 5),
    },
}
"""Recipes' fields: two scenes of the zoo, and two models that are on some machines."""


def scenes() -> list[str]:
    """The names of the scenes whose files are here."""
    return [name for name, scene in SCENES.items() if all(is_here(model["source"]) for model in scene["models"])]


def is_here(source: str) -> bool:
    """Return whether a model's file exists; the zoo's always do."""
    return source.startswith("zoo:") or Path(source).exists()


CHANNELS = (
    "instances",
    "triangles",
    "semantic",
    "depth",
    "depth_ray",
    "position",
    "coordinates",
    "nocs",
    "barycentrics",
    "normals",
    "normals_geometric",
    "flow",
    "disparity",
)
ANNOTATIONS = ("amodal", "keypoints")
NEEDED = ("instances", "semantic", "triangles", "depth_ray", "normals_geometric")


Kept = dict[tuple[str, int], Scene]
"""Scenes by name and instant, with their casters: the same for all lenses."""


@dataclass
class Cell:
    """A label's comparison: the largest error, in its unit, and the numbers of compared, tied and wrong values."""

    unit: str = ""
    error: float = 0.0
    compared: int = 0
    ties: int = 0
    wrong: int = 0

    def add(self, errors: Any, wrong: int = 0, ties: int = 0, most: float | None = None) -> None:
        """Count differences; those that are no number, or above `most`, are wrong."""
        errors = np.abs(np.asarray(errors, np.float64)).ravel()
        self.compared += len(errors)
        off = ~(errors <= (np.inf if most is None else most))
        self.wrong += wrong + int(off.sum())
        self.ties += ties
        self.error = max(self.error, float(errors[np.isfinite(errors)].max(initial=0.0)))


@dataclass
class Row:
    """A lens's cells by label, and the reasons for refused labels."""

    words: str
    lens: str
    cells: dict[str, Cell] = field(default_factory=dict[str, Cell])
    refused: dict[str, str] = field(default_factory=dict[str, str])
    cycles: dict[str, int] | None = None

    def cell(self, label: str, unit: str = "") -> Cell:
        """The cell of a label, made when it is first named."""
        return self.cells.setdefault(label, Cell(unit))


def lenses() -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Model, words and camera of each lens of the registry that makes pictures."""
    for name, spec in sorted(plugins.loadable(LensSpec).items()):
        if not spec.is_scan and not plugins.is_third_party("lenses", name):
            for words, camera in published(name).cameras.items():
                yield name, words, {"size": SIZE, **camera}


RIGS: tuple[dict[str, Any], ...] = (
    {"kind": "stereo", "baseline": 0.12},
    {"sensors": {"lower": {}, "upper": {"position": [0, -0.12, 0]}}},
)
"""Pairs of sensors, of which a lens with disparity has one."""


def recipe(scene: str, camera: Mapping[str, Any], channels: tuple[str, ...], rig: int | None = None) -> Recipe:
    """A scene in two frames through a lens."""
    return Recipe.model_validate(
        {
            "name": scene,
            **SCENES[scene],
            "time": {"frames": 2, "fps": 5},
            "camera": dict(camera),
            "channels": list(channels),
            "annotations": list(ANNOTATIONS),
            "formats": [],
            "splits": {"by": "sequence", "train": 1},
            "engine": QUICK,
            **({} if rig is None else {"rig": RIGS[rig]}),
        }
    )


def allowed(camera: Mapping[str, Any]) -> tuple[tuple[str, ...], dict[str, str], int | None]:
    """The channels that a lens has, the reasons for those that it refuses, and the rig that disparity needs."""
    kept, refused, pair = list[str](), dict[str, str](), None
    for name in CHANNELS:
        for rig in (0, 1) if name == "disparity" else (None,):
            try:
                plan(recipe("household", camera, tuple(dict.fromkeys((*NEEDED, name))), rig))
            except UserError as error:
                refused[name] = str(error)
            else:
                kept.append(name)
                refused.pop(name, None)
                pair = rig
                break
    return tuple(kept), refused, pair


def against_cycles(dataset: Dataset, counts: dict[str, int] | None) -> dict[str, int] | None:
    """Add the pixels that differ from Cycles' own pass of object ids, at edges and beyond; None for a lens that Blender
    lacks.
    """
    cycles = Compared(dataset)
    beyond = sum(len(list(cycles.differences(sample))) for sample in dataset)
    if not cycles.frames:
        return counts
    new = {"frames": cycles.frames, "edges": cycles.edges, "beyond": cycles.pixels - cycles.edges, "reports": beyond}
    return {key: value + (counts or {}).get(key, 0) for key, value in new.items()}


def row(name: str, words: str, camera: Mapping[str, Any], names: list[str], kept: Kept, *, cycles: bool = False) -> Row:
    """All labels of a lens on scenes; `kept`: scenes that other lenses have seen; `cycles`: also against Blender."""
    made = Row(words, name)
    channels, made.refused, rig = allowed(camera)
    formula = published(name)
    for scene in names:
        with tempfile.TemporaryDirectory() as place:
            generate(recipe(scene, camera, channels, rig), Path(place) / "out", workers=0)
            dataset = Dataset(Path(place) / "out")
            compare(made, formula, dataset, scene, kept)
            if cycles:
                made.cycles = against_cycles(dataset, made.cycles)
    return made


def compare(made: Row, formula: Published, dataset: Dataset, scene: str, kept: Kept) -> None:
    """Count the differences of a data set's labels from the caster's."""
    reconstructor = ViewReconstructor(dataset, Scenery(dataset), {m.key: m for m in dataset.models})
    samples = list(dataset)
    sensors = len(samples) // 2
    for i, sample in enumerate(samples):
        context = reconstructor.context(sample, ())
        assert context is not None
        key = scene, i // sensors
        if key not in kept:
            kept[key] = Scene(snapshot(context.geometry))
        after = samples[i + sensors] if i + sensors < len(samples) else None
        partner = samples[i // sensors * sensors + 1 - i % sensors] if sensors == 2 else None
        Comparison(made, formula, kept[key], sample, after, partner, context).run()


@dataclass(frozen=True)
class Snapshot:
    """The arrays of a geometry that the caster reads, copied: a geometry is overwritten by that of the next instant."""

    poses: np.ndarray
    coordinates: np.ndarray
    triangles: np.ndarray
    triangle_object: np.ndarray
    triangle_class: np.ndarray
    triangle_start: tuple[int, ...]
    vertex_start: tuple[int, ...]
    object_count: int
    ground_z: float | None
    meshes: tuple[Any, ...]


def snapshot(g: Any) -> Snapshot:
    assert not (g.triangle_cutout[: g.triangle_start[-1]] != -1).any() and not len(g.single_sided), "scenes without cut-outs"
    arrays = (getattr(g, name).copy() for name in ("poses", "coordinates", "triangles", "triangle_object", "triangle_class"))
    return Snapshot(*arrays, g.triangle_start, g.vertex_start, g.object_count, g.ground_z, g.meshes)


POSITIONED = 1e-9
"""Pixels by which a projected point may differ."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One sample against the caster."""

    row: Row
    formula: Published
    scene: Scene
    sample: Any
    after: Any
    partner: Any
    context: Any

    @cached_property
    def frame(self) -> Frame:
        """The sample's camera, with the published formula for its lens."""
        return self.frame_of(self.sample)

    def frame_of(self, sample: Any) -> Frame:
        camera = sample.camera
        return Frame(self.scene, optics(self.row.lens, camera.intrinsics), camera.R, camera.t, (camera.width, camera.height))

    def channel(self, name: str) -> np.ndarray:
        """A stored channel, (N,) or (N, components)."""
        array = self.sample.channels[name]
        return array.reshape(-1, *array.shape[2:])

    @cached_property
    def seen(self) -> Seen:
        return compared(self.frame, self.sample.channels)

    @cached_property
    def good(self) -> np.ndarray:
        """Pixels that show a surface on which both agree."""
        return np.flatnonzero((self.seen.triangle >= 0) & ~self.seen.is_tie & ~self.seen.is_wrong)

    @cached_property
    def points(self) -> np.ndarray:
        """Places in the world of the good pixels."""
        origins, directions = self.frame.rays
        return origins[self.good] + self.seen.distance[self.good, None] * directions[self.good]

    @cached_property
    def on(self) -> np.ndarray:
        """Triangles of the good pixels."""
        return self.seen.triangle[self.good]

    @cached_property
    def is_ground(self) -> np.ndarray:
        return self.on == len(self.scene.triangles)

    @cached_property
    def owner(self) -> np.ndarray:
        return np.append(self.scene.owner, 0)[self.on]

    @cached_property
    def of_objects(self) -> np.ndarray:
        """Those of the good pixels that show objects, counted among the good ones."""
        return np.flatnonzero(self.owner > 0)

    @cached_property
    def weights(self) -> np.ndarray:
        """Barycentric weights where the good pixels' rays meet triangles; arbitrary on the ground."""
        return weights(self.points, self.scene.corners[np.where(self.is_ground, 0, self.on)])

    def run(self) -> None:
        """Count all labels."""
        ids = self.row.cell("instances", "px")
        ids.add(np.zeros(len(self.seen.triangle)), int(self.seen.is_wrong.sum()), int(self.seen.is_tie.sum()))
        self.projection()
        for name, compare in PIXELS.items():
            if name in self.sample.files:
                compare(self)
        self.objects()

    def projection(self) -> None:
        """Positions of the seen points, by viewsphere's lens: those of their pixels; and of random points, by the formula."""
        rng = np.random.default_rng(len(self.good))
        points = rng.normal(size=(2000, 3)) * 10 ** rng.uniform(-1, 2, (2000, 1))
        expected = self.frame.optics.pixels(points)
        lens, (width, height) = self.sample.camera.lens, self.frame.size
        inside = ((expected > -0.5 * np.array([width, height])) & (expected < 1.5 * np.array([width, height]))).all(axis=1)
        found = lens.project(points[inside])[0]
        off = found - expected[inside]
        off[:, 0] = in_turn(off[:, 0], self.frame.period)
        self.row.cell("projection", "px").add(np.hypot(*off.T), most=POSITIONED)

    def semantic(self) -> None:
        expected = np.full(len(self.seen.triangle), SKY)
        classes = {o.id: 31 + o.category_id for o in self.sample.objects}
        table = self.scene.geometry.triangle_class
        own = [classes.get(i, 0) for i in range(self.scene.geometry.object_count + 1)]
        expected[self.good] = np.where(self.owner > 0, np.array(own)[self.owner], table[self.on])
        counted = ~self.seen.is_tie & ~self.seen.is_wrong
        self.row.cell("semantic", "px").add(expected[counted] != self.channel("semantic")[counted], most=0)

    def depth(self) -> None:
        z = self.points @ self.frame.R[2] + self.frame.t[2]
        self.row.cell("depth", "m").add(self.share(self.channel("depth")[self.good] - z), most=NUMBERS)

    def share(self, errors: np.ndarray) -> np.ndarray:
        """Errors of places, of those beyond 10 m as at 10 m: float32 stores shares of a distance."""
        scale = np.maximum(1.0, self.seen.distance[self.good] / 10)
        return errors / (scale if errors.ndim == 1 else scale[:, None])

    def depth_ray(self) -> None:
        errors = self.channel("depth_ray")[self.good] - self.seen.distance[self.good]
        self.row.cell("depth_ray", "m").add(self.share(errors), most=NUMBERS)

    def position(self) -> None:
        self.row.cell("position", "m").add(self.share(self.channel("position")[self.good] - self.points), most=NUMBERS)

    @cached_property
    def in_objects(self) -> np.ndarray:
        """The seen points of objects in their objects' axes, by barycentric weights."""
        corners = self.scene.geometry.coordinates[self.scene.triangles[self.on[self.of_objects]]].astype(np.float64)
        return (self.weights[self.of_objects][..., None] * corners).sum(axis=1)

    def coordinates(self) -> None:
        found = self.channel("coordinates")
        self.row.cell("coordinates", "m").add(found[self.good][self.of_objects] - self.in_objects, most=NUMBERS)
        self.is_empty("coordinates", found)

    def is_empty(self, name: str, found: np.ndarray) -> None:
        """Count values of the background, which has none."""
        nothing = np.delete(self.good, self.of_objects)
        self.row.cell(name).add((~np.isnan(found[nothing])).any(axis=1), most=0)

    def nocs(self) -> None:
        g, owner = self.scene.geometry, self.owner[self.of_objects]
        middle, diagonal = np.zeros((g.object_count + 1, 3)), np.ones(g.object_count + 1)
        for i in range(1, g.object_count + 1):
            used = np.unique(self.scene.triangles[self.scene.owner == i])
            low, high = (extreme(g.coordinates[used].astype(np.float64), axis=0) for extreme in (np.min, np.max))
            middle[i], diagonal[i] = (low + high) / 2, np.linalg.norm(high - low)
        expected = 0.5 + (self.in_objects - middle[owner]) / diagonal[owner][:, None]
        found = self.channel("nocs")
        self.row.cell("nocs").add(found[self.good][self.of_objects] - expected, most=NUMBERS)
        self.is_empty("nocs", found)

    def barycentrics(self) -> None:
        found = self.channel("barycentrics")[self.good][self.of_objects].astype(np.float64)
        corners = self.scene.corners[self.on[self.of_objects]]
        thin = np.abs(corners - corners.mean(axis=1, keepdims=True)).max(axis=(1, 2))
        expected = self.weights[self.of_objects][:, 1:] if found.shape[1] == 2 else self.weights[self.of_objects]
        self.row.cell("barycentrics", "m").add((found - expected) * thin[:, None], most=NUMBERS)

    @cached_property
    def facing(self) -> np.ndarray:
        """World normals of the seen triangles, by winding."""
        return self.scene.facing[self.on]

    def normals_geometric(self) -> None:
        away = self.frame.rays[1][self.good]
        towards = self.facing * -np.sign((self.facing * away).sum(axis=1))[:, None]
        errors = self.channel("normals_geometric")[self.good] - towards @ self.frame.R.T
        self.row.cell("normals_geometric").add(np.linalg.norm(errors, axis=1), most=NUMBERS)

    def normals(self) -> None:
        """Vertex normals between the corners, on the visible side; at most perpendicular to the ray."""
        vertices = self.scene.normals[self.scene.triangles[np.where(self.is_ground, 0, self.on)]]
        mean = np.where(self.is_ground[:, None], [0.0, 0.0, 1.0], vertices.sum(axis=1))
        between = np.where(self.is_ground[:, None], [0.0, 0.0, 1.0], (self.weights[..., None] * vertices).sum(axis=1))
        away = self.frame.rays[1][self.good]
        agrees = np.where((mean * self.facing).sum(axis=1) >= 0, 1.0, -1.0)
        side = -np.sign((self.facing * away).sum(axis=1)) * agrees
        bent = between * side[:, None]
        past = np.maximum((bent * away).sum(axis=1), 0.0)
        bent = bent - past[:, None] * away
        length = np.linalg.norm(bent, axis=1)
        clear = length > 1e-3
        errors = self.channel("normals")[self.good][clear] - (bent / length[:, None])[clear] @ self.frame.R.T
        self.row.cell("normals").add(np.linalg.norm(errors, axis=1), most=NUMBERS)

    def flow(self) -> None:
        """Where the seen points are in the next picture, and directions of the sky."""
        if self.after is None:
            return
        later, before = self.frame_of(self.after), {o.id: o.world_from_object for o in self.sample.objects}
        moved = self.points.copy()
        for o in self.after.objects:
            own = self.owner == o.id
            motion = o.world_from_object @ np.linalg.inv(before[o.id])
            moved[own] = self.points[own] @ motion[:3, :3].T + motion[:3, 3]
        found, expected = self.channel("flow"), np.full((len(self.seen.triangle), 2), np.nan)
        expected[self.good] = later.pixels(moved)
        sky = np.flatnonzero((self.seen.triangle < 0) & ~self.seen.is_tie & ~self.seen.is_wrong)
        if not self.formula.is_parallel:
            expected[sky] = later.optics.pixels(self.frame.rays[1][sky] @ later.R.T)
        width, height = self.frame.size
        centres = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1).reshape(-1, 2)
        expected -= centres
        expected[:, 0] = in_turn(expected[:, 0], self.frame.period)
        counted = ~self.seen.is_tie & ~self.seen.is_wrong
        cell = self.row.cell("flow", "px")
        is_none = np.isnan(expected[:, 0])
        cell.add(is_none[counted] != np.isnan(found[counted, 0]), most=0)
        both = counted & ~is_none & ~np.isnan(found[:, 0])
        off = found[both] - expected[both]
        off[:, 0] = in_turn(off[:, 0], self.frame.period)
        cell.add(off / np.maximum(1.0, np.abs(expected[both]) / 10), most=NUMBERS)

    def disparity(self) -> None:
        """The distance between a point's positions in both pictures of the pair."""
        there = self.frame_of(self.partner).pixels(self.points)
        apart = np.hypot(*(self.frame.pixels(self.points) - there).T)
        errors = (self.channel("disparity")[self.good] - apart) / np.maximum(1.0, apart / 10)
        self.row.cell("disparity", "px").add(errors, most=NUMBERS)

    def objects(self) -> None:
        """Count the labels of all objects."""
        ids = np.where(self.seen.is_tie, self.channel("instances"), 0)
        ids[self.good] = self.owner
        ids = ids.reshape(self.sample.channels["instances"].shape)
        for o in self.sample.objects:
            self.boxes(o, ids == o.id)
            self.hidden(o, ids == o.id)
            self.keypoints(o)

    def boxes(self, o: Any, mask: np.ndarray) -> None:
        self.row.cell("mask", "px").add((o.mask != mask).ravel(), most=0)
        tight = mask_box(mask, self.frame.period)
        cell = self.row.cell("box2d", "px")
        if tight is None or o.box2d is None:
            cell.add([float(tight is not o.box2d)], most=0)
        else:
            cell.add(np.subtract(o.box2d, tight), most=0)
        own = self.scene.triangles[self.scene.owner == o.id]
        projected = projected_box(self.frame, self.scene.vertices, own)
        if projected is not None and o.box2d_unclipped is not None:
            off = np.subtract(o.box2d_unclipped, projected)
            off[[0, 2]] = in_turn(off[[0, 2]], self.frame.period)
            size = max(1.0, float(np.abs(projected).max()) / 1000)
            self.row.cell("box2d_projected", "px").add(off / size, most=BENT)

    def hidden(self, o: Any, mask: np.ndarray) -> None:
        """The object alone, on a canvas of three times the picture's width and height."""
        (width, height), caster = self.frame.size, self.scene.alone(o.id)
        across = 0 if self.frame.period else width
        window = (-across, -height, width + across, 2 * height)
        alone = caster.mask(*self.frame.world_rays(window), (3 * height, width + 2 * across))
        inside = alone[height : 2 * height, across : across + width]
        found = decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts)
        self.row.cell("amodal", "px").add((found != inside).ravel(), most=0)
        total = int(alone.sum())
        visibility = mask.sum() / total if total else 0.0
        cell = self.row.cell("visibility")
        cell.add([o.visibility - visibility], most=NUMBERS)
        if total:
            cell.add([o.truncation - (total - inside.sum()) / total], most=NUMBERS)

    def keypoints(self, o: Any) -> None:
        """Positions of named points, and whether surface hides them."""
        named = self.context.placements[o.id - 1].facts.keypoints
        if named is None:
            return
        own = np.array([*named.points.values()])
        places = own @ o.world_from_object[:3, :3].T + o.world_from_object[:3, 3]
        expected, cell = self.frame.pixels(places), self.row.cell("keypoints", "px")
        is_none = np.isnan(expected[:, 0])
        cell.add(is_none != np.isnan(o.keypoints[:, 0]), most=0)
        off = (o.keypoints - expected)[~is_none]
        off[:, 0] = in_turn(off[:, 0], self.frame.period)
        cell.add(off / np.maximum(1.0, np.abs(expected[~is_none]) / 1000), most=POSITIONED)
        self.states(o, places, expected)

    def states(self, o: Any, places: np.ndarray, at: np.ndarray) -> None:
        """0 visible, 1 occluded, 2 outside, 3 behind; surface nearer than a share of the diameter does not hide a point."""
        frame, (width, height) = self.frame, self.frame.size
        centre = -frame.R.T @ frame.t
        begin = np.broadcast_to(centre, places.shape)
        if self.formula.is_parallel:
            begin = places - (places @ frame.R[2] + frame.t[2])[:, None] * frame.R[2]
        distance = np.linalg.norm(places - begin, axis=1)
        slack = 0.05 * (self.context.placements[o.id - 1].facts.diameter or 0.0)
        ends = distance - np.minimum(slack, 0.5 * distance)
        expected = np.full(len(places), 3)
        shown = ~np.isnan(at[:, 0])
        is_in = shown & (at >= 0).all(axis=1) & (at[:, 0] < width) & (at[:, 1] < height)
        expected[shown] = 2
        chosen = np.flatnonzero(is_in)
        directions = (places - begin)[chosen] / distance[chosen, None]
        _, s, clear = self.scene.whole().settled(begin[chosen].copy(), directions)
        expected[chosen] = (s < ends[chosen] * (1 - 1e-9)).astype(int)
        sure = np.ones(len(places), np.bool_)
        sure[chosen] = (clear < ends[chosen]) == (s < ends[chosen])
        wrong = (o.keypoint_states != expected)[sure]
        self.row.cell("keypoint_states").add(wrong, most=0, ties=int((~sure).sum()))


NUMBERS = 1e-5
"""Differences of numbers that count as wrong: ten times the rounding of float32 at 10 m."""
BENT = 1e-2
"""Pixels by which a box of bent edges may differ from the search along them."""

PIXELS = {name: getattr(Comparison, name) for name in CHANNELS if hasattr(Comparison, name)}


@cache
def formula_of(name: str) -> Published:
    return published(name)


@cache
def optics(name: str, intrinsics: Any) -> Optics:
    """The published lens of stored intrinsics."""
    K = np.array([[intrinsics.fx, intrinsics.skew, intrinsics.cx], [0, intrinsics.fy, intrinsics.cy], [0, 0, 1.0]])
    return Optics(formula_of(name), intrinsics.distortion, K)
