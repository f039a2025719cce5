"""What holds of every format, on each data set of tests/worlds.py that it does not refuse: it is the same however it is
written, and its proof finds whatever is changed.
"""

from __future__ import annotations

import shutil

import pytest

from small import tree_hash
from viewsphere import Dataset, plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.preparing import Views
from viewsphere.run.exports.scope import refusals, scope_of
from viewsphere.run.exports.writable import writable_formats
from viewsphere.store import Choice
from viewsphere.store.shots.checksums import CHECKSUMS
from worlds import WORLDS

HEAVY = {"blend", "huggingface"}  # a program of its own; another library's files
OF_PEOPLE = {"surreal"}  # of none of these worlds: its own tests try the same
FEW = {"sscnet": Choice(frames=((0, 2), (6, 8)))}  # whose eight million cells a picture take half a second
KINDS = {"still": ("stills", "poses"), "moving": ("videos", "drives")}
FORMATS = [name for name in writable_formats() if name not in HEAVY | OF_PEOPLE]


@pytest.fixture(scope="module")
def exported(request, tmp_path_factory):
    """A function that gives a format's export of a world, written once; None where the format refuses it."""
    made = {}

    def get(name, world):
        if (name, world) not in made:
            dataset = request.getfixturevalue(world)
            made[name, world] = None
            if accepts(dataset, name):
                export(dataset.root, name, choice=FEW.get(name), output=tmp_path_factory.mktemp(f"{name}-{world}"))
                made[name, world] = tmp_path_factory.getbasetemp() / f"{name}-{world}0" / name
        return made[name, world]

    return get


def chosen(dataset, name):
    return Dataset(dataset.root, FEW[name]) if name in FEW else dataset


def accepts(dataset, name):
    return not list(refusals(plugins.load(FormatSpec, name), FormatEntry(name=name), scope_of(dataset)))


def remarks(dataset, name, folder):
    entry = FormatEntry(name=name)
    view = Views(chosen(dataset, name)).for_format(entry, None)
    return list(plugins.load(FormatSpec, name).verify(view, folder, range(len(view)), *entry.arguments()))


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_every_format_holds_some_data_set_and_refuses_others_in_words(name, request):
    refused = []
    for world in WORLDS:
        dataset = request.getfixturevalue(world)
        problems = list(refusals(plugins.load(FormatSpec, name), FormatEntry(name=name), scope_of(dataset)))
        refused += [world] if problems else []
        assert all("; found " in problem and "\n" not in problem for problem in problems)
        if problems:
            with pytest.raises(UserError, match=f"format {name}: "):
                export(dataset.root, name, output=dataset.root.parent / "refused")
            assert not (dataset.root.parent / "refused").exists()
    assert len(refused) < len(WORLDS)


def first_of(exported, name, kind):
    """The first world of a kind that a format does not refuse; None where it refuses all."""
    return next((world for world in KINDS[kind] if exported(name, world) is not None), None)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_an_export_of_a_still_and_of_a_moving_world_is_proved(exported, name, kind, request):
    if (world := first_of(exported, name, kind)) is not None:
        assert remarks(request.getfixturevalue(world), name, exported(name, world)) == []


@pytest.mark.slow
@pytest.mark.shipped
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_an_export_of_every_other_world_is_proved(exported, name, kind, request):
    for world in KINDS[kind]:
        if world != first_of(exported, name, kind) and exported(name, world) is not None:
            assert remarks(request.getfixturevalue(world), name, exported(name, world)) == [], world


@pytest.mark.slow
def test_all_worlds_are_still_or_moving():
    assert sorted(world for worlds in KINDS.values() for world in worlds) == sorted(WORLDS)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_what_is_changed_is_found(exported, name, request, tmp_path):
    """A file of each kind, which is cut, changed in one byte, missing, or too many: all at once, as each proof reads the whole
    export, and those alone that it does not name then.
    """
    world = next(world for world in WORLDS if exported(name, world))
    dataset, folder = request.getfixturevalue(world), tmp_path / name
    shutil.copytree(exported(name, world), folder)
    (folder / CHECKSUMS).unlink()
    kinds = {}
    for file in sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size):
        kinds.setdefault((file.suffix, file.parent.name), file)
    whole = {file: file.read_bytes() for file in kinds.values()}
    for number, file in enumerate(whole):
        spoil(file, number)
    (folder / "strange").write_text("")
    messages = told(dataset, name, folder)
    assert any("strange" in message for message in messages)
    (folder / "strange").unlink()
    for file, data in whole.items():
        restore(file, data)
    for number, file in enumerate(whole):
        if not is_named(file.relative_to(folder), messages):
            spoil(file, number)
            assert told(dataset, name, folder), (file, number)
            restore(file, whole[file])


def spoil(file, number):
    data = file.read_bytes()
    half = len(data) // 2
    ways = (data[:-1], bytes([*data[:-1], data[-1] ^ 1]), data[:half] + b"x" + data[half:], None)
    file.unlink()
    if (other := ways[number % len(ways)]) is not None:
        file.write_bytes(other)


def restore(file, data):
    file.unlink(missing_ok=True)
    file.write_bytes(data)


def told(dataset, name, folder):
    messages = [message for _, message in remarks(dataset, name, folder)]
    assert all("\n" not in message for message in messages)
    return messages


def is_named(path, messages):
    """Return whether a message begins with a file's whole path, which names no other."""
    return any(message.startswith(f"{path.as_posix()}: ") for message in messages)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_an_export_is_the_same_by_several_processes(exported, name, request, tmp_path, monkeypatch):
    from viewsphere.run.exports import preparing

    monkeypatch.setattr(preparing, "PATIENCE_S", 0.0)
    monkeypatch.setattr(preparing, "WORTH_S", 0.0)
    world = next(world for world in WORLDS if exported(name, world))
    dataset: Dataset = request.getfixturevalue(world)
    export(dataset.root, name, choice=FEW.get(name), output=tmp_path, workers=2)
    assert tree_hash(tmp_path / name) == tree_hash(exported(name, world))
