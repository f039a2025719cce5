"""Whatever is changed in an export, its proof finds it: each field of the JSON, each kind of file. The lists of both are
taken from the exports themselves.
"""

from __future__ import annotations

import copy
import io
import json
import math
import re
import shutil
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cube_dataset import LENS, make
from viewsphere import Dataset, plugins
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.instant import Moment
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export
from viewsphere.store.shots.checksums import CHECKSUMS


def _proves_itself(module) -> bool:
    """Return whether a format has a proof of its own; trees share one, which test_trees.py tries."""
    return module.verify is not None and module.verify.__module__ != "viewsphere.formats.shared.writing.tree"


FORMATS = [name for name in plugins.names("formats") if _proves_itself(plugins.load(FormatSpec, name))]
OF_CAMERAS = {"gltf", "native", "pointcloud"}
"""Those that would hold nothing of pictures of unknown cameras."""

EVERY = [pytest.param(1, marks=pytest.mark.slow, id="all"), pytest.param(20, id="some")]
"""Of so many values, or kinds of file, one is tried."""

FLIPS = 4
"""Bits that are flipped in each kind of file."""


def moving(root: Path) -> Dataset:
    """Three boxes seen through a lens, with times and tracks."""
    lens = LENS.model_copy(update={"distortion": lens_parameters("fisheye", coefficients=(0.02, 0.05, 0.001, 0.0))})
    still = make(root / "still", several=True, intrinsics=lens)
    dataset = Dataset(shutil.copytree(still.root, root / "moving"))
    for key, places in still.shots():
        shutil.rmtree(dataset.store.shot_folder(key))
        dataset.store.write_shot(key, map(moved, still.samples_of(key, places)))
    return dataset


def moved(sample):
    pose = sample.pose.model_copy(update={"time": Moment(frame=sample.index, seconds=sample.index / 25)})
    objects = tuple(replace(o, track=f"track of {o.key}") for o in sample.objects)
    return replace(sample, known_pose=pose, objects=objects, channels=dict(sample.channels), files={})


def imported(root: Path) -> Dataset:
    own = make(root / "own", ground=True)
    export(own.root, ["coco"])
    import_dataset("coco", own.root / "coco", root / "imported")
    return Dataset(root / "imported")


@pytest.fixture(scope="module", params=[moving, imported, partial(make, ground=True)], ids=["moving", "imported", "plain"])
def exported(request, tmp_path_factory):
    dataset = request.param(tmp_path_factory.mktemp("tampering") / "out")
    export(dataset.root, [name for name in FORMATS if request.param is not imported or name not in OF_CAMERAS])
    return dataset


@pytest.fixture(autouse=True)
def _held(request):
    """Skips a format that cannot hold the data set."""
    if {"exported", "name"} <= set(request.fixturenames):
        root, name = request.getfixturevalue("exported").root, request.getfixturevalue("name")
        if not (root / name).is_dir():
            pytest.skip(f"{name} holds no pictures of unknown cameras")


def verified(dataset: Dataset, name: str, sampled: Collection[int]):
    return plugins.load(FormatSpec, name).verify(dataset, dataset.root / name, sampled, *FormatEntry(name=name).arguments())


def found(dataset: Dataset, name: str) -> bool:
    return any(verified(dataset, name, ()))


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_is_found_in_a_whole_export(exported, name):
    everything = range(len(exported))
    assert list(verified(exported, name, everything)) == []


# the JSON's fields

Where = tuple[str | int, ...]


def fields(value: Any, where: Where = ()) -> Iterator[Where]:
    """The place of everything in a value of JSON, itself included."""
    yield where
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from fields(item, (*where, key))


def one_of_each(values: Mapping[Path, Any]) -> list[tuple[Path, Where]]:
    """A place for each path of keys, now in one and now in another of the files that have it; numbers in keys do not count."""
    places: defaultdict[tuple[str, ...], dict[Path, Where]] = defaultdict(dict)
    for file, value in values.items():
        for where in fields(value):
            path = tuple("#" if isinstance(key, int) else re.sub(r"\d+", "#", key) for key in where)
            places[path][file] = where
    return [list(found.items())[number % len(found)] for number, found in enumerate(places.values())]


def changed(value: Any) -> Iterator[Any]:
    """What may stand in the place of a value."""
    match value:
        case bool() | None:
            yield from (1, "x")
        case int():
            yield from (value + 1, -value - 1, str(value), None)
        case float():
            yield from (math.nextafter(value, math.inf), -value or 1.0, None)
        case str():
            yield from (value + "x", value.swapcase() if value.swapcase() != value else "y", None)
        case list():
            yield from (value[:-1] if value else [1], [*value, *(value[:1] or [1])], value[::-1], None)
        case dict():
            yield from (dict(list(value.items())[:-1]) if value else {"x": 1}, {**value, "more": 1}, None)


def in_turn(number: int, value: Any) -> list[Any]:
    """One of the ways in which a value may be changed; the next value is changed in the next way."""
    others = [other for other in changed(value) if json.dumps(other) != json.dumps(value)]
    return [others[number % len(others)]] if others else []


def at(value: Any, where: Where) -> Any:
    for key in where:
        value = value[key]
    return value


def tampered(value: Any, where: Where, other: Any) -> Any:
    """A copy of a value of JSON with another value in one place."""
    if not where:
        return other
    whole = copy.deepcopy(value)
    at(whole, where[:-1])[where[-1]] = other
    return whole


@pytest.mark.parametrize("every", EVERY)
@pytest.mark.parametrize("name", FORMATS)
def test_every_field_is_compared(exported, name, every):
    values = {file: json.loads(file.read_text()) for file in sorted((exported.root / name).rglob("*.json"))}
    if not values:
        pytest.skip("the format has no JSON; the bits of its files are flipped")
    cases = [
        (file, where, other)
        for number, (file, where) in enumerate(one_of_each(values))
        for other in in_turn(number, at(values[file], where))
    ]
    least = 10 if name == "webdataset" else 60  # whose JSON is an index alone
    assert len(cases) > least or not exported[0].known_camera
    missed = []
    for file, where, other in cases[::every]:
        with restored(file):
            file.write_text(json.dumps(tampered(values[file], where, other)))
            if not found(exported, name):
                missed.append((file.name, where, other))
    assert missed == []


# the files


@contextmanager
def restored(*files: Path) -> Iterator[list[bytes]]:
    """Gives the bytes of files and puts them back; each file is one of its own meanwhile, no link to the store's."""
    whole = [file.read_bytes() for file in files]
    for file in files:
        file.unlink()
    try:
        yield whole
    finally:
        for file, data in zip(files, whole, strict=True):
            file.write_bytes(data)


def overwritten(file: Path, data: bytes) -> Iterator[None]:
    with restored(file):
        file.write_bytes(data)
        yield


def gone(file: Path) -> Iterator[None]:
    with restored(file):
        yield


def doubled(file: Path) -> Iterator[None]:
    more = file.with_name(f"more{file.suffix}")
    shutil.copyfile(file, more)
    yield
    more.unlink()


def swapped(one: Path, other: Path) -> Iterator[None]:
    with restored(one, other) as (first, second):
        one.write_bytes(second)
        other.write_bytes(first)
        yield


def kinds(folder: Path) -> dict[str, list[Path]]:
    """The files of an export by their paths, in which numbers do not count; the list of digests is proved elsewhere."""
    groups: defaultdict[str, list[Path]] = defaultdict(list)
    for file in sorted(folder.rglob("*")):
        if file.is_file() and file.name != CHECKSUMS:
            groups[re.sub(r"\d+", "#", file.relative_to(folder).as_posix())].append(file)
    return groups


def black(data: bytes) -> bytes:
    """A picture without light; of what is none, as many zeros."""
    try:
        with Image.open(io.BytesIO(data)) as image:
            array, kind = np.zeros_like(np.asarray(image)), image.format
    except OSError:
        return bytes(len(data))
    saved = io.BytesIO()
    Image.fromarray(array).save(saved, kind)
    return saved.getvalue()


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "half": lambda data: data[: len(data) // 2],
    "a byte less": lambda data: data[:-1],
    "a byte more": lambda data: data + b"\n",
    "black": black,
}


def damaged(files: list[Path], rng: np.random.Generator, flips: int) -> Iterator[tuple[str, Iterator[None]]]:
    """What can happen to files of one kind; each damage lasts as long as its context."""
    file = files[len(files) // 2]
    data = file.read_bytes()
    yield "gone", gone(file)
    yield "one more", doubled(file)
    yield from (("swapped", swapped(file, other)) for other in files[:1] if other.read_bytes() != data)
    spoilt = {name: damage(data) for name, damage in DAMAGES.items()}
    for bit in rng.integers(0, 8 * len(data), flips).tolist():
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        spoilt[f"bit {bit}"] = bytes(flipped)
    yield from ((what, overwritten(file, other)) for what, other in spoilt.items() if other != data)


@pytest.mark.parametrize("every", EVERY)
@pytest.mark.parametrize("name", FORMATS)
def test_every_kind_of_file_is_compared(exported, name, every):
    rng = np.random.default_rng(0)
    groups = kinds(exported.root / name)
    cases = [(kind, *case) for kind, files in groups.items() for case in damaged(files, rng, FLIPS)][::every]
    missed = []
    for kind, what, damage in cases:
        with contextmanager(lambda damage=damage: damage)():
            if not found(exported, name):
                missed.append((kind, what))
    assert missed == []
    assert len(cases) >= FLIPS * len(groups) // every
