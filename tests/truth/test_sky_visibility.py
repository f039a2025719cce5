"""What one can stand inside of."""

import numpy as np
import pytest

from truth_scenes import cube, mesh_of, sphere
from viewsphere.run.shots.camera_collisions import sky_occlusion


def hidden(mesh, *point, chosen=slice(None)):
    return sky_occlusion(mesh.vertices.astype(np.float64), mesh.triangles[chosen], np.array(point, np.float64))


@pytest.mark.parametrize("point", [(0, 0, 0), (0.49, -0.49, 0.3), (0.2, 0.1, -0.499)])
def test_in_a_box_one_sees_no_sky_with_a_floor_or_without(point):
    assert hidden(cube(), *point) == 1
    walls = np.array([t for t in range(12) if cube().vertices[cube().triangles[t], 2].max() > -0.4])
    assert len(walls) == 10
    assert hidden(cube(), *point, chosen=walls) == 1


@pytest.mark.parametrize("point", [(0.6, 0, 0), (5, 4, 3), (0, 0, 0.6)])
def test_beside_it_and_on_it_one_sees_all_that_is_overhead(point):
    assert hidden(cube(), *point) == 0


def test_below_a_roof_the_hidden_share_is_its_solid_angle():
    """From a cube's centre a face is a sixth of all directions, a third of the upper half."""
    top = np.array([t for t in range(12) if cube().vertices[cube().triangles[t], 2].min() > 0.4])
    assert hidden(cube(), 0, 0, 0, chosen=top) == pytest.approx(1 / 3, abs=0.03)
    assert hidden(cube(), 0, 0, -50, chosen=top) < 0.03


def test_a_ball_far_above_hides_its_cap():
    """Radius 1 seen from 2 away: 1 - cos 30 degrees of the upper half."""
    assert hidden(sphere(4), 0, 0, -2.0) == pytest.approx(1 - np.cos(np.pi / 6), abs=0.03)


def test_hills_around_do_not_count_as_walls():
    valley = mesh_of([[-9, -9, 5], [9, -9, 5], [9, 9, 5], [-9, 9, 5], [0, 0, -1]], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    assert hidden(valley, 0, 0, 0.5) == 0
