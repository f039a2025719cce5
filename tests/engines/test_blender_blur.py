"""Motion blur of Blender's renderers: what the raster engine's blur looks like, and nothing of it stays behind."""

from __future__ import annotations

import numpy as np
import pytest
from blurred_scenes import LENS, SCENES, load, meshes, picture, sharp

from viewsphere import plugins
from viewsphere.errors import RecipeError
from viewsphere.model.shot import Shot
from viewsphere.plugins.engine import EngineSpec
from viewsphere.truth.raster.visibility import rasterize

OPTIONS = {
    "cycles": {"samples": 16, "denoise": "off"},
    "eevee": {"samples": 8, "raytracing": False, "settings": {"use_shadows": False}},
}


def small(shot: Shot, engine: str) -> Shot:
    """The same picture at half its width."""
    lens = LENS.model_copy(update={"width": 120, "height": 90, "fx": 105.0, "fy": 105.0, "cx": 60.0, "cy": 45.0})
    rig = shot.rig.model_copy(update={"sensors": (shot.rig.sensors[0].model_copy(update={"intrinsics": lens}),)})
    return shot.model_copy(update={"rig": rig, "engine": engine, "engine_options": OPTIONS.get(engine, {})})


def painted(stage) -> np.ndarray:
    return stage.paint(0, 0, rasterize(stage.at(0), stage.shot.camera(0)), ("rgb",))["rgb"].astype(float)


def stage_of(shot: Shot, known):
    return plugins.load(EngineSpec, shot.engine).stage(shot, load(known))


@pytest.mark.slow
@pytest.mark.parametrize("engine, scene", [("cycles", "car"), ("cycles", "pan"), ("eevee", "car")])
def test_it_looks_as_on_raster(engine, scene, blender):
    """By most of what blur changes; and a sharp picture from the same Blender is the one of a new one.

    For EEVEE without a sun: on a processor its shadows take seconds a sample.
    """
    known, shot = meshes(), SCENES[scene](60.0)
    if engine == "eevee":
        shot = shot.model_copy(update={"scene": shot.scene.model_copy(update={"sun": None})})
    blurred, one = (picture(small(each, "raster"), known).astype(float) for each in (shot, sharp(shot)))
    stage = stage_of(small(shot, engine), known)
    found = painted(stage)
    change = blurred - one
    area = np.abs(change).max(axis=-1) > 8
    assert area.mean() > 0.05
    after = painted(stage.for_shot(small(sharp(shot), engine)))
    share = ((found - after) * change)[area].sum() / (change**2)[area].sum()
    assert 0.8 < share < 1.2, share
    assert np.abs(found - blurred)[area].mean() < 0.6 * np.abs(change)[area].mean()
    assert np.abs(after - painted(stage_of(small(sharp(shot), engine), known))).max() <= (0 if engine == "cycles" else 2)


def test_workbench_cannot(blender):
    with pytest.raises(RecipeError, match=r"time\.shutter: expected 0 with engine: workbench"):
        stage_of(small(SCENES["pan"](20.0), "workbench"), meshes())


@pytest.mark.slow
def test_passes_beside_a_blurred_picture_are_sharp(blender):
    """They are those of the shutter's centre, and leave the picture as it is."""
    known, shot = meshes(), SCENES["car"](60.0)
    stage, names = stage_of(small(shot, "cycles"), known), ("rgb", "albedo", "residual", "roughness")
    seen = rasterize(stage.at(0), stage.shot.camera(0))
    found, alone = stage.paint(0, 0, seen, names), stage.paint(0, 0, seen, ("rgb",))
    still = stage_of(small(sharp(shot), "cycles"), known).paint(0, 0, seen, names)
    assert found["rgb"].tobytes() == alone["rgb"].tobytes() != still["rgb"].tobytes()
    for name in names[1:]:
        np.testing.assert_allclose(found[name], still[name], atol=1e-5, err_msg=name)
