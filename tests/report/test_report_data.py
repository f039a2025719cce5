"""The report's counts against closed forms, its choice of frames, its pictures and meshes."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

import viewsphere as vs
from small import small_recipe
from viewsphere.errors import StoreError, UserError
from viewsphere.report import Proof, chosen_frames, report_data, write_report
from viewsphere.report.frames import frame_data
from viewsphere.report.meshes import mesh_data, simplified
from viewsphere.report.page import script_json
from viewsphere.report.paths import without_folders
from viewsphere.report.pictures import Scale, coordinate_colors, depth_colors, layers, layers_within, normal_colors
from viewsphere.report.summary import hues, nice_edges, sphere_cells, summary
from viewsphere.report.table import FRAME, OBJECT, FrameTable, read_table
from viewsphere.store import Dataset


def table_of(subjects, splits):
    frames = np.zeros(len(subjects), FRAME)
    frames["subject"], frames["split"] = subjects, splits
    return FrameTable(frames, np.zeros(0, OBJECT), ("train", "val"), ("a", "b", "c"), (), ())


def test_counts_of_the_small_recipe(small_dataset):
    found = summary(small_dataset, read_table(small_dataset))
    assert (found["frames"], found["planned"], found["objects"], found["seen"], found["empty"]) == (12, 12, 12, 12, 0)
    assert found["sizes"] == [[96, 72, 12]]
    assert [(c["name"], c["objects"], c["frames"], c["hue"]) for c in found["categories"]] == [
        ("post box", 6, 6, 0),
        ("</script><!--<b>", 6, 6, 1),
    ]
    assert sum(s["frames"] for s in found["splits"]) == 12
    assert {m["objects"] for m in found["models"]} == {6}
    # azimuths 0, 120, 240 see front, back-left and back-right; elevation 50 is above
    assert {p["name"]: p["objects"] for p in found["poses"]} == {
        side + above: 2 for side in ("front", "back-left", "back-right") for above in ("", "-above")
    }
    assert [n for _, _, n in found["cameras"]["occupied"]] == [2] * 6
    for distribution in found["distributions"]:
        assert sum(map(sum, distribution["series"])) == distribution["known"] == 12
    assert sum(found["distances"]["counts"]) == 12


@pytest.mark.slow
def test_many_processes_and_chunks_read_the_same_table(small_dataset, monkeypatch):
    from viewsphere.report import table as module

    whole = read_table(small_dataset)
    monkeypatch.setattr(module, "CHUNK", 5)
    for workers in (0, 2):
        pieces = read_table(small_dataset, workers=workers)
        assert np.array_equal(whole.frames, pieces.frames)
        assert whole.objects.tobytes() == pieces.objects.tobytes()
        assert (whole.models, whole.poses, whole.splits) == (pieces.models, pieces.poses, pieces.splits)


def test_choice_takes_from_every_group_in_proportion():
    table = table_of(np.repeat([0, 1, 2], [900, 90, 10]), np.zeros(1000))
    picks = chosen_frames(table, 100)
    assert picks == sorted(set(picks)) == chosen_frames(table, 100)
    counts = np.bincount(table.frames["subject"][picks])
    assert counts.sum() == 100
    assert abs(counts[0] - 90) <= 2
    assert counts[2] >= 1
    assert chosen_frames(table, 1000) == list(range(1000))
    # Poses repeat every 60 frames: the picks are spread over them.
    many = chosen_frames(table_of(np.zeros(6000, int), np.zeros(6000)), 240)
    assert len(set(np.array(many) % 60)) > 50
    assert max(np.diff(many)) <= 2 * 6000 / 240


def test_more_groups_than_frames_give_one_each():
    table = table_of(np.arange(500) % 3, np.arange(500) % 2)
    picks = chosen_frames(table, 4)
    assert len(picks) == 4
    assert len({(int(f["subject"]), int(f["split"])) for f in table.frames[picks]}) == 4


def test_cells_fit_a_grid_and_hold_every_viewpoint_once():
    azimuth, elevation = (g.ravel() for g in np.meshgrid(np.arange(0, 360, 5.0), np.arange(0, 91, 5.0)))
    cells = sphere_cells(azimuth, elevation)
    assert (cells.azimuth[1], cells.elevation[1]) == (5, 5)
    assert len(cells.occupied) == 72 * 19
    assert {n for _, _, n in cells.occupied} == {1}
    random = np.random.default_rng(0)
    free = sphere_cells(random.uniform(0, 360, 5000), random.uniform(-90, 90, 5000))
    assert (free.azimuth, free.elevation) == ((0, 10), (-90, 10))
    assert sum(n for _, _, n in free.occupied) == 5000
    assert all(0 <= c < 36 and 0 <= r < 19 for c, r, _ in free.occupied)
    assert sphere_cells(np.array([np.nan]), np.array([np.nan])).occupied == ()
    assert sphere_cells(np.array([30.0]), np.array([20.0])).occupied == ((0, 0, 1),)


def test_edges_are_round_and_hold_all_values():
    assert nice_edges(np.zeros(0)).size == 0
    for values in ([2, 3, 4], [5.0], [0.001, 1234.5], [2.1, 2.2], [0]):
        edges = nice_edges(np.array(values, np.float32))
        assert np.histogram(np.array(values, np.float32).astype(float).round(5), edges)[0].sum() == len(values)
        assert len(edges) < 60


@pytest.mark.parametrize("value", [0, 5.0, 2.2, 1234.5, -3])
def test_a_single_value_is_one_bar_in_the_middle(value):
    edges = nice_edges(np.full(7, value, np.float32))
    counts = np.histogram(np.full(7, value), edges)[0]
    assert counts.tolist() == [0, 7, 0]
    assert (edges[0] + edges[-1]) / 2 == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("source: /home/ann/models/car.obj", "source: car.obj"),
        ("C:\\Users\\ann\\car.obj: expected faces", "car.obj: expected faces"),
        ("source: ../models/car.obj", "source: ../models/car.obj"),
        ("16/16 frames, 4 frames/s, https://a.org/b/c", "16/16 frames, 4 frames/s, https://a.org/b/c"),
        ("zoo:car and ~/cars/*.obj", "zoo:car and ~/cars/*.obj"),
    ],
)
def test_absolute_paths_lose_their_folders(text, told):
    assert without_folders({"a": [text]}) == {"a": [told]}


PLACES = {
    "/home/ann smith/my models/car.obj": "car.obj",
    "/home/ann/3d (old), new/it's/*.glb": "*.glb",
    "C:\\Users\\ann smith\\my models\\van.obj": "van.obj",
    "D:/ann smith/models/bus.obj": "bus.obj",
    "\\\\server\\ann smith\\models\\tram.obj": "tram.obj",
    "../ann smith/models/bike.obj": "../ann smith/models/bike.obj",
    "zoo:car": "zoo:car",
}


def test_the_shown_recipe_holds_no_absolute_path(small_dataset):
    """Folders with spaces and quotes neither, which YAML quotes, escapes and breaks; the kept recipe stays."""
    dataset = Dataset(small_dataset.root)
    (part,) = dataset.plan.parts
    sources = [f"{place[:-4]}{'-long' * 30}{place[-4:]}" if place.startswith("/home/ann s") else place for place in PLACES]
    recipe = {**part.recipe, "models": [{"source": sources, "category": "car"}], "engine": {"script": "C:\\ann smith\\a b.py"}}
    dataset.plan = replace(dataset.plan, parts=(replace(part, recipe=recipe),))
    shown = yaml.safe_load(report_data(dataset, read_table(dataset), [], None, lambda *_: None)["facts"]["recipe"])
    assert shown["models"][0]["source"] == ["car" + "-long" * 30 + ".obj", *list(PLACES.values())[1:]]
    assert shown["engine"] == {"script": "a b.py"}
    assert dataset.plan.parts[0].recipe["models"][0]["source"] == sources
    others = part.recipe.keys() - {"models", "engine"}
    assert {name: shown[name] for name in others} == json.loads(json.dumps({name: part.recipe[name] for name in others}))


@pytest.mark.slow
def test_the_page_holds_no_absolute_path(small_dataset, tmp_path):
    proof = Proof(
        False,
        {"boxes": 1},
        (f"files: {small_dataset.root}/store/plan.json: expected more",),
        (f"{tmp_path}/a: b",),
        "1 finding",
    )
    write_report(small_dataset, tmp_path / "page.html", proof=proof)
    text = (tmp_path / "page.html").read_text()
    assert "plan.json: expected more" in text
    for place in (small_dataset.root.resolve().parent, tmp_path):
        assert str(place) not in text


def test_hues_belong_to_the_most_frequent_categories_in_order_of_ids():
    assert hues([(1, 5), (2, 9)]) == {1: 0, 2: 1}
    found = hues([(i, i) for i in range(1, 10)])
    assert found == {**dict.fromkeys((1, 2, 3), -1), 4: 0, 5: 1, 6: 2, 7: 3, 8: 4, 9: 5}


def test_what_is_not_known_is_null(small_dataset):
    sample = small_dataset[0]
    first = sample.objects[0]
    nowhere = {
        n: np.full_like(getattr(first, n), np.nan)
        for n in ("world_from_object", "camera_from_object", "box3d_pixels", "box3d_camera")
    }
    unknown = replace(first, visibility=float("nan"), truncation=float("nan"), box2d=None, **nowhere)
    found = frame_data(replace(sample, objects=(unknown, first)))
    json.dumps(found, allow_nan=False)
    one, other = found["objects"]
    assert [one[n] for n in ("corners", "faces", "view", "size", "visibility", "truncation", "box")] == [None] * 7
    assert len(other["corners"]) == 8
    assert 1 <= len(other["faces"]) <= 3
    assert "bottom" not in other["faces"]
    assert found["size"] == [96, 72]
    assert frame_data(replace(sample, objects=()))["objects"] == []


def test_bent_lenses_have_the_lines_of_their_frustum(small_dataset):
    sample = small_dataset[0]
    assert frame_data(sample)["camera"]["lines"] is None
    camera = {"projection": "equirectangular", "size": [96, 48]}
    bent = next(iter(vs.render(small_recipe(camera=camera, channels=["rgb", "depth_ray"], formats=[]))))
    data = json.loads(json.dumps(frame_data(bent), allow_nan=False))["camera"]
    points = np.concatenate(data["lines"]).reshape(-1, 3)
    assert len(data["lines"]) > 10 and 0.98 < np.linalg.norm(points, axis=1).max() < 1.02 and np.ptp(points, axis=0).min() > 1.9


def test_layers_are_those_whose_channels_are_there(small_dataset):
    sample = small_dataset[0]
    scale = Scale(48, 60, 32)
    maps = {"coordinates", "nocs", "position", "semantic", "panoptic", "parts", "materials", "body_parts"}
    assert set(layers(sample, scale)) == {"rgb", "depth", "depthRange", "normals"} | maps
    assert set(layers(replace(sample, channels={"rgb": sample.rgb}), scale)) == {"rgb"}
    assert layers(replace(sample, channels={}), scale) == {}


def test_colours_of_depth_normals_and_coordinates(small_dataset):
    near, far, picture = depth_colors(np.array([[1.0, 2.0, np.inf]], np.float32))
    assert near == 1
    assert 1.9 < far <= 2
    assert picture[0, 0].tolist() == [253, 231, 37, 255]
    assert picture[0, 1].tolist() == [68, 1, 84, 255]
    assert picture[0, 2, 3] == 0
    street = np.array([[1.0, 10.0, *([100.0] * 98)]], np.float32)
    assert depth_colors(street)[2][0, 1].tolist() == [33, 144, 141, 255], "halfway by factors of distance"
    towards = normal_colors(np.array([[[0, 0, -1], [0, 0, 0]]], np.float32))
    assert towards[0, 0].tolist() == [128, 128, 255, 255]
    assert towards[0, 1, 3] == 0
    sample = small_dataset[0]
    box = sample.objects[0].box3d_object
    corners = np.stack([box.min(axis=0), box.max(axis=0)]).astype(np.float32)[None]
    colors = coordinate_colors(corners, np.array([[1, 0]], np.int32), sample.objects)
    assert colors[0].tolist() == [[0, 0, 0, 255], [0, 0, 0, 0]]


@pytest.mark.slow
def test_pictures_fit_the_budget_or_are_refused(small_dataset):
    samples = list(small_dataset)

    def size(budget):
        return sum(len(v) for found in layers_within(samples, range(12), budget) for v in found.values() if isinstance(v, str))

    whole = size(10**7)
    assert size(whole - 1000) <= whole - 1000
    with pytest.raises(UserError, match="--frames"):
        layers_within(samples, range(12), 1000)


def test_simplified_sphere_keeps_its_shape_and_bound():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=5)
    colors = np.full((len(ball.faces), 3), 200, np.uint8)
    small = simplified(np.asarray(ball.vertices), np.asarray(ball.faces), colors, 2000)
    assert 500 < len(small.triangles) + len(small.edges) <= 2000
    assert len(small.colors) == len(small.triangles)
    radius = np.linalg.norm(small.vertices, axis=1)
    assert np.all(np.abs(radius - 1) < 0.05)
    untouched = simplified(np.asarray(ball.vertices), np.asarray(ball.faces), colors, 10**6)
    assert np.array_equal(untouched.triangles, ball.faces)


def test_a_spoke_thinner_than_the_grid_becomes_a_line():
    import trimesh

    spoke = trimesh.creation.cylinder(radius=1e-4, height=1, sections=64).subdivide().subdivide()
    colors = np.zeros((len(spoke.faces), 3), np.uint8)
    small = simplified(np.asarray(spoke.vertices), np.asarray(spoke.faces), colors, 200)
    assert len(small.edges) > 0
    assert np.ptp(small.vertices[small.edges.ravel(), 2]) > 0.9
    assert mesh_data(small)["edges"]


def test_script_json_cannot_end_its_element():
    text = script_json({"name": "</script><!--", "e": "é\u2028"})
    assert "<" not in text
    assert json.loads(text)["name"] == "</script><!--"


def test_the_page_is_one_file_that_holds_its_data(small_dataset, page_file):
    text = page_file.read_text("utf-8")
    assert len(text.encode()) < 20_000_000
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert data["summary"]["frames"] == 12 == len(data["shown"])
    assert data["proof"]["findings"] == ["boxes: frame 3: expected <b>this</b>"]
    assert [m["problem"] for m in data["models"]] == [None, None]
    assert "azimuth" in data["facts"]["recipe"]
    assert not re.search(r'(src|href)="(https?:)?//', text)


def test_the_library_bundle_is_small_and_licensed():
    from viewsphere.report.page import VENDOR

    bundle = VENDOR.read_text("utf-8")
    assert len(bundle) < 900_000
    assert "</script" not in bundle.lower()
    assert "<!--" not in bundle
    licenses = (VENDOR.parent / "LICENSES.txt").read_text("utf-8")
    package = json.loads((VENDOR.parent / "package.json").read_text("utf-8"))
    for name, exact in package["dependencies"].items():
        assert f"{name} {exact} (" in licenses


def test_mistakes_are_named(small_dataset, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(UserError, match="place to write"):
        write_report(small_dataset, blocked / "page.html", frames=2)
    empty = tmp_path / "empty"
    (empty / "store").mkdir(parents=True)
    (empty / "store" / "plan.json").write_bytes((small_dataset.root / "store" / "plan.json").read_bytes())
    with pytest.raises(StoreError, match="render first"):
        write_report(Dataset(empty), tmp_path / "page.html", proof=Proof(True, {}, (), (), "all proofs hold"))


@pytest.mark.slow
def test_check_reads_no_more_frames_than_asked_for(small_dataset):
    from viewsphere import export
    from viewsphere.check import check

    some = check(small_dataset, frames=4, rays=False)
    assert some.ok
    assert some.checked["box2d"] == 4
    assert "coco" not in some.checked
    assert "4 of 12 frames read" in some.verdict
    export(small_dataset.root, ["coco"])
    assert check(small_dataset, frames=4, rays=False).checked.keys() == some.checked.keys()
    assert check(small_dataset, frames=12, rays=False).checked["coco"] == 12
