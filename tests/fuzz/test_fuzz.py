"""Damaged files are read or refused, and nothing else: some seeds of every target."""

import pytest
import targets
from campaign import SETTINGS, findings
from targets import TARGETS

from quick import quick

QUICK = {
    "mat": 300,
    "obj": 60,
    "gltf": 80,
    "models": 60,
    "poses": 150,
    "tables": 150,
    "rigs": 10,
    "channels": 100,
    "textures": 60,
    "sky": 40,
    "recipe": 15,
}
LONG = {"store": 12, "spans": 8, "records": 8, "exports": 6, "coco": 15, "native": 15, "kitti": 15, "pascal3d": 15}
"""Inputs of each target; those of whole data sets take longest."""


def told(target, seeds):
    return [one for one in findings(target, seeds) if not isinstance(one, int)]


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """What a campaign sets in its own process is as before."""
    from viewsphere.check import digests
    from viewsphere.plugins import registry
    from viewsphere.store.shots import checksums

    for name, value in SETTINGS.items():
        monkeypatch.setenv(name, value)
    for module, name in (
        (registry, "entry_points"),
        *((m, "ThreadPoolExecutor") for m in (checksums, digests)),
    ):
        monkeypatch.setattr(module, name, getattr(module, name))


@pytest.mark.parametrize("target", QUICK)
def test_single_files(target):
    assert not told(target, range(QUICK[target]))


@pytest.mark.slow
@pytest.mark.parametrize("target", LONG)
def test_data_sets(target):
    assert not told(target, range(LONG[target]))


@pytest.mark.parametrize("target", quick(QUICK, *(QUICK.keys() - {"recipe"})))
def test_what_is_damaged_can_be_read_before(target, tmp_path):
    for i, sample in enumerate(TARGETS[target].corpus()):
        (folder := tmp_path / str(i)).mkdir()
        TARGETS[target].run(folder, TARGETS[target].lay(folder, sample, sample.data))


@pytest.mark.slow
@pytest.mark.parametrize("target", LONG)
def test_data_sets_that_are_damaged_can_be_read_before(target, tmp_path, monkeypatch):
    monkeypatch.setattr(targets, "_each", lambda *calls: [call() for call in calls])
    for i, whole in enumerate(TARGETS[target].wholes):
        TARGETS[target].lay(tmp_path / str(i) / "in", whole())
        TARGETS[target].run(tmp_path / str(i), "in")


def test_no_target_is_forgotten():
    assert TARGETS.keys() == QUICK.keys() | LONG.keys()


def test_an_input_is_known_by_its_seed(tmp_path):
    from campaign import make

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        assert make("gltf", 5, tmp_path / folder)
    one, other = ({p.name: p.read_bytes() for p in (tmp_path / folder).iterdir()} for folder in ("a", "b"))
    assert one == other


def test_foreign_errors_hangs_and_empty_messages_are_findings(monkeypatch):
    import campaign
    from targets import Files, Sample

    from viewsphere.errors import UserError

    def ends(error):
        def call(path):
            raise error

        monkeypatch.setitem(TARGETS, "made", Files(call, lambda: (Sample("x", b"abc"),)))
        return told("made", range(1))

    def hangs(path):
        while True:
            pass

    assert not ends(UserError("expected something else"))
    assert ends(UserError(""))[0].what == "UserError without words"
    assert ends(KeyError("a"))[0].what == "KeyError: 'a'"
    monkeypatch.setattr(campaign, "SECONDS", 0.2)
    monkeypatch.setitem(TARGETS, "made", Files(hangs, lambda: (Sample("x", b"abc"),)))
    assert "more than 0.2 seconds" in told("made", range(1))[0].what
