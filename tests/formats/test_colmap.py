"""COLMAP's models, text and binary, read by pycolmap: lenses, poses, rigs, and points that lie where images show them."""

from __future__ import annotations

import math
import shutil
from itertools import cycle, product

import numpy as np
import pycolmap
import pytest

from cube_dataset import FEW, LENS, make
from proven import close, equal
from quick import quick
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.composing.viewpoints.pose_files.colmap import read_colmap
from viewsphere.errors import StoreError, UserError
from viewsphere.formats.colmap.reading import read_model
from viewsphere.geometry.camera import project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export
from viewsphere.store.samples.choice import Choice

KINDS = ("binary", "text")
BENT = ("barrel", "rational", "fisheye")


def written(dataset, place, kind, **more):
    export(dataset.root, [{"colmap": {"kind": kind}}], output=place, **more)
    return place / "colmap"


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A function that gives an export of a world, made once; do not change it."""
    made = {}

    def get(dataset, kind):
        key = (dataset.root, kind)
        if key not in made:
            made[key] = written(dataset, tmp_path_factory.mktemp("colmap"), kind)
        return made[key]

    return get


def models(folder):
    return {
        path.parent.parent.relative_to(folder).as_posix(): pycolmap.Reconstruction(path) for path in folder.glob("*/sparse/0")
    }


def images(dataset, folder):
    """Every sample, the model that has its image, and the image."""
    found = {number: (model, image) for model in models(folder).values() for number, image in model.images.items()}
    assert sorted(found) == [sample.index + 1 for sample in dataset]
    return [(sample, *found[sample.index + 1]) for sample in dataset]


@pytest.mark.parametrize("kind", ["text", "binary"])
@pytest.mark.parametrize("world", ["stills", "poses", "videos"])
@pytest.mark.slow
def test_pycolmap_reads_cameras_and_poses(world, kind, request, shared):
    dataset = request.getfixturevalue(world)
    folder = shared(dataset, kind)
    for sample, model, image in images(dataset, folder):
        camera = model.cameras[image.camera_id]
        pose = image.cam_from_world().matrix()
        expected = np.column_stack((sample.camera.R, sample.camera.t))
        close("colmap", f"pycolmap {kind}: poses", pose, expected, "m", atol=1e-12)
        close("colmap", f"pycolmap {kind}: lenses", camera.calibration_matrix(), sample.camera.K, "px", atol=1e-12)
        assert (camera.width, camera.height, camera.model.name) == (160, 120, "PINHOLE")
        (file,) = folder.glob(f"*/images/{image.name}")  # frames have different numbers
        assert file.samefile(dataset.path(sample.files["rgb"]))


@pytest.mark.parametrize("kind", ["text", "binary"])
@pytest.mark.slow
def test_rigs(videos, kind, shared):
    folder = shared(videos, kind)
    for model in models(folder).values():
        assert model.num_rigs() == 1 and model.num_cameras() == 2 and model.num_frames() == 6 and model.num_reg_images() == 12
        assert all(frame.num_data_ids() == 2 for frame in model.frames.values())
        (rig,) = model.rigs.values()
        (other,) = rig.non_ref_sensors.values()
        close("colmap", "pycolmap: rigs", other.matrix()[:, 3], [-0.1, 0, 0], "m", atol=1e-12)
    for sample, model, image in images(videos, folder):
        frame = model.frames[image.frame_id]
        assert frame.frame_id == sample.index + 1 - (sample.sensor == "right")
        assert image.name.startswith(f"{sample.sensor}/")


def reprojected(model):
    """Where every image shows its points, and where its camera projects them."""
    found, expected = [], []
    for point in model.points3D.values():
        for seen in point.track.elements:
            image = model.images[seen.image_id]
            place = image.points2D[seen.point2D_idx]
            assert model.points3D[place.point3D_id].xyz.tolist() == point.xyz.tolist()
            found.append(place.xy)
            expected.append(image.project_point(point.xyz))
    return np.array(found), np.array(expected)


@pytest.mark.parametrize("kind", ["text", "binary"])
def test_points_lie_where_images_show_them(stills, videos, kind, shared):
    for dataset in (stills, videos):
        for model in models(shared(dataset, kind)).values():
            found, expected = reprojected(model)
            assert len(found) > 40
            close("colmap", f"pycolmap {kind}: points", found, expected, "px", atol=1e-3)


@pytest.mark.slow
def test_followed_points_have_all_images_that_show_them(videos, tmp_path):
    folder = written(videos, tmp_path, "text")
    moving = 0
    for name, model in models(folder).items():
        tracks = {sensor: videos.tracks(name, sensor) for sensor in ("left", "right")}
        longest = max(point.track.length() for point in model.points3D.values())
        assert longest > 3
        for number, image in model.images.items():
            sample = videos[number - 1]
            own = tracks[sample.sensor]
            at = own.instants.tolist().index(sample.instant)
            picked = own.world[own.query[:, 0].astype(int), own.ids]
            still = np.abs(own.world[at] - picked).max(axis=1) < 1e-6
            shown = (own.state[at] == 0) & still
            moving += int(((own.state[at] == 0) & ~still).sum())
            close("colmap", "tracks: pixels", [p.xy for p in image.points2D], own.xy[at][shown], "px", atol=1e-9)
    assert moving > 0


def test_colours_are_those_of_the_picture(stills, tmp_path):
    folder = written(stills, tmp_path, "binary")
    for sample, model, image in images(stills, folder):
        for point in image.points2D:
            column, row = np.floor(point.xy).astype(int)
            equal("colmap", "colours", model.points3D[point.point3D_id].color, sample.rgb[row, column])


@pytest.mark.parametrize(("name", "kind"), quick([*product(LENSES, KINDS)], *zip(LENSES, cycle(KINDS), strict=False)))
def test_lenses(name, kind, tmp_path):
    lens = LENS.model_copy(update={"distortion": LENSES[name], "cx": 47.25})
    dataset = make(tmp_path / "out", several=True, intrinsics=lens, ground=True, channels=FEW)
    folder = written(dataset, tmp_path / "made", kind)
    (model,) = models(folder).values()
    (camera,) = model.cameras.values()
    expected = {"pinhole": "PINHOLE", "barrel": "FULL_OPENCV", "rational": "FULL_OPENCV", "fisheye": "OPENCV_FISHEYE"}
    assert camera.model.name == expected[name]
    points = np.random.default_rng(0).uniform([-0.5, -0.4, 1], [0.5, 0.4, 1], (200, 3))
    found = np.array([camera.img_from_cam(point) for point in points])
    close("colmap", f"pycolmap: {name} lens", found, project(lens, points)[0], "px", atol=1e-9)
    close("colmap", f"pycolmap: points, {name} lens", *reprojected(model), "px", atol=1e-3)


OTHERS = {
    "EUCM": lens_parameters("eucm", alpha=0.6, beta=1.2),
    "FOV": lens_parameters("fov", omega=0.8),
    "DIVISION": lens_parameters("scaramuzza", coefficients=(-0.2,)),
    "THIN_PRISM_FISHEYE": lens_parameters("thin_prism_fisheye", coefficients=(0.03, -0.004, 0.01, 0.02, 0.001, 0, 0.01, -0.02)),
    "RAD_TAN_THIN_PRISM_FISHEYE": lens_parameters("fisheye624", coefficients=(0.03, -0.004, *[0.001] * 10)),
}


@pytest.mark.parametrize(("name", "kind"), [*zip(OTHERS, cycle(KINDS), strict=False)])
@pytest.mark.slow
def test_lenses_of_colmap_s_own(name, kind, tmp_path):
    """pycolmap projects as the data set does, and viewsphere reads the same lens again."""
    lens = LENS.model_copy(update={"distortion": OTHERS[name], "cx": 47.25})
    dataset = make(tmp_path / "out", intrinsics=lens, channels=FEW)
    folder = written(dataset, tmp_path / "made", kind)
    points = np.random.default_rng(0).uniform([-0.5, -0.4, 1], [0.5, 0.4, 1], (200, 3))
    points = points[np.hypot(*points[:, :2].T) > 0.011]  # COLMAP has a series for FOV near the axis
    for model in models(folder).values():
        (camera,) = model.cameras.values()
        assert camera.model.name == name
        close("colmap", f"pycolmap: {name}", camera.img_from_cam(points), project(lens, points)[0], "px", atol=1e-9)
    for path in folder.glob("*/sparse/0"):
        assert list(read_model(path).lenses.values()) == [lens]
        if kind == "text":
            assert read_colmap(path).intrinsics == lens


ROUND = LENS.model_copy(update={"fx": 96 / math.tau, "fy": 72 / math.pi, "distortion": lens_parameters("equirectangular")})
"""All directions, in pixels that are not square."""


@pytest.mark.parametrize("kind", KINDS)
def test_a_panorama_of_all_directions(kind, tmp_path):
    """pycolmap sees points all around where the data set does, its points lie where images show them, and it comes in again."""
    dataset = make(tmp_path / "out", several=True, intrinsics=ROUND, channels=("rgb", "depth_ray", "instances"))
    folder = written(dataset, tmp_path / "made", kind)
    (model,) = models(folder).values()
    (camera,) = model.cameras.values()
    assert (camera.model.name, camera.params.tolist()) == ("EQUIRECTANGULAR", [96, 72])
    points = np.random.default_rng(0).normal(size=(500, 3))
    seen = np.array([camera.img_from_cam(point) for point in points])
    close("colmap", "pycolmap: panorama", seen, project(ROUND, points)[0], "px", atol=1e-9)
    close("colmap", f"pycolmap: points, panorama {kind}", *reprojected(model), "px", atol=1e-3)
    path = folder / "several" / "sparse" / "0"
    assert list(read_model(path).lenses.values()) == [ROUND]
    if kind == "text":
        assert read_colmap(path).intrinsics == ROUND
    import_dataset("colmap", folder / "several", tmp_path / "in")
    assert [sample.camera.intrinsics for sample in Dataset(tmp_path / "in")] == [ROUND] * len(dataset)


@pytest.mark.parametrize(
    "change", [{"fx": 96 / math.pi}, {"fy": 72.0}, {"cx": 47.0}, {"distortion": lens_parameters("cylindrical")}]
)
def test_other_panoramas_are_refused(change, tmp_path):
    dataset = make(tmp_path / "out", intrinsics=ROUND.model_copy(update=change), channels=("rgb", "depth_ray"))
    with pytest.raises(UserError, match=r"expected lenses of COLMAP's models; found (equirect|cylind)"):
        written(dataset, tmp_path / "made", "text")


def test_lenses_that_colmap_lacks_are_refused(tmp_path):
    bent = lens_parameters("double_sphere", xi=0.1, alpha=0.5)
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update={"distortion": bent}), channels=FEW)
    with pytest.raises(UserError, match="expected lenses of COLMAP's models; found double_sphere of camera"):
        written(dataset, tmp_path / "made", "text")


def test_four_coefficients_are_the_model_opencv(tmp_path):
    brown = LENSES["barrel"].model_copy(update={"coefficients": (-0.2, 0.05, 0.001, -0.002)})
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update={"distortion": brown}), channels=FEW)
    found = models(written(dataset, tmp_path / "made", "text"))
    assert sorted(found) == ["block-0", "block-1", "block-2"]
    for model in found.values():
        assert [camera.model.name for camera in model.cameras.values()] == ["OPENCV"]


def test_splits_are_listed(stills, shared):
    folder = shared(stills, "text")
    for split in stills.splits:
        names = [name for file in folder.glob(f"*/sparse/0/{split}.txt") for name in file.read_text().split()]
        assert sorted(names) == [f"{sample.index:08d}.png" for sample in stills if sample.split == split]


def test_a_part_of_an_instant(videos, tmp_path):
    """Frames hold the images that are there; a rig's pose is known from any of them."""
    folder = written(videos, tmp_path, "text", choice=Choice(frames=((1, 5),)))
    (model,) = models(folder).values()
    assert sorted(model.images) == [2, 3, 4, 5]
    assert sorted(frame.num_data_ids() for frame in model.frames.values()) == [1, 1, 2]
    for number, image in model.images.items():
        camera = videos[number - 1].camera
        close("colmap", "a part", image.cam_from_world().matrix(), np.column_stack((camera.R, camera.t)), "m", atol=1e-12)


@pytest.mark.slow
def test_pictures_of_other_lenses_have_cameras_of_their_own(tmp_path):
    camera = {"size": [96, 72], "fov_deg": {"uniform": [30, 50]}}
    generate(small_recipe(camera=camera, channels=["rgb", "depth"], formats=[]), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    found = images(dataset, written(dataset, tmp_path / "made", "binary"))
    for sample, model, image in found:
        close("colmap", "drawn lenses", model.cameras[image.camera_id].calibration_matrix(), sample.camera.K, "px", atol=1e-12)
        close("colmap", "points of drawn lenses", *reprojected(model), "px", atol=1e-3)
    assert len({image.camera_id for _, _, image in found}) == len(dataset) == 12


def test_what_it_refuses(tmp_path):
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update={"skew": 2.5}))
    with pytest.raises(UserError, match=r"format colmap: expected cameras without skew; found 2.5 of camera"):
        written(dataset, tmp_path / "made", "text")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("kind", ["text", "binary"])
def test_a_model_comes_in_as_it_went_out(videos, kind, shared, tmp_path):
    folder = shared(videos, kind)
    for world in videos.sequences:
        import_dataset("colmap", folder / world, tmp_path / world)
        own = sorted((sample for sample in videos if sample.sequence == world), key=lambda sample: sample.sensor)
        for sample, was in zip(Dataset(tmp_path / world), own, strict=True):
            close("colmap", "import: poses", sample.camera.R, was.camera.R, atol=1e-12)
            close("colmap", "import: positions", sample.camera.t, was.camera.t, "m", atol=1e-12)
            equal("colmap", "import: lenses", sample.camera.K, was.camera.K)
            equal("colmap", "import: pictures", sample.rgb, was.rgb)
            assert sample.split == was.split


@pytest.mark.parametrize(("name", "kind"), quick([*product(BENT, KINDS)], *zip(BENT, cycle(KINDS), strict=False)))
def test_lenses_come_in(name, kind, tmp_path):
    dataset = make(
        tmp_path / "out", several=True, intrinsics=LENS.model_copy(update={"distortion": LENSES[name]}), channels=FEW
    )
    import_dataset("colmap", written(dataset, tmp_path / "made", kind) / "several", tmp_path / "in")
    for sample, was in zip(Dataset(tmp_path / "in"), dataset, strict=True):
        assert sample.camera.intrinsics == was.camera.intrinsics and sample.split == was.split


@pytest.mark.parametrize("kind", ["text", "binary"])
def test_what_pycolmap_writes_comes_in(stills, kind, shared, tmp_path):
    world = shared(stills, kind) / "scene-000001"
    place = tmp_path / "theirs"
    (place / "sparse" / "0").mkdir(parents=True)
    shutil.copytree(world / "images", place / "images")
    model = pycolmap.Reconstruction(world / "sparse" / "0")
    getattr(model, f"write_{kind}")(place / "sparse" / "0")
    import_dataset("colmap", place, tmp_path / "in")
    own = [sample for sample in stills if stills.plan.row_at(sample.index).subject == "scene-000001"]
    for sample, was in zip(Dataset(tmp_path / "in"), own, strict=True):
        close("colmap", f"import of pycolmap's {kind}: positions", sample.camera.t, was.camera.t, "m", atol=1e-12)
        close("colmap", f"import of pycolmap's {kind}: lenses", sample.camera.K, was.camera.K, "px", atol=1e-12)


def test_what_is_broken_is_told(poses, tmp_path):
    for kind, ending in (("text", "txt"), ("binary", "bin")):
        world = written(poses, tmp_path / kind, kind) / "car_000"
        shutil.move(world / "images" / "00000001.png", world / "images" / "other.png")
        with pytest.raises(StoreError, match=r"images\.\w+: image '00000001.png': expected a picture; found no 00000001.png"):
            import_dataset("colmap", world, tmp_path / "in")
        assert import_dataset("colmap", world, tmp_path / f"{kind}-in", keep_going=True).count == 2
        for name in ("cameras", "images"):
            file = world / "sparse" / "0" / f"{name}.{ending}"
            whole = file.read_bytes()
            file.unlink()
            file.write_bytes(whole[:50] if kind == "binary" else whole + b"1 2 3\n")
            with pytest.raises(StoreError, match="expected a model of COLMAP's; found"):
                import_dataset("colmap", world, tmp_path / "in")
            file.write_bytes(whole)
    with pytest.raises(StoreError, match=r"expected sparse/0 with cameras and images as \.txt or \.bin; found none"):
        import_dataset("colmap", tmp_path, tmp_path / "in")


def test_recipes_take_the_poses(stills, tmp_path):
    folder = written(stills, tmp_path, "text")
    read = read_colmap(folder / "scene-000001" / "sparse" / "0")
    own = [sample for sample in stills if stills.plan.row_at(sample.index).subject == "scene-000001"]
    assert read.intrinsics == own[0].camera.intrinsics
    for entry, sample in zip(read.entries, own, strict=True):
        close("colmap", "recipes: poses", entry.R, sample.camera.R, atol=1e-12)
        close("colmap", "recipes: positions", entry.center, sample.camera.center, "m", atol=1e-12)
