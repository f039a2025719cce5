"""Frames in memory: every frame once an epoch, however they are shared out, in an order that follows from the seed."""

import pickle
import re
import subprocess
import sys
from collections import Counter
from itertools import islice

import numpy as np
import pytest

import viewsphere as vs
from deadline import DEADLINE
from sequence_recipe import eventful_recipe
from small import ROOT, small_recipe
from viewsphere.errors import RecipeError, UserError

PAGE = (ROOT / "docs" / "in-memory.md").read_text("utf-8")


@pytest.fixture
def torch():
    """PyTorch, imported before frames are made."""
    return pytest.importorskip("torch")


def quick_recipe(**changes):
    """Twelve frames of two models, tiny, labels alone: light is what takes time."""
    return small_recipe(
        **{"camera": {"size": [32, 24], "fov_deg": 35}, "channels": ["depth", "instances"], "scene": {}, **changes}
    )


def random_recipe(**changes):
    views = {"kind": "sphere", "count": 6, "distance": 1.0}
    return quick_recipe(viewpoints=views, splits={"by": "frame", "train": 0.5, "val": 0.5}, **changes)


def indices(frames):
    return [sample.index for sample in frames]


@pytest.fixture(scope="module")
def in_order():
    return list(vs.render(quick_recipe(channels=["rgb", "depth"])))


@pytest.mark.parametrize(
    ("count", "shuffle", "channels"), [(2, True, ["rgb", "depth"]), (5, False, ["depth"]), (13, True, ["depth"])]
)
@pytest.mark.slow
def test_shares_have_every_frame_once(count, shuffle, channels, in_order):
    recipe = quick_recipe(channels=channels)
    shares = [list(vs.render(recipe, shard=(k, count), shuffle=shuffle)) for k in range(count)]
    lengths = [len(vs.render(recipe, shard=(k, count))) for k in range(count)]
    assert [len(share) for share in shares] == lengths
    assert max(lengths) - min(lengths) <= 1
    found = sorted((sample for share in shares for sample in share), key=lambda sample: sample.index)
    for sample, whole in zip(found, in_order, strict=True):
        assert (sample.index, sample.split, sample.pose) == (whole.index, whole.split, whole.pose)
        assert all(np.array_equal(sample.channels[name], whole.channels[name]) for name in channels)


def test_orders_follow_from_the_seed_and_the_epoch():
    once = indices(vs.render(quick_recipe(), shuffle=True, epochs=3))
    assert once == indices(vs.render(quick_recipe(), shuffle=True, epochs=3))
    epochs = [once[i : i + 12] for i in (0, 12, 24)]
    assert all(sorted(epoch) == list(range(12)) for epoch in epochs)
    assert len({tuple(epoch) for epoch in epochs}) == 3
    assert indices(vs.render(quick_recipe(seed=1), shuffle=True)) != epochs[0]


def test_loops_go_on_with_the_next_epoch():
    frames = vs.render(quick_recipe(), shuffle=True)
    loops = [indices(frames) for _ in range(2)]
    assert loops[0] + loops[1] == indices(vs.render(quick_recipe(), shuffle=True, epochs=2))
    frames.set_epoch(0)
    assert indices(frames) == loops[0]


def test_endless_frames_repeat_the_recipe():
    frames = vs.render(quick_recipe(), epochs=None)
    assert indices(islice(frames, 30)) == [*range(12), *range(12), *range(6)]
    with pytest.raises(TypeError, match="no end"):
        len(frames)


def test_next_takes_frames_one_by_one():
    frames = vs.render(quick_recipe())
    first = next(frames)
    assert [first.index, *indices(frames)] == list(range(12))
    with pytest.raises(StopIteration):
        next(frames)


def test_redrawing_changes_what_is_random_but_neither_models_nor_splits():
    epochs = list(vs.render(random_recipe(), epochs=2, redraw=True))
    first, second = epochs[:12], epochs[12:]
    assert [s.pose for s in first] == [s.pose for s in vs.render(random_recipe())]
    assert all(a.pose.azimuth_deg != b.pose.azimuth_deg for a, b in zip(first, second, strict=True))
    assert [s.split for s in first] == [s.split for s in second]
    assert [s.objects[0].key for s in first] == [s.objects[0].key for s in second]
    assert all(a.objects[0].size == b.objects[0].size for a, b in zip(first, second, strict=True))
    again = list(vs.render(random_recipe(), epochs=2, redraw=True))
    assert all(np.array_equal(a.depth, b.depth) for a, b in zip(epochs, again, strict=True))


def test_without_redrawing_epochs_are_equal():
    epochs = list(vs.render(random_recipe(), epochs=2))
    assert [s.pose for s in epochs[:12]] == [s.pose for s in epochs[12:]]


@pytest.mark.parametrize("shard", [(0, 2), pytest.param((1, 2), marks=pytest.mark.slow)])
def test_sequences_stay_together_and_in_order(shard):
    recipe = eventful_recipe(6, camera={"size": [32, 24], "fov_deg": 60}, channels=["depth"], shot_frames=4)
    share = list(vs.render(recipe, shard=shard, shuffle=True))
    (name,) = {sample.sequence for sample in share}
    assert [(s.instant, s.sensor) for s in share] == [(i, sensor) for i in range(6) for sensor in ("left", "right")]
    whole = [s for s in vs.render(recipe) if s.sequence == name]
    assert indices(share) == indices(whole)
    assert all(np.array_equal(a.depth, b.depth) for a, b in zip(share, whole, strict=True))


@pytest.mark.parametrize("shard", [(2, 2), (-1, 2), (0, 0), 3, "0/2", (0.0, 2)])
def test_what_is_no_shard_is_refused(shard):
    with pytest.raises(UserError, match=r"^shard: expected \(k, n\).*found"):
        vs.render(quick_recipe(), shard=shard)


@pytest.mark.parametrize("epochs", [0, -1, 1.5])
def test_what_is_no_number_of_epochs_is_refused(epochs):
    with pytest.raises(UserError, match=r"^epochs: expected a number of 1 or more, or None"):
        vs.render(quick_recipe(), epochs=epochs)


def test_recipes_are_taken_by_their_paths(tmp_path, in_order):
    file = tmp_path / "recipe.yaml"
    file.write_text(quick_recipe().to_yaml())
    assert vs.plan(file).frames == vs.plan(str(file)).frames == 12
    assert np.array_equal(next(vs.render(str(file))).depth, in_order[0].depth)
    assert vs.generate(file, tmp_path / "out", formats="csv").formats == ("csv",)
    vs.export(tmp_path / "out", "csv", output=tmp_path / "more")
    assert list((tmp_path / "more" / "csv").iterdir())
    with pytest.raises(RecipeError, match="expected a Recipe, or the path of its file; found a mapping"):
        vs.plan({"models": []})


def test_samples_and_objects_list_what_they_have(in_order):
    assert {"rgb", "depth", "objects", "pose"} <= set(dir(in_order[0]))
    assert "normals" not in dir(in_order[0])
    assert "box3d" in dir(in_order[0].objects[0])


def test_the_version_is_told():
    told = subprocess.run([sys.executable, "-m", "viewsphere", "--version"], capture_output=True, text=True, timeout=DEADLINE)
    assert told.stdout == f"viewsphere {vs.__version__}\n"
    assert re.match(r"\d+\.\d+", vs.__version__)


def taken(samples):
    """What a loader's worker sends: numbers alone."""
    return [(sample.index, float(sample.instances.mean())) for sample in samples]


def loader(frames, workers=2, **settings):
    from torch.utils.data import DataLoader

    return DataLoader(frames, batch_size=3, num_workers=workers, collate_fn=taken, **settings)


def numbers(batches):
    return [index for batch in batches for index, _ in batch]


@pytest.mark.usefixtures("torch")
@pytest.mark.parametrize("workers", [0, 2])
def test_loaders_give_every_frame_once_an_epoch(workers):
    def run():
        batches = loader(vs.render(quick_recipe(), shuffle=True), workers, persistent_workers=workers > 0)
        return [numbers(batches) for _ in range(3)]

    epochs = run()
    assert [sorted(epoch) for epoch in epochs] == [list(range(12))] * 3
    assert len({tuple(epoch) for epoch in epochs}) == 3
    assert run() == epochs
    (again,) = {tuple(numbers(loader(vs.render(quick_recipe(seed=seed), shuffle=True), workers))) for seed in (0, 0)}
    assert list(again) == epochs[0]


@pytest.mark.usefixtures("torch")
def test_loaders_give_several_epochs_in_one_loop():
    found = Counter(numbers(loader(vs.render(quick_recipe(), shuffle=True, epochs=3))))
    assert found == Counter(list(range(12)) * 3)


@pytest.mark.usefixtures("torch")
def test_workers_that_start_anew_are_told_the_epoch():
    frames = vs.render(quick_recipe(), shuffle=True)
    epochs = []
    for epoch in range(2):
        frames.set_epoch(epoch)
        epochs.append(numbers(loader(frames)))
    assert [sorted(epoch) for epoch in epochs] == [list(range(12))] * 2
    assert epochs[0] != epochs[1]


@pytest.mark.usefixtures("torch")
def test_workers_part_the_shard_of_their_loader():
    shares = [numbers(loader(vs.render(quick_recipe(), shard=(k, 2)))) for k in range(2)]
    assert [sorted(share) for share in shares] == [list(range(k, 12, 2)) for k in range(2)]


@pytest.mark.usefixtures("torch")
def test_data_sets_of_users_find_their_worker():
    from torch.utils.data import Dataset, IterableDataset

    class Streamed(IterableDataset):
        def __iter__(self):
            return iter(vs.render(quick_recipe()))

    class Counted(Dataset):
        def __len__(self):
            return 6

        def __getitem__(self, i):
            return next(vs.render(quick_recipe()))

    assert sorted(numbers(loader(Streamed()))) == list(range(12))
    assert numbers(loader(Counted())) == [0] * 6


@pytest.mark.usefixtures("torch")
def test_ranks_render_their_shares(tmp_path):
    import torch.distributed as ranks

    ranks.init_process_group("gloo", init_method=f"file://{tmp_path / 'ranks'}", rank=0, world_size=1)
    try:
        frames = vs.render(quick_recipe())
        assert indices(frames) == list(range(12))
        ranks.get_rank, ranks.get_world_size, kept = (lambda: 1), (lambda: 3), (ranks.get_rank, ranks.get_world_size)
        try:
            assert indices(frames) == [1, 4, 7, 10]
            assert sorted(numbers(loader(frames))) == [1, 4, 7, 10]
            assert indices(vs.render(quick_recipe(), shard=(0, 4))) == [0, 4, 8]
            sent = pickle.dumps(frames)
        finally:
            ranks.get_rank, ranks.get_world_size = kept
        assert indices(pickle.loads(sent)) == [1, 4, 7, 10]  # as workers that are spawned know no process group
    finally:
        ranks.destroy_process_group()


@pytest.mark.usefixtures("torch")
def test_the_pages_training_runs(tmp_path):
    (script,) = (code for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "DataLoader" in code)
    (tmp_path / "train.py").write_text(script)
    (tmp_path / "recipe.yaml").write_text(quick_recipe(channels=["rgb"]).to_yaml())
    run = subprocess.run([sys.executable, "train.py"], cwd=tmp_path, capture_output=True, text=True, timeout=DEADLINE)
    assert run.stdout.split("\n")[:3] == [f"{epoch} 12 (3, 24, 32)" for epoch in range(3)], run.stderr
