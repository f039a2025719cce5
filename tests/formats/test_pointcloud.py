"""Point clouds: through the camera they are the pixels again; the format `pointcloud`, read by trimesh."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from cube_dataset import LENS, make
from label_scenes import pictured, random_camera, random_things
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.formats.pointcloud import FORMAT
from viewsphere.geometry.camera import project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write

NAMES = ("depth", "depth_ray", "instances", "normals", "categories", "position")


def sample_of(seed, lens_name):
    rng = np.random.default_rng(seed)
    sample, *_ = pictured(*random_things(rng), random_camera(rng, lens_name), NAMES)
    picture = rng.integers(0, 255, (*sample.depth.shape, 3), np.uint8)
    return replace(sample, channels={"rgb": picture, **sample.channels})


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("by", ["depth", "depth_ray"])
def test_through_the_camera_a_cloud_is_the_picture_again(name, by):
    whole = sample_of(2, name)
    lacking = {"depth", "depth_ray"} - {by}
    sample = replace(whole, channels={name: array for name, array in whole.channels.items() if name not in lacking})
    cloud = sample.point_cloud()
    pixels, _ = project(sample.camera.intrinsics, cloud.points)
    column, row = np.floor(pixels).astype(int).T
    np.testing.assert_allclose(pixels, np.floor(pixels) + 0.5, atol=1e-6)
    seen = np.isfinite(whole.depth)
    np.testing.assert_array_equal((row, column), np.nonzero(seen))
    np.testing.assert_array_equal(cloud.colors, whole.rgb[row, column])
    np.testing.assert_array_equal(cloud.instances, whole.instances[row, column])
    np.testing.assert_array_equal(cloud.categories, whole.categories[row, column])
    np.testing.assert_array_equal(cloud.normals, whole.normals[row, column])
    np.testing.assert_allclose(cloud.points[:, 2], whole.depth[seen], rtol=2e-7)
    world = sample.point_cloud("world")
    np.testing.assert_allclose(world.points, whole.position[seen], atol=5e-6)
    np.testing.assert_allclose(world.normals @ sample.camera.R.T, cloud.normals, atol=1e-6)
    assert len(world) == seen.sum() > 1000 and world.visible.all() and world.axes == "world"


def test_what_is_not_kept_is_not_there():
    sample = sample_of(0, "pinhole")
    cloud = replace(sample, channels={"depth": sample.depth}).point_cloud()
    assert cloud.colors is None and cloud.instances is None and cloud.categories is None and cloud.normals is None
    with pytest.raises(StoreError, match=r"^frame 0: expected the channel depth, found none: add it"):
        replace(sample, channels={}).point_cloud()
    with pytest.raises(StoreError, match="expected the channel surface_samples, found none"):
        sample.point_cloud(surface="complete")
    with pytest.raises(UserError, match=r"point_cloud: axes: 'word' is unknown; did you mean 'world'\? Valid: camera, world"):
        sample.point_cloud("word")
    with pytest.raises(UserError, match=r"point_cloud: surface: 'all' is unknown\. Valid: visible, complete"):
        sample.point_cloud(surface="all")


FISHEYE = LENS.model_copy(update={"distortion": lens_parameters("fisheye", coefficients=(0.02, 0.05, 0.001, 0.0))})


@pytest.fixture(scope="module", params=[LENS, FISHEYE], ids=["pinhole", "fisheye"])
def dataset(request, tmp_path_factory):
    return make(tmp_path_factory.mktemp("pointcloud") / "out", several=True, intrinsics=request.param, ground=True)


def exported(dataset, folder, **options):
    folder.mkdir()
    write(dataset, [(FormatEntry(name="pointcloud", options=options), folder)])
    return folder


@pytest.mark.parametrize("axes", ["camera", "world"])
def test_trimesh_reads_the_clouds(dataset, tmp_path, axes):
    folder = exported(dataset, tmp_path / "pointcloud", axes=axes)
    assert len(list(folder.rglob("*.ply"))) == len(dataset)
    for sample in dataset:
        file = folder / sample.split / f"{sample.index:08d}.ply"
        read, cloud = trimesh.load(file), sample.point_cloud(axes)
        np.testing.assert_array_equal(read.vertices, cloud.points.astype(np.float32))
        np.testing.assert_array_equal(read.colors[:, :3], cloud.colors)
        rows = read.metadata["_ply_raw"]["vertex"]["data"]
        for name, expected in (("object", cloud.instances), ("category", cloud.categories), ("nz", cloud.normals[:, 2])):
            np.testing.assert_array_equal(rows[name].reshape(-1), expected)
        head = file.read_bytes().split(b"end_header\n")[0].decode().splitlines()
        assert f"comment viewsphere, frame {sample.index}" in head
        assert any(line.startswith(f"comment {axes} axes: ") and line.endswith("; metres") for line in head)
    assert list(FORMAT.verify(dataset, folder, (), FORMAT.options(axes=axes))) == []
    other = "world" if axes == "camera" else "camera"
    assert len(list(FORMAT.verify(dataset, folder, (), FORMAT.options(axes=other)))) == len(dataset)


def test_its_proof_names_the_frame(dataset, tmp_path):
    folder = exported(dataset, tmp_path / "pointcloud")
    file = folder / dataset[1].split / f"{dataset[1].index:08d}.ply"
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(data)
    (folder / "more.ply").write_bytes(b"ply")
    found = list(FORMAT.verify(dataset, folder, (), FORMAT.options()))
    assert sorted(frame is None for frame, _ in found) == [False, True]
    assert dataset[1].index in dict(found)


def test_complete_surface(tmp_path):
    complete = {"pointcloud": {"axes": "world", "surface": "complete"}}
    recipe = small_recipe(
        channels=["rgb", "depth", "instances", "surface_samples"],
        labels={"surface_samples": {"count": 200}},
        viewpoints={"azimuth": 30, "elevation": 20, "distance": 1.0},
        formats=[complete],
    )
    generate(recipe, tmp_path, workers=0)
    made = Dataset(tmp_path)
    for sample in made:
        read = trimesh.load(tmp_path / "pointcloud" / sample.split / f"{sample.index:08d}.ply")
        np.testing.assert_array_equal(read.vertices, sample.surface_samples["point"].astype(np.float32))
        rows = read.metadata["_ply_raw"]["vertex"]["data"]
        np.testing.assert_array_equal(rows["visible"].reshape(-1), sample.surface_samples["state"] == 0)
        assert 0 < rows["visible"].sum() < 200
    assert check(made, rays=False).ok


def test_complete_clouds_of_a_data_set_without_their_points(dataset, tmp_path):
    with pytest.raises(UserError, match=r"^pointcloud: expected a data set with the channel surface_samples"):
        exported(dataset, tmp_path / "pointcloud", surface="complete")
