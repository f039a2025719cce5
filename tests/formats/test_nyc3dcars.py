"""NYC3DCars, read by csv and checked by its toolkit's formulas: globe to camera to pixels, and types turned by bearings."""

from __future__ import annotations

import csv
import math
import re
import sqlite3

import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.run.exports.exporting import export
from worlds import MODELS
from worlds import poses as poses_recipe

NEW_YORK = (40.7142, -74.0064, 0)


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("nyc3dcars")
    export(stills.root, "nyc3dcars", output=place)
    return place / "nyc3dcars"


def table(folder, name):
    with (folder / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def ecef(latitude, longitude, altitude):
    """The formula of every book, degrees; latitudes are found back by inverting it, here by nobody."""
    a, b = 6378137.0, 6356752.314245179
    phi, lam = np.radians([latitude, longitude])
    n = a * a / np.hypot(a * np.cos(phi), b * np.sin(phi))
    flat = (n + altitude) * np.cos(phi)
    return np.array([flat * np.cos(lam), flat * np.sin(lam), (b * b / (a * a) * n + altitude) * np.sin(phi)])


def enu(latitude, longitude):
    """East, north, up by small steps on the globe."""
    here, step = ecef(latitude, longitude, 0), 1e-4
    east = ecef(latitude, longitude + step, 0) - ecef(latitude, longitude - step, 0)
    north = ecef(latitude + step, longitude, 0) - ecef(latitude - step, longitude, 0)
    up = ecef(latitude, longitude, 1) - here
    return np.stack([one / np.linalg.norm(one) for one in (east, north, up)], axis=1)


def points(text):
    """The points of PostGIS' extended text, (N, 3) latitude, longitude, altitude."""
    numbers = re.fullmatch(r"SRID=4326;(?:POINT|POLYGON) Z \(+(.*?)\)+", text)[1]
    found = np.array([one.split() for one in numbers.split(",")], float)
    return found[:, [1, 0, 2]]


def camera(photo):
    R = np.array([[float(photo[f"r{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)])
    return R, np.array([float(photo[f"t{i}"]) for i in (1, 2, 3)])


def pixels(photo, place):
    """Bundler's camera, as detect.py inverts it: rays ((x - w/2) / f, (h/2 - y) / f, -1)."""
    R, t = camera(photo)
    x, y, z = R @ place + t
    focal, width, height = (float(photo[name]) for name in ("focal", "width", "height"))
    return np.array([width / 2 + focal * x / -z, height / 2 - focal * y / -z])


def test_footprints_are_seen_where_the_boxes_are(stills, written):
    photos, vehicles, types = (table(written, name) for name in ("photos", "vehicles", "vehicle_types"))
    sizes = {row["id"]: row for row in types}
    known = {row["id"]: row for row in photos}
    assert len({row["id"] for row in vehicles}) == len(vehicles) == sum(1 for s in stills for o in s.objects if o.box2d)
    for row in vehicles:
        photo = known[row["pid"]]
        sample = stills[int(photo["id"]) - 1]
        o = next(o for o in sample.objects if o.id == int(row["object"]))
        box = np.array([float(row[name]) for name in ("x1", "y1", "x2", "y2")]) * [160, 120, 160, 120]
        close("nyc3dcars", "csv: boxes", box, o.box2d, "px", atol=1e-9)
        assert int(row["occlusion"]) == o.occlusion_level
        ring = points(row["geom"])
        equal("nyc3dcars", "csv: rings are closed", ring[0], ring[-1])
        for corner, expected, ahead in zip(ring[:4], o.box3d_pixels[:4], o.box3d_in_front[:4], strict=True):
            if ahead:
                found = pixels(photo, ecef(*corner))
                close("nyc3dcars", "Bundler's camera: footprints", found, expected, "px", atol=1e-3)
        (place,) = points(row["lla"])
        axes, size = enu(*place[:2]), sizes[row["type_id"]]
        assert size["key"] == o.key
        found = np.array([axes.T @ (ecef(*corner) - ecef(*place)) for corner in ring[:4]])
        half = [float(size[name]) * 0.3048 / 2 for name in ("tight_width", "tight_length")]
        angle = math.pi - math.radians(float(row["theta"]))  # world_angle, of gen_results.py
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        expected = sorted((turn @ np.multiply(half, signs)).tolist() for signs in ((1, 1), (1, -1), (-1, -1), (-1, 1)))
        close("nyc3dcars", "detect.py: types turned", sorted(found[:, :2].tolist()), expected, "m", atol=1e-4)
        travel = angle - math.pi / 2  # scores.py compares this with the way of the street
        front = axes[:, :2] @ [math.cos(travel), math.sin(travel)]
        seen = pixels(photo, ecef(*place) + front * 0.2)
        forward = o.world_from_object[:3, :3] @ [0, -0.2, 0] + o.box3d[:4].mean(axis=0)
        projected = sample.camera.P @ [*forward, 1]
        close("nyc3dcars", "scores.py: front", seen, projected[:2] / projected[2], "px", atol=1e-2)


def test_photographs(stills, written):
    for row, sample in zip(table(written, "photos"), stills, strict=True):
        assert row["filename"] == f"{sample.split}/{sample.index:08d}.jpg"
        assert row["test"] == ("t" if sample.split == "test" else "f") and row["daytime"] == ""
        assert Image.open(written / "images" / row["filename"]).size == (160, 120)
        R, t = camera(row)
        close("nyc3dcars", "Bundler's camera: rotations", R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0
        (place,) = points(row["lla"])
        close("nyc3dcars", "csv: camera positions", ecef(*place), -R.T @ t, "m", atol=1e-6)
        local = enu(*NEW_YORK[:2]).T @ (ecef(*place) - ecef(*NEW_YORK))
        close("nyc3dcars", "csv: camera positions in the world", local, sample.camera.center, "m", atol=1e-6)


def test_tables_go_into_a_database(written):
    base = sqlite3.connect(":memory:")
    for name in ("photos", "vehicles", "vehicle_types"):
        rows = table(written, name)
        base.execute(f"create table {name} ({', '.join(rows[0])})")
        base.executemany(f"insert into {name} values ({', '.join('?' * len(rows[0]))})", [tuple(row.values()) for row in rows])
    joined = base.execute(
        "select count(*) from vehicles v join photos p on v.pid = p.id join vehicle_types t on v.type_id = t.id"
    ).fetchone()
    assert joined == base.execute("select count(*) from vehicles").fetchone()


def test_another_place_and_no_vehicle(tmp_path):
    viewpoints = {"azimuth": [0], "elevation": [20], "distance": 2.5, "target": [0, 0, 9]}
    model = {**MODELS[2], "count": 1, "category": 'd\'été "à", l/x'}
    generate(poses_recipe(models=[model], viewpoints=viewpoints), tmp_path / "out", workers=0)
    where = {"latitude": -89.99, "longitude": 179.5, "altitude": 120}
    export(tmp_path / "out", [{"nyc3dcars": where}], output=tmp_path)
    (row,), (sample,) = table(tmp_path / "nyc3dcars", "photos"), Dataset(tmp_path / "out")
    (place,) = points(row["lla"])
    local = enu(-89.99, 179.5).T @ (ecef(*place) - ecef(-89.99, 179.5, 120))
    close("nyc3dcars", "csv: camera positions in the world", local, sample.camera.center, "m", atol=1e-4)
    assert not (tmp_path / "nyc3dcars/vehicles.csv").exists()


@pytest.mark.parametrize(
    ("camera", "found"), [({"principal_point": [70, 60]}, "70.0"), ({"K": [[90, 0, 80], [0, 80, 60], [0, 0, 1]]}, "90.0")]
)
def test_refusals(tmp_path, camera, found):
    size = {"size": [160, 120], **({} if "K" in camera else {"fov_deg": 50})}
    recipe = poses_recipe(models=[{**MODELS[2], "count": 1}], camera={**size, **camera}, formats=["nyc3dcars"])
    with pytest.raises(
        UserError, match=rf"nyc3dcars: expected square pixels and a centred camera; found K .*{found}.* of camera"
    ):
        generate(recipe, tmp_path / "out", workers=0)
