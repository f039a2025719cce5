"""Voxels of a model: insides against Embree's rays, surface against points on it."""

import numpy as np
import pytest
import trimesh

from cube_dataset import MESHES, make
from truth_scenes import sphere
from viewsphere.errors import StoreError
from viewsphere.model.annotations.voxels import INSIDE, TOUCHED, Occupancy


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make(tmp_path_factory.mktemp("occupancy") / "out")


@pytest.mark.parametrize("number", range(3))
def test_a_block_fills_its_share_of_the_cube(dataset, number):
    found = dataset.occupancy(f"block-{number}", 16)
    low, high = MESHES[number].bounds
    sides = (high - low) / (high - low).max() * 16
    assert found.filled.shape == (16, 16, 16) and found.cell == pytest.approx((high - low).max() / 16, rel=1e-5)
    for axis in range(3):
        others = tuple(i for i in range(3) if i != axis)
        assert abs((found.filled > 0).any(axis=others).sum() - sides[axis]) <= 2
    points = found.centers(found.filled > 0)
    assert (np.abs(points) <= np.maximum(np.abs(low), np.abs(high)) + found.cell / 2).all()
    inside = found.centers(found.filled == INSIDE)
    assert ((inside > low) & (inside < high)).all()
    np.testing.assert_array_equal(dataset.mesh(f"block-{number}").vertices, MESHES[number].vertices)


@pytest.mark.parametrize("cells", [7, 24])
def test_insides_are_those_of_embree_s_rays(cells):
    pytest.importorskip("embreex")
    ball = sphere(3, 0.8)
    found = Occupancy.from_mesh(ball.vertices + np.float32(0.1), ball.triangles, cells)
    mesh = trimesh.Trimesh(ball.vertices + np.float32(0.1), ball.triangles)
    centers = found.centers(np.ones((cells,) * 3, bool))
    contained = mesh.contains(centers).reshape((cells,) * 3)
    untouched = found.filled != TOUCHED
    np.testing.assert_array_equal(found.filled[untouched] == INSIDE, contained[untouched])
    points, _ = trimesh.sample.sample_surface(mesh, 2000, seed=0)
    at = np.floor((points - found.corner) / found.cell).astype(int)
    assert (found.filled[tuple(at.T)] == TOUCHED).mean() > 0.999
    away = np.linalg.norm(found.centers(found.filled == TOUCHED) - 0.1, axis=1) - 0.8
    assert (np.abs(away) < np.sqrt(3) / 2 * found.cell + 0.01).all()


def test_what_cannot_be(dataset):
    with pytest.raises(StoreError, match=r"expected a finished model, found no 'chair'"):
        dataset.occupancy("chair")
    for cells in (0, 2000):
        with pytest.raises(ValueError, match=r"^occupancy: expected 1 to 100,000,000 cells in all, found"):
            dataset.occupancy("block-0", cells)
    assert dataset.occupancy("block-0", 1).filled.tolist() == [[[TOUCHED]]]
