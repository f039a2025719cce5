"""Scenes drawn from a recipe: what is concrete, when it is drawn, and from whose names."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.scene import (
    AreaLight,
    Background,
    Daylight,
    Environment,
    Finish,
    Ground,
    HemisphereLight,
    PointLight,
    Scene,
    Sky,
    Smoother,
    SpotLight,
    Sun,
    ViewTransform,
)
from viewsphere.model.shot import Shot
from viewsphere.planning.distances import Distances
from viewsphere.planning.plan import check_images, plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.effects import EffectsEntry

CARS = [{"source": "zoo:car", "count": 3}]
VIEWS = {"azimuth": {"start": 0, "stop": 360, "step": 45}, "distance": 5}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scene")
    (path / "photos").mkdir()
    (path / "skies").mkdir()
    for i in range(12):
        Image.new("RGB", (8, 6), (i, 0, 0)).save(path / "photos" / f"{i:02}.png")
        (path / "skies" / f"{i:02}.hdr").write_bytes(b"#?RADIANCE\n\n-Y 2 +X 4\n")
    Image.new("RGB", (4, 4)).save(path / "stone.png")
    (path / "day.exr").write_bytes(b"\x76\x2f\x31\x01\x02\x00\x00\x00")
    (path / "fake.exr").write_bytes(b"no picture at all")
    return path


def planned(scene, folder=Path(), **fields):
    data = {"models": CARS, "viewpoints": VIEWS, "formats": [], "scene": scene, **fields}
    return plan(Recipe.model_validate(data, context={"folder": folder}))


def scene_of(scene, folder=Path()) -> Scene:
    return planned(scene, folder).shot(0, box_of).scene


def finishes(scene, folder=Path(), **fields):
    found = planned(scene, folder, **fields)
    return {
        (shot.things[0].model.key, frame.viewpoint.azimuth_deg): frame.finish or shot.scene.finish
        for shot in found.shots(box_of)
        for frame in shot.instants
    }


def box_of(spec, step=None):
    return Box3d.between((-1.0, -2.0, -0.5), (1.0, 2.0, 1.5)).corners


def test_a_recipe_without_a_word_on_its_scene_has_the_default_one():
    found = planned({})
    shot = found.shot(0, box_of)
    assert shot.scene == PLAIN
    assert {f.finish for f in shot.instants} == {None}
    assert shot.things[0].repaints == ()


def effects(**values):
    """The effects of a shot with these strengths and options, the others at 0."""
    return EffectsEntry.of_defaults().effects.model_copy(update=values)


PLAIN = Scene(ground=Ground(), finish=Finish(effects=effects()))

CONCRETE = [
    ({"sun": "off"}, {"sun": None}),
    ({"sun": "on"}, {"sun": Sun()}),
    ({"sun": {"azimuth": 10, "strength": 2, "color": "white"}}, {"sun": Sun(azimuth=10, strength=2, color=(1, 1, 1))}),
    ({"sky": {"zenith": [1, 2, 3]}}, {"sky": Sky(zenith=(1, 2, 3))}),
    ({"sky": "daylight"}, {"sky": Daylight()}),
    ({"sky": {"daylight": {"clouds": 1}}}, {"sky": Daylight(clouds=1)}),
    ({"ground": "off"}, {"ground": None}),
    ({"ground": "#336699"}, {"ground": Ground(color=(0.2, 0.4, 0.6))}),
    ({"ground": "catcher"}, {"ground": Ground(catcher=True)}),
    ({"ground": {"metallic": 1, "tile": 3}}, {"ground": Ground(metallic=1, tile=3)}),
    ({"background": "environment"}, {"ground": Ground(catcher=True)}),
    (
        {"background": "transparent"},
        {"ground": None, "finish": Finish(background=Background(transparent=True), effects=effects())},
    ),
    ({"background": "white"}, {"ground": None, "finish": Finish(background=Background(color=(1, 1, 1)), effects=effects())}),
    ({"smoother": "box"}, {"finish": Finish(smoother=Smoother(kind="box"), effects=effects())}),
    ({"view": "agx"}, {"finish": Finish(view=ViewTransform(transform="agx"), effects=effects())}),
    ({"view": {"exposure": -1, "tint": 0.2}}, {"finish": Finish(view=ViewTransform(exposure=-1, tint=0.2), effects=effects())}),
    ({"effects": {"blur": 0.1, "focus": 4}}, {"finish": Finish(effects=effects(blur=0.1, focus=4))}),
    (
        {"lights": {"position": [1, 2, 3], "strength": 4, "color": "#ff0000"}},
        {"lights": (PointLight(position=(1, 2, 3), strength=4, color=(1, 0, 0)),)},
    ),
    (
        {"lights": [{"kind": "spot", "position": [0, 0, 3], "strength": 4, "toward": [0, 0, 1], "angle_deg": 30, "count": 2}]},
        {"lights": 2 * (SpotLight(position=(0, 0, 3), strength=4, toward=(0, 0, 1), angle_deg=30),)},
    ),
    (
        {"lights": [{"kind": "area", "position": [0, 0, 3], "strength": 4, "size": [2, 1]}]},
        {"lights": (AreaLight(position=(0, 0, 3), strength=4, size=(2, 1)),)},
    ),
    (
        {"lights": [{"kind": "hemisphere", "strength": 1, "below": [0.1, 0, 0]}]},
        {"lights": (HemisphereLight(strength=1, below=(0.1, 0, 0)),)},
    ),
]


@pytest.mark.parametrize(("scene", "parts"), CONCRETE)
def test_every_entry_becomes_a_part_of_the_scene(scene, parts):
    found = scene_of(scene)
    assert found == PLAIN.model_copy(update=parts)


@pytest.mark.parametrize(("place", "stops"), [(None, 0), ("zoo:neighbourhood", 0), ("zoo:room", 3.5), ("zoo:table_top", 3.5)])
def test_a_room_is_exposed_as_what_is_indoors_unless_the_recipe_says_otherwise(place, stops):
    scene = {"place": place} if place else {}
    assert scene_of(scene).finish.view.exposure == stops
    assert scene_of({**scene, "view": {"exposure": -1.0}}).finish.view.exposure == -1


def test_weather_stays_outdoors_of_a_room_and_its_light_comes_in():
    weather = {"rain": 12, "fog": 200}
    inside, outside = (scene_of({"place": place, **weather}) for place in ("zoo:room", "zoo:neighbourhood"))
    assert outside.rain and outside.fog and outside.wet
    assert (inside.rain, inside.fog, inside.wet, inside.snow) == (None,) * 4
    assert (inside.sun, inside.sky) == (outside.sun, outside.sky) != (scene_of({}).sun, scene_of({}).sky)
    assert inside.fog_outdoors == outside.fog and outside.fog_outdoors is None
    low = {"fog": {"visibility": 60, "height": 5}}
    inside, outside = (scene_of({"place": place, **low}) for place in ("zoo:room", "zoo:neighbourhood"))
    assert inside.lights == outside.lights != ()
    assert scene_of({"place": "zoo:room", "sky": "night"}).lamps is not None


@pytest.mark.parametrize("place", [{}, {"place": "zoo:neighbourhood"}, {"place": "zoo:room"}])
def test_an_exposure_counts_in_the_digest(place):
    scenes = (place, place | {"view": {"exposure": 0}}, place | {"view": {"exposure": 1}})
    assert len({Recipe(models=CARS, viewpoints=VIEWS, scene=scene).digest for scene in scenes}) == 3


@pytest.mark.parametrize(("exposure", "said"), [(40, "less than or equal to 16"), ("bright", "auto")])
def test_a_wrong_exposure_is_told_once(exposure, said):
    with pytest.raises(RecipeError, match=said) as found:
        planned({"view": {"exposure": exposure}})
    assert len(str(found.value).splitlines()) == 1


def test_lamps_stand_where_cameras_of_their_angles_would():
    at = {"azimuth": 90, "elevation": 30, "distance": 2}
    (lamp,) = scene_of({"lights": {"at": at, "strength": 1}}).lights
    assert lamp.position == pytest.approx((2 * math.cos(math.radians(30)), 0, 1))


def test_a_sun_by_date_time_and_place_stands_in_its_part_of_the_world():
    where = {"date": "2024-06-20", "latitude": 51.5, "longitude": 0}
    noon = scene_of({"sun": {**where, "time": "14:02+02:00", "strength": 5}}).sun
    assert noon.azimuth == pytest.approx(360, abs=0.5)  # in the south, -Y
    assert (noon.elevation, noon.strength) == (pytest.approx(61.94, abs=0.05), 5)
    assert 60 < scene_of({"sun": {**where, "time": "07:00Z"}}).sun.azimuth < 120  # in the east, +X
    night = planned({"sun": {**where, "time": "23:00Z"}})
    assert night.shot(0, box_of).scene.sun is None
    assert any("below the horizon" in warning for warning in night.warnings)
    assert scene_of({"sun": {**where, "time": "23:00Z"}, "sky": "daylight"}).sky.strength == 0
    assert planned({"sun": {**where, "time": [0, 24]}}).warnings == planned({}).warnings


def test_an_environment_brings_its_own_sun(folder):
    shot = planned({"sky": {"hdri": "day.exr", "rotation_deg": 90, "strength": 2}}, folder).shot(0, box_of)
    assert shot.scene.sky == Environment(file=str(folder / "day.exr"), rotation_deg=90, strength=2)
    assert shot.scene.sun is None
    assert scene_of({"sky": "day.exr", "sun": "on"}, folder).sun == Sun()
    assert scene_of({"sky": "day.exr", "sun": {}}, folder).sun == Sun()


def test_pictures_of_the_ground_are_found_beside_the_recipe(folder):
    ground = scene_of({"ground": {"image": "stone.png", "roughness_image": "stone.png", "roughness": 0.3}}, folder).ground
    stone = str(folder / "stone.png")
    assert ground == Ground(color=(1, 1, 1), image=stone, roughness_image=stone, roughness=0.3)
    assert scene_of({"ground": {"image": "stone.png", "color": "red"}}, folder).ground.color == (1, 0, 0)


def test_transparent_pictures_are_kept_as_rgba():
    assert planned({"background": "transparent"}, channels=["depth", "rgb"]).shot(0, box_of).channels == ("depth", "rgba")
    assert planned({"background": "transparent"}, channels=["rgba", "rgb"]).shot(0, box_of).channels == ("rgba",)
    assert planned({}, channels=["rgb"]).shot(0, box_of).channels == ("rgb",)


MISSING = [
    ({"sky": "none.exr"}, "scene.sky.hdri: expected daylight, a file or a folder with files (.exr, .hdr); found /"),
    ({"sky": {"choice": ["day.exr", "none.exr"]}}, "scene.sky.hdri: expected daylight, a file"),
    ({"sky": "photos"}, "scene.sky.hdri: expected daylight, a file"),
    ({"ground": {"normal_image": "none.png"}}, "scene.ground.normal_image: expected an image file; found none at "),
    ({"ground": {"choice": ["red", {"image": "skies"}]}}, "scene.ground.image: expected an image file; found none at "),
    ({"background": {"image": {"choice": ["stone.png", "x.png"]}}}, "scene.background.image: expected an image file"),
    ({"materials": [{"models": "boat_*", "metallic": 1}]}, "scene.materials[0].models: expected a pattern of models' keys, "),
]


@pytest.mark.parametrize(("scene", "message"), MISSING)
def test_files_and_models_that_are_not_there_are_named(folder, scene, message):
    with pytest.raises(RecipeError) as caught:
        planned(scene, folder)
    assert str(caught.value).startswith(message)


def test_files_that_are_no_pictures_are_named_before_rendering(folder):
    check_images(planned({"sky": "skies", "ground": {"image": "stone.png"}, "background": {"images": "photos"}}, folder))
    with pytest.raises(RecipeError, match=r"scene.sky.hdri: expected an OpenEXR or Radiance HDR file; found another kind in"):
        check_images(planned({"sky": "fake.exr"}, folder))
    with pytest.raises(RecipeError, match=r"scene.ground.image: expected a readable image; found none of PNG, JPEG, .* in "):
        check_images(planned({"ground": {"image": "fake.exr"}}, folder))


def test_a_large_picture_is_no_reason_for_a_warning(tmp_path, recwarn):
    Image.new("1", (12_000, 8_000)).save(tmp_path / "large.png")
    check_images(planned({"background": {"image": "large.png"}}, tmp_path))
    assert not recwarn.list


RANDOM = {
    "sun": {"azimuth": [0, 360], "elevation": {"normal": [40, 20]}, "color": {"uniform": [[0.8, 0.8, 0.8], [1, 1, 1]]}},
    "sky": {"strength": {"log_uniform": [0.5, 2]}},
    "lights": [{"position": [[-2, 2], [-2, 2], 3], "strength": [1, 2], "count": {"uniform": [1, 3]}}],
    "ground": {"color": {"uniform": ["#333333", "#dddddd"]}, "roughness": [0.2, 1]},
}


def test_the_stage_is_drawn_once_a_model_by_default():
    found = planned(RANDOM, shot_frames=2)
    scenes = {}
    for shot in found.shots(box_of):
        scenes.setdefault(shot.things[0].model.key, set()).add(shot.scene.model_dump_json())
        assert len(shot.instants) == 2
    assert [len(s) for s in scenes.values()] == [1, 1, 1]
    assert len(set.union(*scenes.values())) == 3


def test_the_stage_is_drawn_once_for_all_or_for_every_frame_where_that_is_asked_for():
    assert len({s.scene.model_dump_json() for s in planned({**RANDOM, "draw": "fixed"}).shots(box_of)}) == 1
    shots = list(planned({**RANDOM, "draw": "per_frame"}).shots(box_of))
    assert {len(s.instants) for s in shots} == {1}
    assert len({s.scene.model_dump_json() for s in shots}) == 24
    assert {len(s.instants) for s in planned({"draw": "per_frame"}).shots(box_of)} == {8}  # nothing to draw


def test_same_seed_same_draw_and_another_seed_another():
    again = [list(planned(RANDOM, seed=seed).shots(box_of)) for seed in (5, 5, 6)]
    assert again[0] == again[1]
    assert again[0][0].scene != again[2][0].scene


def test_more_models_poses_and_fields_change_nobody_else_s_draw():
    def scenes(**fields):
        return {s.things[0].model.key: s.scene for s in planned(**fields).shots(box_of)}

    few = scenes(scene=RANDOM)
    more = scenes(scene=RANDOM, models=[{"source": "zoo:boat"}, {"source": "zoo:car", "count": 5}])
    assert all(more[key] == scene for key, scene in few.items())
    sun = {**RANDOM["sun"], "strength": [1, 2], "angle_deg": {"choice": [1, 2]}}
    lights = [{**RANDOM["lights"][0], "color": {"choice": ["red", "blue"]}}, {"kind": "hemisphere", "strength": [0, 1]}]
    other = scenes(scene={**RANDOM, "sun": sun, "lights": lights, "materials": [{"roughness": [0, 1]}]})
    for key, scene in few.items():
        assert other[key].sun.azimuth == scene.sun.azimuth
        assert other[key].sun.elevation == scene.sun.elevation
        assert other[key].ground == scene.ground
        assert [lamp.position for lamp in other[key].lights[:-1]] == [lamp.position for lamp in scene.lights]


def test_each_of_several_lamps_is_drawn_by_itself():
    lights = scene_of({"lights": [{"position": [[-2, 2], 0, 3], "strength": [1, 2], "count": 20}]}).lights
    assert len({lamp.position for lamp in lights}) == len({lamp.strength for lamp in lights}) == 20
    counts = {len(s.scene.lights) for s in planned(RANDOM, models=[{"source": "zoo:car", "count": 30}]).shots(box_of)}
    assert counts == {1, 2, 3}


@pytest.mark.slow
def test_statistics_of_a_field_over_models():
    found = planned({"sun": {"elevation": [10, 70]}}, models=[{"source": "zoo:car", "count": 1000}])
    heights = np.array([found.shot(i, box_of).scene.sun.elevation for i in range(found.shot_count)])
    assert 10 <= heights.min() < 11
    assert 69 < heights.max() <= 70
    assert abs(heights.mean() - 40) < 4 * 60 / math.sqrt(12 * 1000)


def test_the_finish_is_drawn_for_every_frame_by_default():
    scene = {
        "background": {"choice": ["white", {"color": [[0, 1], 0, 0]}]},
        "smoother": {"kind": {"choice": ["none", "box", "gaussian"]}, "size": [1, 3]},
        "view": {"exposure": {"normal": [0, 0.5]}, "draw": "per_model"},
        "effects": {"jpeg": [0, 0.4], "hue": [-0.1, 0.1], "draw": "fixed"},
    }
    found = finishes(scene)
    assert len({f.smoother for f in found.values()}) > 15
    assert len({f.background.color for f in found.values()}) > 5
    assert len({f.view for f in found.values()}) == 3
    assert len({f.effects for f in found.values()}) == 1
    more = finishes(scene, models=[{"source": "zoo:boat"}, *CARS], viewpoints={"azimuth": [7, 45, 90], "distance": 5})
    both = found.keys() & more.keys()
    assert len(both) == 6
    assert all(found[key] == more[key] for key in both)


def test_a_finish_that_is_not_drawn_for_frames_is_the_scene_s():
    scene = {"view": {"exposure": [-1, 1], "draw": "per_model"}, "effects": {"vignetting": 0.2}}
    shots = list(planned(scene).shots(box_of))
    assert {f.finish for s in shots for f in s.instants} == {None}
    assert len({s.scene.finish.view.exposure for s in shots}) == 3
    assert {s.scene.finish.effects.vignetting for s in shots} == {0.2}


def test_noise_is_another_in_every_frame():
    found = finishes({"effects": {"read_noise": 0.1}})
    assert len({f.effects.seed for f in found.values()}) == 24
    assert {f.effects.read_noise for f in found.values()} == {0.1}
    assert found == finishes({"effects": {"read_noise": 0.1}})


def test_folders_of_skies_are_drawn_with_the_stage_and_of_photos_with_the_frame(folder):
    found = planned({"sky": "skies", "background": {"images": "photos", "flip": {"choice": [True, False]}}}, folder)
    shots = list(found.shots(box_of))
    assert {len(s.instants) for s in shots} == {8}
    assert len({s.scene.sky.file for s in shots}) > 1
    assert len({f.finish.background.image for s in shots for f in s.instants}) > 6
    assert {f.finish.background.flip for s in shots for f in s.instants} == {True, False}
    assert {len(s.instants) for s in planned({"sky": "skies", "draw": "per_frame"}, folder).shots(box_of)} == {1}
    assert {len(s.instants) for s in planned({"sky": "day.exr", "draw": "per_frame"}, folder).shots(box_of)} == {8}


def test_materials_are_drawn_for_the_models_they_fit():
    scene = {
        "materials": [
            {"models": "car_00[01]", "material": "paint*", "tint": {"uniform": ["#404040", "#ffffff"]}},
            {"roughness": [0.2, 0.6]},
        ]
    }
    paints = {s.things[0].model.key: s.things[0].repaints for s in planned(scene).shots(box_of)}
    assert [len(p) for p in paints.values()] == [2, 2, 1]
    assert paints["car_000"][0].material == "paint*"
    assert len({p[0].tint for p in list(paints.values())[:2]}) == 2
    assert all(0.2 <= p[-1].roughness <= 0.6 for p in paints.values())
    fixed = [s.things[0].repaints for s in planned({**scene, "draw": "fixed"}).shots(box_of)]
    assert fixed[0] == fixed[1] == (*fixed[0][:1], *fixed[2])


def test_company_is_painted_too_and_looks_alike_beside_others():
    scene = {"materials": [{"tint": {"uniform": ["#404040", "#ffffff"]}}], "company": 2}
    shots = list(planned(scene, splits={"by": "model", "all": 1}).shots(box_of))
    paints = {(p.model.key, p.repaints) for s in shots for p in s.things}
    assert len(paints) == 3
    per_frame = planned({**scene, "draw": "per_frame"}, splits={"by": "model", "all": 1}).shots(box_of)
    assert len({p.repaints for s in per_frame for p in s.things}) == 24 * 3


def test_jitter_moves_every_pose_a_little_and_keeps_its_index_and_name():
    scene = {"jitter": {"azimuth": {"normal": [0, 3]}, "elevation": [-5, 5], "distance": [-0.1, 0.1], "tilt": [-2, 2]}}
    frames = [f for s in planned(scene).shots(box_of) for f in s.instants]
    nominal = [f for s in planned({}).shots(box_of) for f in s.instants]
    assert [(f.index, f.viewpoint.index, f.split) for f in frames] == [(f.index, f.viewpoint.index, f.split) for f in nominal]
    offsets = np.array(
        [
            [a.azimuth_deg - b.azimuth_deg, a.elevation_deg - b.elevation_deg, a.distance / b.distance - 1, a.tilt_deg]
            for a, b in ((f.viewpoint, n.viewpoint) for f, n in zip(frames, nominal, strict=True))
        ]
    )
    assert len(np.unique(offsets, axis=0)) == 24
    assert (np.abs(offsets) <= [15, 5, 0.1 + 1e-9, 2]).all()
    assert (offsets.std(axis=0) > [1.5, 1.5, 0.03, 0.6]).all()
    assert {f.viewpoint.target for f in frames} == {None}


def test_jitter_names_the_side_that_the_camera_truly_sees_and_stops_at_the_pole():
    (frame, *_) = planned({"jitter": {"azimuth": 30, "elevation": 80}}).shot(0, box_of).instants
    assert (frame.viewpoint.azimuth_deg, frame.viewpoint.elevation_deg, frame.viewpoint.category) == (30, 90, "top")
    (frame, *_) = planned({"jitter": {"azimuth": 30}}).shot(0, box_of).instants
    assert frame.viewpoint.category == "front-left"


def test_a_jittered_target_lies_around_the_models_centre_or_the_given_one():
    scene = {"jitter": {"target": {"uniform": [[-0.1, -0.1, 0], [0.1, 0.1, 0]]}}}
    targets = np.array([f.viewpoint.target for s in planned(scene).shots(box_of) for f in s.instants])
    assert (np.abs(targets - [0, 0, 0.5]) <= [0.1 + 1e-9, 0.1 + 1e-9, 1e-9]).all()
    assert len(np.unique(targets, axis=0)) == 24
    given = planned(scene, viewpoints={**VIEWS, "target": [1, 2, 3]}).shot(0, box_of).instants
    assert all(abs(f.viewpoint.target[0] - 1) <= 0.1 and f.viewpoint.target[2] == 3 for f in given)


def test_jitter_into_a_model_is_found_before_rendering():
    found = planned({"jitter": {"draw": "per_model", "distance": [-0.9, -0.89], "target": [0, 0, [0, 0.1]]}})
    problem = Distances(found, box_of).problem("car_001")
    assert problem is not None
    assert "is inside the model" in str(problem)
    assert str(problem).endswith("(model car_001)")
    again = planned({"jitter": {"distance": [-0.8, 0], "target": [0, 0, [0, 0.1]]}})
    assert Distances(again, box_of).problem("car_001") is None  # the shot draws such a frame again
    calm = planned({"jitter": {"draw": "per_model", "distance": [-0.2, 0.1]}})
    assert Distances(calm, box_of).problem("car_001") is None


def test_a_shot_of_a_random_scene_is_plain_json():
    shot = planned({**RANDOM, "effects": {"shot_noise": [0, 0.1]}, "materials": [{"metallic": [0, 1]}]}).shot(0, box_of)
    assert Shot.model_validate_json(shot.model_dump_json()) == shot


def test_lists_of_many_frames_are_made_quickly():
    effects = {"blur": [0, 0.1], "jpeg": [0, 0.5]}
    found = planned({**RANDOM, "effects": effects}, models=[{"source": "zoo:car", "count": 20}])
    started = time.process_time()
    frames = sum(len(s.instants) for s in found.shots(box_of))
    assert (time.process_time() - started) / frames < 0.004
