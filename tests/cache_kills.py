"""Processes that fill one small cache with entries of every kind and are killed at any moment, and what there is afterwards:
shared by the tests and by benchmarks/faults.

    python tests/cache_kills.py PLACE KERNELS    # the nursery: forks a process that makes entries for each line that it reads

No entry may be torn and no result may differ from one without a cache, while others write, evict and die. Afterwards the folder
holds nothing unfinished, and no more than the limit.
"""

from __future__ import annotations

import hashlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xxhash

from deadline import until
from viewsphere.caches import KINDS, budget, cache_folder
from viewsphere.caches.arrays import DamagedError, read_arrays
from viewsphere.caches.entries import SUFFIX
from viewsphere.caches.folders import FILE_SUFFIX
from viewsphere.kernels import entries as kernel_entries
from viewsphere.limits import limits

LIMIT = 12_000_000
"""Bytes: a third of what all works together write, so that entries are evicted all the time."""

NUMBERS = 6
"""Entries of each kind of work."""


def _model(source: str, number: int, **more: Any) -> Any:
    from viewsphere.model.model_spec import ModelSpec

    return ModelSpec(key="model", source=source, category="model", category_id=0, seed=number, **more)


def _zoo(number: int, place: Path) -> Any:
    from viewsphere.assets.cache import load_normalised

    return load_normalised(_model("zoo:mug", number))


def _zoo_file(number: int, place: Path) -> Any:
    """One person is enough: its file outlives the limit while it is used."""
    from viewsphere_zoo import file_of

    file = file_of(_model("zoo:person", 1))
    assert file is not None
    return file.read_bytes()


def _file(number: int, place: Path) -> Any:
    from viewsphere.assets.cache import load

    mesh, facts = load(_model(str(place / "models" / f"{number}.obj"), number))
    return mesh, facts.files


def _timeline(number: int, place: Path) -> Any:
    from viewsphere.assets.cache import cached_facts

    file, other = place / "models" / f"{number}.obj", place / "models" / f"{number}.png"
    return cached_facts(file, "kills", lambda: ({"number": number}, [other]))


def _symmetries(number: int, place: Path) -> Any:
    from viewsphere.assets.metadata.model_metadata import found_symmetries

    return found_symmetries(_mesh_of(place, number)).model_dump_json()


def _mesh_of(place: Path, number: int) -> Any:
    from viewsphere.assets.load import load_model

    return load_model(place / "models" / f"{number}.obj")[0]


def _parts(number: int, place: Path) -> Any:
    """The entry of a model's convex parts; CoACD itself would take a second for each."""
    from viewsphere.caches.entries import cached
    from viewsphere.composing.placing.shared.dropping import _plain

    def make() -> list[Any]:
        return [np.random.default_rng([number, part]).normal(size=(200, 3)) for part in range(8)]

    digest = hashlib.sha256(f"parts {number}".encode()).hexdigest()
    return cached("parts", digest, make, _plain, lambda content: list(content.arrays.values()))


def _daylight(number: int, place: Path) -> Any:
    from viewsphere.engines.raster.sky import environment

    environment._daylight_maps.cache_clear()
    return environment._daylight_maps(2 + number / 2, 0.0, 30.0)


def _photograph(number: int, place: Path) -> Any:
    from viewsphere.engines.raster.sky import environment

    environment._photographed.cache_clear()
    return environment._photographed(environment._key(str(place / "skies" / f"{number}.hdr")), True)


def _tree(number: int, place: Path) -> Any:
    """The tree of a place's triangles, a record of arrays as all baked light is."""
    from viewsphere.engines.raster.indirect.bounces import Tree, tree_of
    from viewsphere.rendering.kept_light import kept_light

    corners = np.random.default_rng(number).normal(size=(2000, 3, 3)).astype(np.float32)
    return kept_light(("tree", corners), lambda: tree_of(corners), (Tree,))


def _texture(number: int, place: Path) -> Any:
    from viewsphere.assets.mesh import Image, Material, Texture
    from viewsphere.engines.raster.materials import bundles

    bundles._kept.cache_clear()
    pixels = np.random.default_rng(number).integers(0, 256, (320, 320, 4)).astype(np.uint8)
    packer = bundles.BundlePacker()
    packer.add(Material(base_color_texture=Texture(0)), [Image("a", pixels)], (True, True), is_scenery=True)
    textures = packer.pack()
    first, count = int(textures.levels[0, 0, 0]), 320 * 320 * 4
    return textures.texels[first : first + count]


def _exports(number: int, place: Path) -> Any:
    """The files of a model in a data set; two of them are equal in all entries."""
    from viewsphere.caches.folders import cached_files
    from viewsphere.scratch import temporary

    def make(folder: Path) -> None:
        (folder / "model.obj").write_bytes(np.random.default_rng(number).bytes(300_000))
        (folder / "model.mtl").write_bytes(np.random.default_rng(98).bytes(1_000))
        (folder / "skin.png").write_bytes(np.random.default_rng(99).bytes(400_000))

    with temporary("kills") as folder:
        cached_files("exports", f"exports {number}", make, folder)
        return [part for file in sorted(folder.iterdir()) for part in (file.name, file.read_bytes())]


def _kernel(number: int, place: Path) -> Any:
    """A kernel's entry with other content, since compiling one takes a second."""
    name = f"{number % 2:040x}/kernel-{number}.kernel"
    content = kernel_entries.load(name)
    if content is None:
        content = _kernel_of(number)
        kernel_entries.save(name, content)
    return content


def _kernel_of(number: int) -> bytes:
    return np.random.default_rng(number).bytes(60_000)


WORKS: dict[str, Callable[[int, Path], Any]] = {
    "zoo": _zoo,
    "zoo file": _zoo_file,
    "model file": _file,
    "facts of a file": _timeline,
    "symmetries": _symmetries,
    "convex parts": _parts,
    "daylight": _daylight,
    "environment picture": _photograph,
    "baked light": _tree,
    "textures": _texture,
    "exports": _exports,
    "kernel": _kernel,
}
"""For each kind of entry, a function of a number and the stock that returns its result, from the cache or made."""


def make_stock(place: Path) -> Path:
    """Model files and pictures of the sky that the works read."""
    from PIL import Image

    for folder in ("models", "skies", "wrong"):
        (place / folder).mkdir(parents=True, exist_ok=True)
    for number in range(NUMBERS):
        rng = np.random.default_rng(number)
        corners = rng.normal(size=(30, 3)).round(3).tolist()
        rows = [f"v {x} {y} {z}" for x, y, z in corners] + ["vt 0 0", "vt 1 0", "vt 0 1", f"mtllib {number}.mtl", "usemtl a"]
        rows += [f"f {i}/1 {i + 1}/2 {i + 2}/3" for i in range(1, 29)]
        (place / "models" / f"{number}.obj").write_text("\n".join(rows))
        (place / "models" / f"{number}.mtl").write_text(f"newmtl a\nKd 1 1 1\nmap_Kd {number}.png\n")
        Image.fromarray(rng.integers(0, 256, (128, 128, 3)).astype(np.uint8)).save(place / "models" / f"{number}.png")
        _write_hdr(place / "skies" / f"{number}.hdr", rng.integers(1, 256, (32, 64, 4)).astype(np.uint8))
    return place


def _write_hdr(file: Path, rgbe: np.ndarray) -> None:
    """A Radiance picture without run lengths (Ward, Real Pixels, Graphics Gems II)."""
    rgbe[..., 3] = 128
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rgbe.shape[0]} +X {rgbe.shape[1]}\n"
    file.write_bytes(head.encode() + rgbe.tobytes())


def digest_of_result(value: Any) -> str:
    """The digest of all numbers of a result, in order."""
    digest = hashlib.sha256()
    for part in _leaves(value):
        digest.update(part)
    return digest.hexdigest()


def _leaves(value: Any) -> Iterator[bytes]:
    if isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape}".encode() + value.tobytes()
    elif is_dataclass(value) and not isinstance(value, type):
        yield from _leaves(tuple(getattr(value, each.name) for each in fields(value)))
    elif isinstance(value, tuple | list):
        for part in value:
            yield from _leaves(part)
    else:
        yield value if isinstance(value, bytes) else repr(value).encode()


@dataclass
class Findings:
    """The results of a campaign."""

    kills: int = 0
    seen_writing: int = 0
    """Moments at which a process was seen writing."""
    made: int = 0
    """Results that were compared."""
    most: int = 0
    """Greatest size of all complete entries after a kill, in bytes."""
    torn: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)

    @property
    def is_good(self) -> bool:
        """Return whether nothing is torn, wrong, left or too much."""
        return not (self.torn or self.wrong or self.left) and self.most <= LIMIT


def campaign(place: Path, kernels: Path, kills: int, seed: int, longest: float = 0.6) -> Findings:
    """Kill so many processes that write to one cache, two or three at once, and collect the findings.

    `$VIEWSPHERE_CACHE` is the folder and `$VIEWSPHERE_CACHE_LIMIT` is LIMIT; `kernels` is where compiled kernels are;
    processes live at least up to `longest` seconds.
    """
    assert limits.CACHE_LIMIT == LIMIT
    chance, findings = random.Random(seed), Findings()
    with nursery(make_stock(place), kernels) as start:
        while findings.kills < kills:
            started = [start(chance.randrange(1 << 30)) for _ in range(chance.choice((2, 3)))]
            findings.seen_writing += _moment(chance, longest)
            for pid in started:
                os.kill(pid, signal.SIGKILL)
            assert until(lambda started=started: not any(_lives(pid) for pid in started))
            findings.kills += len(started)
            findings.most = max(findings.most, sum(entry.size for entry in budget.entries()))
            findings.torn += torn()
        last = start(-1)
        assert until(lambda: not _lives(last))
    findings.wrong += [file.read_text() for file in sorted((place / "wrong").iterdir())]
    findings.made = (place / "made").stat().st_size
    findings.left += [str(path) for path in _unfinished()]
    findings.most = max(findings.most, sum(entry.size for entry in budget.entries()))
    return findings


def _moment(chance: random.Random, longest: float) -> bool:
    """Wait a while, then often until a process is writing; return whether one was seen writing."""
    time.sleep(chance.uniform(0, longest))
    end = time.monotonic() + chance.choice((0.0, 0.5, 1.0))
    while time.monotonic() < end:
        if _unfinished():
            return True
    return False


def _unfinished() -> list[Path]:
    """Files in the folders of the cache that no read would find."""
    found: list[Path] = []
    for kind in KINDS:
        for folder, _, names in os.walk(cache_folder() / kind):  # which skips folders that are removed meanwhile
            inside = Path(folder).relative_to(cache_folder())
            found += [inside / name for name in names if "~" in str(inside) or name.startswith(".")]
    return found


def torn() -> list[str]:
    """Complete entries that cannot be read."""
    found: list[str] = []
    for entry in budget.entries():
        if entry.file.suffix == FILE_SUFFIX:
            if xxhash.xxh3_128(entry.file.read_bytes()).hexdigest() != entry.file.stem:
                found.append(f"{entry.file}: damaged")
        elif entry.file.suffix == SUFFIX:
            try:
                read_arrays(entry.file)
            except DamagedError as error:
                found.append(str(error))
        elif entry.file.suffix == kernel_entries.SUFFIX:
            data = entry.file.read_bytes()
            if hashlib.sha256(data[32:]).digest() != data[:32]:
                found.append(f"{entry.file}: damaged")
    return found


def _lives(pid: int) -> bool:
    """True unless a process has ended, collected by its parent or not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@contextmanager
def nursery(place: Path, kernels: Path) -> Iterator[Callable[[int], int]]:
    """A function that starts a process with a seed, and returns its number; processes with seed -1 make each entry once."""
    command = [sys.executable, __file__, str(place), str(kernels)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stdin is not None and process.stdout is not None
    stdin, stdout = process.stdin, process.stdout

    def start(seed: int) -> int:
        stdin.write(f"{seed}\n")
        stdin.flush()
        return int(stdout.readline())

    try:
        yield start
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def _serve(place: Path, kernels: str) -> None:
    """Compute all results without a cache; then fork a process for each seed on standard input and print its number."""
    folder, spoilt = os.environ["VIEWSPHERE_CACHE"], place / "a file in place of a folder"
    spoilt.touch()
    os.environ |= {"VIEWSPHERE_CACHE": str(spoilt), "VIEWSPHERE_READ_HERE": "1", "NUMBA_CACHE_DIR": kernels}
    tasks = [(name, number) for name in WORKS for number in range(NUMBERS)]
    whole = {
        task: digest_of_result(_kernel_of(task[1]) if task[0] == "kernel" else WORKS[task[0]](task[1], place)) for task in tasks
    }
    del os.environ["NUMBA_CACHE_DIR"]
    os.environ["VIEWSPHERE_CACHE"] = folder
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            _make_entries(int(line), place, whole)
            os._exit(0)
        print(pid, flush=True)


def _make_entries(seed: int, place: Path, whole: dict[tuple[str, int], str]) -> None:
    """Make entries in random order, without end or with seed -1 each once, and record results that differ."""
    chance = random.Random(seed)
    if seed >= 0 and seed % 4 == 0:  # a process of its own for each model file takes longer to start than most of these live
        del os.environ["VIEWSPHERE_READ_HERE"]
    tasks = list(whole)
    for name, number in tasks if seed < 0 else iter(lambda: chance.choice(tasks), None):
        try:
            problem = "" if digest_of_result(WORKS[name](number, place)) == whole[name, number] else "differs"
        except Exception as error:
            problem = repr(error)
        if problem:
            (place / "wrong" / f"{os.getpid()}-{name}-{number}").write_text(f"{name} {number}: {problem}")
        with (place / "made").open("ab") as tally:
            tally.write(b".")


if __name__ == "__main__":
    _serve(Path(sys.argv[1]), sys.argv[2])
