"""HDF5 as BlenderProc's, read by h5py: the same arrays, poses and names, and the same bytes at any time."""

from __future__ import annotations

import json
import sys
import time

import h5py
import numpy as np
import pytest

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import MissingExtraError, RecipeError, UserError
from viewsphere.formats.hdf5 import SOURCES
from viewsphere.run.exports.exporting import export
from worlds import poses as recipe

STILL = [key for key in SOURCES if "flow" not in key]
HOSTILE = 'é "x"/\\ \n'


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(world, keys):
        if world not in made:
            made[world] = tmp_path_factory.mktemp("hdf5")
            export(request.getfixturevalue(world).root, [{"hdf5": {"keys": list(keys)}}], output=made[world])
        return made[world] / "hdf5"

    return get


def opened(folder, sample):
    with h5py.File(folder / sample.split / f"{sample.index}.hdf5") as file:
        return {key: json.loads(value[()]) if value.dtype.kind == "S" else value[()] for key, value in file.items()}


@pytest.mark.parametrize(("world", "keys"), [("stills", STILL), pytest.param("videos", SOURCES, marks=pytest.mark.slow)])
def test_arrays(request, written, world, keys):
    dataset, folder = request.getfixturevalue(world), written(world, keys)
    moved = 0
    for sample in dataset:
        found = opened(folder, sample)
        assert set(found) == {*keys, "instance_attribute_maps", "camera_pose", "object_states", "frame"}
        equal("hdf5", "h5py: pictures", found["colors"], sample.rgb)
        for key, own in (("depth", sample.depth), ("distance", sample.depth_ray)):
            equal("hdf5", f"h5py: {key}", np.where(found[key] > 1e9, np.inf, found[key]), own)
            assert found[key].dtype == np.float32 and np.isfinite(found[key]).all()
        normals = (found["normals"] - 0.5) * 2 * [1, -1, -1]
        close("hdf5", "h5py: normals", normals, sample.normals, atol=2e-7)
        seen = found["nocs"][..., 3] == 1
        equal("hdf5", "h5py: objects of NOCS", seen, sample.instances > 0)
        equal("hdf5", "h5py: NOCS", found["nocs"][seen][:, :3], sample.nocs[seen])
        assert not found["nocs"][~seen].any()
        equal("hdf5", "h5py: instances", found["instance_segmaps"], sample.instances)
        equal("hdf5", "h5py: categories", found["class_segmaps"], sample.categories)
        assert found["class_segmaps"].dtype == found["instance_segmaps"].dtype == np.uint8
        for way, name in (("forward", "flow"), ("backward", "flow_backward")) if world == "videos" else ():
            flow, own = found[f"{way}_flow"], sample.channels[name]
            known = np.isfinite(own)
            equal("hdf5", "h5py: flow", flow[known], own[known])
            assert not flow[~known].any()
            equal("hdf5", "h5py: states of flow", found[f"{way}_flow_state"], sample.channels[f"{name}_state"])
            moved += known.any()
    assert moved or world == "stills"


def test_what_is_told(stills, written):
    folder = written("stills", STILL)
    for sample in stills:
        found = opened(folder, sample)
        frame = {"index": sample.index, "split": sample.split, "sequence": "", "sensor": "camera", "instant": sample.instant}
        assert found["frame"] == {**frame, "time": 0.0}
        names = [(one["idx"], one["category_id"], one["name"], one["category"]) for one in found["instance_attribute_maps"]]
        seen = [o for o in sample.objects if o.area]
        assert names == [(0, 0, "background", ""), *((o.id, o.category_id, o.key, o.category) for o in seen)]
        assert {name[0] for name in names} >= set(np.unique(sample.instances).tolist())
        for one, o in zip(found["object_states"], sample.objects, strict=True):
            assert (one["idx"], one["category_id"], one["name"]) == (o.id, o.category_id, o.key)
            equal("hdf5", "h5py: poses", one["matrix_world"], o.world_from_object)
            equal("hdf5", "h5py: poses", one["location"], o.world_from_object[:3, 3])


def test_the_camera_sees_the_boxes_where_they_are(stills, written):
    """Of the file's own numbers: a vertex of the box, through pose and K, whose first pixel's centre is (0, 0)."""
    folder = written("stills", STILL)
    for sample in stills:
        found = opened(folder, sample)
        pose = found["camera_pose"]
        K, R = (np.reshape(pose[key], (3, 3)) for key in ("cam_K", "cam_R_w2c"))
        assert (K[0, 2], K[1, 2]) == ((sample.width - 1) / 2, (sample.height - 1) / 2)
        for one, o in zip(found["object_states"], sample.objects, strict=True):
            world = o.box3d_object @ np.array(one["matrix_world"])[:3, :3].T + one["location"]
            seen = (world @ R.T + pose["cam_t_w2c"]) @ K.T
            close("hdf5", "own projection: boxes", seen[:, :2] / seen[:, 2:] + 0.5, o.box3d_pixels, "px", atol=1e-9)


def test_depth_is_where_the_camera_says(stills, written):
    """The ray through a pixel's centre: its distance is its depth times the ray's length."""
    folder = written("stills", STILL)
    for sample in stills:
        found = opened(folder, sample)
        K = np.reshape(found["camera_pose"]["cam_K"], (3, 3))
        y, x = np.indices(found["depth"].shape)
        rays = np.stack([x, y, np.ones_like(x)], -1) @ np.linalg.inv(K).T
        seen = found["depth"] < 1e9
        far = (found["depth"] * np.linalg.norm(rays, axis=-1))[seen]
        close("hdf5", "own rays: distance over depth", far / found["distance"][seen], 1.0, rtol=1e-6)


@pytest.mark.slow
def test_the_bytes_are_the_same_at_any_time(stills, written, tmp_path):
    time.sleep(1.1)  # HDF5 counts seconds
    export(stills.root, [{"hdf5": {"keys": STILL}}], output=tmp_path)
    for file in written("stills", STILL).rglob("*.hdf5"):
        assert file.read_bytes() == (tmp_path / "hdf5" / file.parent.name / file.name).read_bytes()


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """Pictures without their background of a hostile category, half of them empty, by a distorted lens."""
    out = tmp_path_factory.mktemp("odd") / "out"
    lens = {"model": "brown_conrady", "coefficients": [0.1, -0.05, 0.001, 0.002]}
    said = recipe(
        rig={"sensors": {"ahead": {}, "behind": {"rotation": [0, 180, 0]}}},
        models=[{"source": "zoo:post_box", "category": HOSTILE}],
        viewpoints={"azimuth": [0], "elevation": [20], "distance": 2.5},
        camera={"size": [64, 48], "fov_deg": 50, "distortion": lens},
        scene={}, channels=["rgba", "instances"], annotations=[], splits={},
    )  # fmt: skip
    generate(said, out)
    return Dataset(out)


def test_hostile_names_empty_pictures_and_labels_that_are_not_kept(odd, tmp_path):
    export(odd.root, "hdf5", output=tmp_path)
    for sample in odd:
        found = opened(tmp_path / "hdf5", sample)
        equal("hdf5", "h5py: pictures", found["colors"], sample.rgba)
        listed = [one["category"] for one in found["instance_attribute_maps"]]
        assert listed == (["", HOSTILE] if sample.sensor == "ahead" else [""])
        equal("hdf5", "h5py: instances", found["instance_segmaps"], sample.instances)
        assert (found["depth"] < 1e9).any() == (sample.sensor == "ahead") == found["class_segmaps"].any()
        assert found["camera_pose"]["distortion"]["coefficients"] == [0.1, -0.05, 0.001, 0.002]


def test_what_it_refuses(stills, tmp_path, monkeypatch):
    with pytest.raises(UserError, match=r"format hdf5: expected sequences .a recipe's time.; found still pictures"):
        export(stills.root, [{"hdf5": {"keys": ["forward_flow"]}}], output=tmp_path)
    for keys in (["colours"], []):
        with pytest.raises(RecipeError, match="hdf5"):
            export(stills.root, [{"hdf5": {"keys": keys}}], output=tmp_path)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"expected h5py, found none: pip install 'viewsphere\[hdf5\]'"):
        export(stills.root, "hdf5", output=tmp_path)
    assert not list(tmp_path.iterdir())
