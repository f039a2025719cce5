"""nuScenes: tables of scenes, sensors and boxes in the world, with pictures and LiDAR points, for nuscenes-devkit.

    <version>/<table>.json          category, attribute (empty), visibility, instance, sensor, calibrated_sensor, ego_pose, log,
                                    scene, sample, sample_data, sample_annotation, map
    <version>/splits.json           names of the scenes of each split
    samples/<CHANNEL>/<scene>__<CHANNEL>__<instant>.png      pictures; .pcd.bin: points, float32 x y z intensity ring
    maps/<token>.png                an empty map, which the development kit requires

A scene is a sequence, a sample an instant, an instance an object; all samples are key frames. A sensor's channel is CAM_ or
LIDAR_ and its name in capitals, so `front_left` is CAM_FRONT_LEFT. An unnamed sensor is CAM_FRONT, and the only LiDAR
LIDAR_TOP. Tokens are hashes of names, so the same data set has the same tokens. Categories that nuScenes also has use its
spelling (car: vehicle.car); the development kit draws no other boxes. Scenes are numbered from scene-0001 and begin an hour
apart; timestamps are microseconds.

World axes are the data set's, z up. The ego is at the rig's first sensor, with its inclination, and has axes x ahead, y left, z
up. Cameras have x right, y down, z ahead; a LiDAR has x ahead, y left, z up. Lengths are metres; quaternions are w x y z. A box
has the centre of the object's box; `size` is width, length, height; its x axis points ahead. Pixel (0, 0) is the centre of the
first pixel, so K's principal point is half a pixel less than the data set's.

Every object has an annotation at each instant of its presence, visible or not. `num_lidar_pts` and `visibility` measure its
visibility: 1 below 40 %, 2 below 60 %, 3 below 80 %, 4 above. The value comes from the camera that sees most of it; without a
camera, from the LiDAR. Velocities follow from prev and next. Not stored: masks and other maps of pixels, attributes, radar,
roads. Intensities are the data set's, with no fixed maximum; rings count from the highest.

Not verified: the origin of pixels, which nuScenes does not define, and the name and place of splits.json, which newer kits
read. Source: H. Caesar et al., nuScenes: A multimodal dataset for autonomous driving, CVPR 2020;
https://github.com/nutonomy/nuscenes-devkit/blob/master/docs/schema_nuscenes.md.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from itertools import chain

import numpy as np
from pydantic import Field

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.nuscenes.names import LOG, MAP, category_of, modalities, token
from viewsphere.formats.nuscenes.story import Story
from viewsphere.formats.nuscenes.view import KINDS, Record, View, category_record, points, visibilities
from viewsphere.formats.shared.mounting import pointless
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import pinhole, sequences
from viewsphere.formats.shared.writing.timeline import Course, Timeline, unknown_shots
from viewsphere.formats.shared.writing.tree import LIST, File, Layout, Piece, Tree, functions, item
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import CAMERA, Rig
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


class _Options(Frozen):
    """The name of the tables' folder."""

    version: str = Field(
        default="v1.0-mini", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64, description="name of the tables' folder"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: still pictures, distorted lenses, and names that would coincide."""
    yield from sequences(scope)
    yield from unknown_shots(scope)
    yield from pinhole(scope)
    yield from pointless(scope)
    yield from _alike("categories", [(category.name, category_of(category.name)) for category in scope.categories])
    if scope.rig is not None:
        names = (sensor.name for sensor in scope.rig.sensors)
        yield from _alike("sensors", list(zip(names, _channels_of(scope.rig), strict=True)))


class _NuScenes(Tree):
    """The tables and files of a version."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._version = options.version
        self._timeline = Timeline(dataset)
        self._story = lru_cache(maxsize=2)(partial(_story_of, self._timeline))
        shot = next(iter(dataset.shots_of_parts), None)
        self._kinds = {} if shot is None else dict(zip(_channels_of(shot.rig), modalities(shot.rig), strict=True))

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """Yield the files and records of a sensor's sample. The first sensor of an instant also adds the records of the whole
        instant.
        """
        course, (shot, instant, place) = self._timeline.course(sample), self._timeline.position(sample)
        start, story = sample.index - place, self._story(course)
        view, channel = View(sample, shot, instant, place, course, story), _channels_of(shot.rig)[place]
        if self._kinds.get(channel) != view.modality:
            raise UserError(f"nuscenes: expected the sensors {', '.join(self._kinds)} in all sequences; found {channel}")
        yield File(view.file(channel), points(sample) if view.modality == "lidar" else picture(sample, *KINDS))
        yield from self._items(view.of_sensor(channel))
        there = [index for index in range(start, start + course.each) if self._timeline.has(index)]
        if sample.index == there[0]:
            yield from self._items(view.of_instant())
            yield from self._items(view.of_objects([self._at(index) for index in there]))
            for table in ("instance", "sample_annotation"):  # the files exist even without objects
                yield Piece(f"{self._version}/{table}.json", b"", "there")
            if sample.instant == story.instants[0]:
                yield from (item(f"{self._version}/splits.json", view.scene, split or "all") for split in story.splits)

    def rest(self) -> Iterator[File]:
        """The tables that belong to no scene, and the map."""
        log = {"token": LOG, "logfile": self.dataset.name, "vehicle": "", "date_captured": "", "location": ""}
        ground = {"token": MAP, "log_tokens": [LOG], "category": "semantic_prior", "filename": f"maps/{MAP}.png"}
        tables: dict[str, list[Record]] = {
            "category": [category_record(one) for one in self.dataset.categories],
            "attribute": [],
            "visibility": visibilities(),
            "sensor": [
                {"token": token("sensor", name), "channel": name, "modality": kind} for name, kind in self._kinds.items()
            ],
            "log": [log],
            "map": [ground],
        }
        yield from (File(f"{self._version}/{name}.json", json_bytes(rows) + b"\n") for name, rows in tables.items())
        yield File(f"maps/{MAP}.png", encode_png(np.zeros((16, 16), np.uint8)))

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """JSON lists, except for the scenes of each split."""
        if not path.endswith("/splits.json"):
            return LIST
        starts = (f"{mark}\n{json.dumps(name)}:[".encode() for mark, name in zip("{" + "," * len(counts), counts, strict=False))
        lists = ((start, name, b"]") for start, name in zip(starts, counts, strict=True))
        return [*chain.from_iterable(lists), b"\n}\n"]

    def _items(self, rows: Iterable[tuple[str, Record]]) -> Iterator[Piece]:
        return (item(f"{self._version}/{table}.json", row) for table, row in rows)

    def _at(self, index: int) -> Sample:
        row = self.dataset.plan.row_at(index)
        return self.dataset.sample_at(row.key, index - row.first)


preparer, writer, verify = functions(_NuScenes)


def _channels_of(rig: Rig) -> tuple[str, ...]:
    """The channels of a rig's sensors, in the rig's order."""
    lidars = sum(sensor.lidar is not None for sensor in rig.sensors)
    found: list[str] = []
    for sensor in rig.sensors:
        name = re.sub(r"[^A-Z0-9]", "_", sensor.name.upper())
        if sensor.lidar is not None:
            found.append("LIDAR_TOP" if lidars == 1 else f"LIDAR_{name}")
        else:
            found.append("CAM_FRONT" if sensor.name == CAMERA else f"CAM_{name}")
    return tuple(found)


def _alike(what: str, named: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield an error for names that are equal in nuScenes, from pairs of a name and its name there."""
    counts = Counter(own for _, own in named)
    for name in (name for name, count in counts.items() if count > 1):
        found = ", ".join(other for other, own in named if own == name)
        yield f"expected {what} of different names in nuScenes; found {found}, all {name}"


def _story_of(timeline: Timeline, course: Course) -> Story:
    """Return the instants, sensors, objects, lenses and splits of a sequence's finished and chosen samples; reads its shots."""
    sensors, objects = dict[int, list[int]](), dict[int, list[int]]()
    lenses, splits, instants = dict[int, Intrinsics](), dict[str, None](), dict[int, None]()
    for shot in timeline.shots(course):
        for index, place, sensor in shot.samples:
            if not timeline.has(index):
                continue
            now = shot.instants[place]
            if now.index not in instants:
                for thing in shot.objects:
                    if thing.motion.pose_at(place) is not None:
                        objects.setdefault(thing.id, []).append(now.index)
            instants[now.index] = splits[now.split] = None
            sensors.setdefault(sensor, []).append(now.index)
            lenses.setdefault(sensor, shot.camera(place, sensor).intrinsics)
    return Story(tuple(instants), sensors, objects, lenses, tuple(splits))


FORMAT = FormatSpec(
    about=__doc__,
    holds=("3D boxes", "tracks", "camera poses", "calibrations", "LiDAR points"),
    read_by=("nuscenes-devkit",),
    options=_Options,
    channels=("rgb",),
    lidar=True,
    keeps_all_objects=True,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
