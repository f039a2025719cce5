"""materials: which of its model's materials is seen, by every lens; names are in the data set; its proof notices others."""

import json
from dataclasses import replace

import numpy as np
import pytest

from label_scenes import changed, embree, pictured, proof, random_camera, random_things
from proven import equal
from sealing import seal_again
from small import small_recipe
from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, placed
from viewsphere import generate
from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.mesh import Material
from viewsphere.check import check
from viewsphere.labels import channel_labels, observe
from viewsphere.store import Dataset
from viewsphere.truth.raster.visibility import rasterize

NAMES = ("depth", "instances", "triangles", "materials")
SIX = tuple(Material(name=f"m{i}") for i in range(6))


def dressed(mesh):
    """The mesh with six materials, one triangle of each after another."""
    return replace(mesh, materials=SIX, triangle_material=(np.arange(len(mesh.triangles)) % 6).astype(np.int32))


def sample_of(seed, lens_name, **changes):
    rng = np.random.default_rng(seed)
    things, meshes = random_things(rng)
    return pictured(things, [dressed(mesh) for mesh in meshes], random_camera(rng, lens_name), NAMES, **changes)


def test_each_side_of_a_cube_has_its_own():
    box = cube(0.7)
    mesh = mesh_of(box.vertices, box.triangles, materials=SIX, triangle_material=np.repeat(np.arange(6), 2).astype(np.int32))
    for azimuth, expected in ((0.0, 3), (np.pi / 2, 2), (np.pi, 4)):  # cube: -x, +x, -y, +y, -z, +z
        camera = orbit_camera(lens(32, 32), azimuth, 0, 4.0)
        geometry = placed(mesh)
        found = observe(geometry, camera, rasterize(geometry, camera), ["materials"])["materials"]
        assert set(np.unique(found)) == {0, expected}


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(2))
def test_embree_meets_triangles_of_these(name, seed):
    pytest.importorskip("embreex")
    sample, geometry, visibility = sample_of(seed, name)
    triangle, _ = embree(geometry, sample.camera)
    same = (triangle == visibility.triangle) & (sample.instances > 0)
    start = np.array((0, *geometry.triangle_start))[sample.instances[same]]
    assert same.sum() > 300
    equal("materials", "Embree's rays", sample.materials[same], (triangle[same] - start) % 6 + 1)
    assert (sample.materials[sample.instances == 0] == 0).all()


@pytest.mark.parametrize("name", EVERY)
def test_its_proof_notices_others(name):
    sample, *_ = sample_of(1, name)
    assert proof(channel_labels()["materials"], sample) == []
    pairs = sample.triangles * 10 + sample.instances
    shared = np.argwhere(
        (sample.instances > 0)
        & (np.unique(pairs, return_counts=True)[1] > 1)[np.unique(pairs, return_inverse=True)[1].reshape(pairs.shape)]
    )
    thing, background = tuple(shared[0]), tuple(np.argwhere(sample.instances == 0)[3])
    for change in (
        lambda a: a.__setitem__(thing, a[thing] % 6 + 1),
        lambda a: a.__setitem__(thing, 0),
        lambda a: a.__setitem__(background, 1),
    ):
        assert proof(channel_labels()["materials"], changed(sample, "materials", change))


@pytest.mark.slow
def test_names_are_in_the_data_set_and_proved(tmp_path):
    generate(small_recipe(channels=["rgb", "instances", "triangles", "materials"], formats=[]), tmp_path)
    dataset = Dataset(tmp_path)
    models = {info.key: info for info in dataset.models}
    for sample in dataset:
        (o,) = sample.objects
        info, own = models[o.key], sample.instances > 0
        mesh = read_exported(dataset.path(info.glb), info.parts, whole=True)
        assert info.materials == tuple(m.name for m in mesh.materials) and {"paint", "dark"} <= set(info.materials)
        np.testing.assert_array_equal(sample.materials[own], mesh.triangle_material[sample.triangles[own]] + 1)
        few = {o.key: replace(info, materials=info.materials[:1])}
        assert any("expected the materials 1 to 1" in line for line in channel_labels()["materials"].prove(sample, few))
    assert check(dataset, rays=False).ok
    file = next(tmp_path.glob("store/models/*/model.json"))
    told = json.loads(file.read_text())
    file.write_text(json.dumps(told | {"materials": ["wood", *told["materials"][1:]]}))
    seal_again(tmp_path)
    assert {f.check for f in check(Dataset(tmp_path), rays=False).findings} == {"models", "sources"}
