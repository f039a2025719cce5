"""What a worker keeps warm."""

import numpy as np
import pytest

from viewsphere.assets.cache import load
from viewsphere.model.model_spec import ModelSpec
from viewsphere.run.shots import stages
from viewsphere.run.shots.stages import Stages

DRIER = ModelSpec(key="d", source="zoo:hair_drier", seed=3, category="hair drier", category_id=1)


def test_the_real_size_is_the_one_set_or_that_of_the_file_before_scaling():
    warm = Stages()
    assert warm.real_size(DRIER) is None
    assert warm.real_size(DRIER.model_copy(update={"real_size": (1.0, 2.0, 3.0)})) == (1, 2, 3)
    file = DRIER.model_copy(update={"real_size": "file"})
    width, length, height = np.ptp(warm.model(file).bounds, axis=0)
    scaled = file.model_copy(update={"scale": 5.0})
    assert np.ptp(warm.model(scaled).bounds, axis=0)[1] == np.float32(5)
    assert np.allclose(warm.real_size(scaled), (width, height, length), rtol=1e-12)


def test_a_model_at_its_own_scale_is_built_once(monkeypatch):
    built = []
    monkeypatch.setattr(stages, "load", lambda spec, step=None: built.append(spec) or load(spec, step=step))
    warm, spec = Stages(), DRIER.model_copy(update={"real_size": "file"})
    warm.model(spec)
    warm.real_size(spec)
    assert len(built) == 1


@pytest.mark.slow
def test_models_used_last_are_kept_as_far_as_there_is_room(monkeypatch):
    built = []
    monkeypatch.setattr(stages, "load", lambda spec, step=None: built.append(spec) or load(spec, step=step))
    specs = [DRIER.model_copy(update={"key": f"d{i}", "seed": i}) for i in range(12)]
    warm = Stages()
    for spec in (*specs, *specs):
        warm.model(spec)
    assert len(built) == 12  # a place has many pieces, and all of them are needed again
    monkeypatch.setattr(stages, "WARM_BYTES", 2.5 * sum(stages._size(warm.model(s)) for s in specs) / 12)
    warm = Stages()
    first, second, third = specs[:3]
    for spec in (first, second, first, third):
        warm.model(spec)
    built.clear()
    warm.model(first)
    assert not built
    warm.model(second)
    assert len(built) == 1
    boxes = [warm.box(s) for s in (first, second, third)]
    assert len(built) == 1 and all(b.shape == (8, 3) for b in boxes)
    monkeypatch.setattr(stages, "WARM_BYTES", 0)
    assert warm.model(first) is warm.model(first)
