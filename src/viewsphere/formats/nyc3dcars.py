"""NYC3DCars: geolocated photographs with their vehicles, as the tables of its database, for pandas or PostGIS.

    images/<split>/<index>.jpg        the pictures
    photos.csv                        id, filename, width, height, focal, k1, k2, t1-t3, r11-r33, lla, test, dataset_id, daytime
    vehicles.csv                      id, pid, x1, y1, x2, y2, occlusion, theta, lla, geom, type_id, object
    vehicle_types.csv                 id, tight_width, tight_length, tight_height, key

The original tables are a PostgreSQL dump. The export writes files with a header and the columns that the original's toolkit
reads. The world's origin lies at `latitude`, `longitude`, `altitude` (WGS 84; altitudes above the ellipsoid), x to the east, y
to the north. Cameras follow Bundler: `r` and `t` transform earth-centred metres to a camera with x right, y up and z backwards;
focal is in pixels, the principal point is the picture's centre, k1 and k2 are 0. Points (lla) and footprints (geom) are text
for PostGIS: `SRID=4326;POINT Z (longitude latitude altitude)`.

A vehicle is an object of any category. x1 to y2 are the box of its visible pixels, as shares of the picture; lla is the centre
of its box's bottom, geom the bottom's corners; theta is the compass bearing of its front, degrees clockwise from north.
occlusion: 0 at most 5 % hidden, 1 at most 50 %, 2 more. Types are the models, with sizes in feet. pid is a photograph's id;
test is true in the split `test`; daytime is empty (unknown in PostgreSQL); dataset_id is 1. `object` (the object's id) and
`key` (the model's) are additional columns. Invisible objects are left out.

Not stored: masks, sequences, and the tilt of vehicles, except in their footprint; view_theta, view_phi and geom of photographs,
whose meaning is not documented. Not verified: grades of occlusion above 0. theta follows from two formulas of the toolkit. Its
detector adds 0.76 m to camera positions, to correct an error of its photographs that this export does not have. Source: K.
Matzen, N. Snavely, NYC3DCars: A Dataset of 3D Vehicles in Geographic Context, ICCV 2013,
https://github.com/kmatzen/nyc3dcars-toolkit.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import known_views, lenses, pinhole
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

AXIS, FLATTENING = 6378137.0, 1 / 298.257223563
OVAL = FLATTENING * (2 - FLATTENING)
STEPS = 8
"""Steps of the search for a latitude, each of which leaves less than a hundredth of the error."""


Float = NDArray[np.float64]

FOOT = 0.3048
OFF = 1e-9
"""Share by which a camera may differ from a centred one with square pixels."""

HEADS = {
    "photos.csv": "id filename width height focal k1 k2 t1 t2 t3 r11 r12 r13 r21 r22 r23 r31 r32 r33 "
    "lla test dataset_id daytime",
    "vehicles.csv": "id pid x1 y1 x2 y2 occlusion theta lla geom type_id object",
    "vehicle_types.csv": "id tight_width tight_length tight_height key",
}


class _Options(Frozen):
    """The position of the world's origin on the globe."""

    latitude: float = Field(default=40.7142, ge=-90, le=90, description="degrees north (default: New York)")
    longitude: float = Field(default=-74.0064, ge=-180, le=180, description="degrees east")
    altitude: float = Field(default=0.0, ge=-1e5, le=1e5, description="metres above the ellipsoid")


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: cameras that Bundler cannot express."""
    yield from known_views(scope)
    yield from pinhole(scope)
    for name, lens in lenses(scope):
        found = lens.fy, lens.skew, lens.cx, lens.cy
        wanted = lens.fx, 0.0, lens.width / 2, lens.height / 2
        if not np.allclose(found, wanted, rtol=0, atol=OFF * lens.width):
            yield f"expected square pixels and a centred camera; found K {lens.K.tolist()} of {name}"


class _Nyc3dCars(Tree):
    """The tables and the pictures."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._types = {info.key: number for number, info in enumerate(dataset.models, 1)}
        at = math.radians(options.latitude), math.radians(options.longitude)
        self._earth_from_world = np.eye(4)
        self._earth_from_world[:3, :3] = _compass(*at)
        self._earth_from_world[:3, 3] = _earth(*at, options.altitude)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its row and the rows of its vehicles."""
        name = f"{self.stem(sample)}.jpg"
        yield File(f"images/{name}", picture(sample, ".jpg"))
        yield _row("photos.csv", self._photo(sample, name))
        for o in sample.objects:
            if o.box2d is not None:
                yield _row("vehicles.csv", [self.dataset.plan.annotation_id(sample.index, o.id), *self._vehicle(sample, o)])

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """A header, then the rows."""
        return (_line(HEADS[path].split()), "")

    def rest(self) -> Iterator[File]:
        """The models as types of vehicles."""
        types = [_line(HEADS["vehicle_types.csv"].split())]
        for info in self.dataset.models:
            width, height, length = (size / FOOT for size in info.size)
            types.append(_line([self._types[info.key], width, length, height, info.key]))
        yield File("vehicle_types.csv", b"".join(types))

    def _photo(self, sample: Sample, name: str) -> Iterator[Any]:
        camera = sample.camera
        turn = product(camera.R, self._earth_from_world[:3, :3].T) * [[1], [-1], [-1]]
        place = transform(self._earth_from_world, camera.center)
        yield from (sample.index + 1, name, sample.width, sample.height, camera.intrinsics.fx, 0.0, 0.0)
        yield from (*(-transform(turn, place)).tolist(), *turn.ravel().tolist(), f"SRID=4326;POINT Z ({_words(place)})")
        yield from ("t" if sample.split == "test" else "f", 1, "")

    def _vehicle(self, sample: Sample, o: ObjectAnnotation) -> Iterator[Any]:
        assert o.box2d is not None
        corners = transform(self._earth_from_world, Box3d(o.box3d).faces["bottom"])
        middle = corners.mean(axis=0)
        latitude, longitude, _ = _globe(middle)
        front = transform(self._earth_from_world[:3, :3], -o.world_from_object[:3, 1])
        east, north, _ = transform(_compass(latitude, longitude).T, front).tolist()
        yield sample.index + 1
        yield from (np.array(o.box2d) / ([sample.width, sample.height] * 2)).tolist()
        yield from (o.occlusion_level, math.degrees(math.atan2(east, north)) % 360)
        yield f"SRID=4326;POINT Z ({_words(middle)})"
        yield f"SRID=4326;POLYGON Z (({', '.join(map(_words, (*corners, corners[0])))}))"
        yield from (self._types[o.key], o.id)


def _row(path: str, values: Iterable[Any]) -> Piece:
    return Piece(path, _line(values))


def _line(values: Iterable[Any]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(values)
    return text.getvalue().encode()


def _words(place: Float) -> str:
    """Longitude, latitude (degrees) and altitude of an earth-centred point."""
    latitude, longitude, altitude = _globe(place)
    return f"{math.degrees(longitude)!r} {math.degrees(latitude)!r} {altitude!r}"


preparer, writer, verify = functions(_Nyc3dCars)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "places on the globe", "footprints", "occlusion", "cameras"),
    read_by=("pandas", "PostGIS"),
    options=_Options,
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)


def _compass(latitude: float, longitude: float) -> Float:
    """The directions east, north and up at a position (radians), as columns of (3, 3)."""
    (s, c), (sl, cl) = (math.sin(latitude), math.cos(latitude)), (math.sin(longitude), math.cos(longitude))
    return np.array([[-sl, -s * cl, c * cl], [cl, -s * sl, c * sl], [0.0, c, s]])


def _earth(latitude: float, longitude: float, altitude: float) -> Float:
    """Earth-centred metres (3,) of a position (radians, metres)."""
    across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
    flat = (across + altitude) * math.cos(latitude)
    return np.array(
        [flat * math.cos(longitude), flat * math.sin(longitude), (across * (1 - OVAL) + altitude) * math.sin(latitude)]
    )


def _globe(place: Float) -> tuple[float, float, float]:
    """Latitude, longitude (radians) and altitude (metres) of an earth-centred point."""
    x, y, z = place.tolist()
    flat = math.hypot(x, y)
    latitude = math.atan2(z, flat * (1 - OVAL))
    for _ in range(STEPS):
        across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
        latitude = math.atan2(z + OVAL * across * math.sin(latitude), flat)
    across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
    s, c = math.sin(latitude), math.cos(latitude)
    return latitude, math.atan2(y, x), flat * c + z * s - across * (1 - OVAL * s * s)
