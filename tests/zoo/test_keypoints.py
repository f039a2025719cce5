"""The zoo's named points: of every member, on it, left at +X, mirrored where the names say so."""

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere.assets.cache import _part_points, load
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.model_metadata import metadata_of
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.model.model_spec import ModelSpec

NAMED = {
    "bed": {"mattress_foot_left", "mattress_head_right", "headboard_top_left", "leg_foot_right"},
    "backpack": {"handle", "pocket", "strap_left", "bottom_rear_right"},
    "bench": {"seat_front_left", "seat_rear_right"},
    "bicycle": {"wheel_front", "wheel_rear", "saddle", "grip_left", "pedal_right"},
    "bollard": {"top", "foot"},
    "boat": {"bow", "stern_left"},
    "book": {"cover", "pages"},
    "bottle": {"top", "base"},
    "bowl": {"rim", "base"},
    "box": {"base_front_left", "top_rear_right"},
    "can": {"top", "base"},
    "bus": {"wheel_front_left", "taillight_right", "roof_rear_left", "door", "windshield"},
    "cabinet": {"top_front_left", "top_rear_right", "bottom_front_left"},
    "car": {"wheel_front_left", "wheel_rear_right", "headlight_left", "taillight_right"},
    "chair": set(),
    "fountain": {"top", "basin_left"},
    "hair_drier": {"nozzle", "inlet", "handle", "switch"},
    "house": {"door", "roof", "eaves_front_left"},
    "lamp": {"foot", "bulb", "shade", "shade_top"},
    "lamp_post": {"lamp", "foot"},
    "laptop": {"base_front_left", "lid_top_right", "keyboard", "screen"},
    "monitor": {"screen_top_left", "screen_bottom_right", "neck", "foot"},
    "mug": {"rim", "base", "handle"},
    "plant": {"pot_rim", "pot_base", "top"},
    "plate": {"rim_front", "rim_rear", "base"},
    "motorcycle": {"wheel_front", "seat", "grip_left", "headlight"},
    "post_box": {"slot", "door", "top"},
    "refrigerator": {"top_front_left", "bottom_rear_right"},
    "road_sign": {"plate", "foot"},
    "rug": {"corner_front_left", "corner_rear_right"},
    "shelf": {"top_front_left", "foot_rear_right"},
    "sofa": {"seat_front_left", "back_top_right", "armrest_front_left", "foot_rear_right"},
    "table": {"top_front_left", "top_rear_right"},
    "shop": {"sign", "door", "eaves_front_left", "wall_rear_right"},
    "traffic_cone": {"tip", "foot_front_left"},
    "traffic_light": {"red", "amber", "green", "foot"},
    "truck": {"wheel_front_left", "mirror_right", "load_rear_left", "headlight_right"},
    "television": {"screen_top_left", "screen_bottom_right"},
    "wheelie_bin": {"wheel_left", "handle_right"},
}
"""Points that every member of a family has."""


def traits(family, seed, **settings):
    spec = ModelSpec(key="a", source=f"zoo:{family}", seed=seed, category="a", category_id=1, **settings)
    mesh, facts = load(spec)
    return mesh, metadata_of(spec, mesh, facts)


def test_families_with_named_points():
    known = {name for name in zoo.family_names() if zoo.family(name).keypoints}
    assert known == NAMED.keys()


@pytest.mark.parametrize("family", quick(NAMED, *list(NAMED)[::3]))
def test_named_points_of_a_family(family):
    known = zoo.family(family)
    assert {name for pair in known.skeleton for name in pair} <= known.keypoints.keys()
    mesh, found = traits(family, 2, centring="box", scale=2.0)
    low, high = mesh.bounds
    points = {name: np.array(place) for name, place in found.keypoints.points.items()}
    assert points.keys() >= NAMED[family]
    for name, place in points.items():
        assert (place >= low - 1e-5).all() and (place <= high + 1e-5).all(), name
    for left, right in found.keypoints.flips:
        assert points[left][0] > points[right][0], left
    sides = {name for name in points if "_left" in name or "_right" in name}
    assert sides == {name for pair in found.keypoints.flips for name in pair}


def test_a_cars_wheels_are_below_its_lights_and_its_front_faces_minus_y():
    points = traits("car", 1)[1].keypoints.points
    assert points["headlight_left"][1] < points["wheel_front_left"][1] < 0 < points["wheel_rear_left"][1]
    assert points["wheel_front_left"][2] < points["headlight_left"][2]
    np.testing.assert_allclose(points["wheel_front_left"], np.multiply(points["wheel_front_right"], (-1, 1, 1)), atol=1e-4)


def test_places_in_boxes_around_parts():
    corners = np.array([(0, 0, 0), (2, 0, 0), (0, 4, 6), (9, 9, 9), (8, 9, 9), (9, 9, 8)], np.float32)
    mesh = Mesh(
        corners, np.array([[0, 1, 2], [3, 4, 5]], np.int32), np.tile(np.float32([0, 0, 1]), (6, 1)),
        np.zeros(2, np.int32), np.array([0, 1], np.int32), parts=("seat", "lamp_left"),
    )  # fmt: skip
    places = {
        "middle": At("pad|seat"),
        **sided("corner", "seat", (1, -1, -1)),
        **sided("lamp", "lamp_{}"),
        "top": At("seat", (0, 0, 1)),
        "none": At("roof"),
    }
    found = _part_points(mesh, places, [("middle", "lamp_left"), ("middle", "none")])
    assert found.points == {
        "middle": (1, 2, 3), "corner_left": (2, 0, 0), "corner_right": (0, 0, 0), "lamp_left": (8.5, 9, 8.5), "top": (1, 2, 6),
    }  # fmt: skip
    assert found.skeleton == (("middle", "lamp_left"),) and found.flips == (("corner_left", "corner_right"),)
    assert _part_points(mesh, {"none": At("roof")}) is None
