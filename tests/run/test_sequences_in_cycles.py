"""A sequence has the same labels, byte for byte, whichever engine painted its pictures."""

import numpy as np

import viewsphere as vs
from sequence_recipe import CHANNELS, eventful_recipe

ENGINES = {"raster": {"name": "raster"}, "cycles": {"name": "cycles", "samples": 1, "denoise": "off"}}


def test_labels_of_a_sequence_are_the_same_on_raster_and_in_cycles(blender, tmp_path):
    made = {}
    for name, engine in ENGINES.items():
        vs.generate(eventful_recipe(6, engine=engine, formats=[]), tmp_path / name, workers=0)
        made[name] = vs.open(tmp_path / name)
    compared = 0
    for ours, theirs in zip(made["raster"], made["cycles"], strict=True):
        assert ours.files.keys() == theirs.files.keys() >= {*CHANNELS, "tracks"}
        for channel in ours.files.keys() - {"rgb"}:
            a, b = (made[name].path(s.files[channel]).read_bytes() for name, s in (("raster", ours), ("cycles", theirs)))
            assert a == b, f"{channel} of {ours.sequence}, instant {ours.instant}, {ours.sensor}"
            compared += 1
        facts = [
            [(o.id, o.key, o.box2d, o.rle, o.visibility, o.world_from_object.tolist()) for o in sample.objects]
            for sample in (ours, theirs)
        ]
        assert facts[0] == facts[1]
        assert np.array_equal(ours.camera.R, theirs.camera.R) and not np.array_equal(ours.rgb, theirs.rgb)
    assert compared == 2 * 6 * 2 * len(CHANNELS)
