"""Procedural models that ship with the tool, in metres, front -Y, up +Z, standing on z = 0.

A family is one module of this package, named as its file: `NAME(...)` builds a Mesh from parameters and `NAME_random(rng)`
draws the parameters; `NAME_sized(rng, (width, height, length))`, where a family has it, draws those that its size leaves open.
`HOME` says where its members are found, `KEYPOINTS` are its named points by its parts, and `SKELETON` lines between them. A
family that moves has `CLIPS`, names of animations, and builds a RiggedModel: from there on it is a GLB file in the cache, read
and played as any other. Sub-packages hold the parts that families are built from.
"""

from __future__ import annotations

import atexit
import hashlib
import os
from contextlib import ExitStack
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from viewsphere import plugins
from viewsphere.caches import cache_of
from viewsphere.caches.entries import kept, making, note_use
from viewsphere.files import read_bytes
from viewsphere.scratch import temporary

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.model_spec import ModelSpec

ZOO = "zoo:"

Home = Literal["table", "floor", "street", "garden", "water", "place"]
"""Usual surroundings of a family; `place`: the ground or building of a place, not a thing in it."""


def home(family: str) -> Home:
    """Return the home of a family; raises UserError for an unknown family, with the nearest known one."""
    return plugins.family(family).HOME


def things() -> tuple[str, ...]:
    """Names of the families that are things, not parts of places, sorted; all families are imported."""
    return tuple(family for family in families() if home(family) != "place")


def families() -> tuple[str, ...]:
    """Names of all families, sorted; none is imported."""
    return plugins.families()


def build(family: str, rng: np.random.Generator) -> Mesh:
    """A random member of the family, as it rests; the same generator state gives the same bytes.

    Raises UserError for an unknown family, with the nearest known one.
    """
    made = _built(family, rng)
    if not clips_of(family):
        return made
    from viewsphere.assets.exporting.glb import rigged_glb_bytes
    from viewsphere.assets.load import load_model
    from viewsphere.assets.normalise import normalise
    from viewsphere.model.model_spec import ModelSpec

    with temporary("zoo") as place:
        file = place / f"{family}.glb"
        file.write_bytes(rigged_glb_bytes(made))
        raw, facts = load_model(file)
    spec = ModelSpec(key=family, source=ZOO + family, category=family, category_id=0, centring="as_is")
    return normalise(raw, facts, spec)


def build_zoo_model(spec: ModelSpec) -> Mesh | Path:
    """The procedural model that a `zoo:family` source names, drawn from its seed, and built to the size that it asks for: its
    mesh, from the cache where it is there, or the file of one that moves.
    """
    file = file_of(spec)
    if file is not None:
        return file
    family = spec.source.removeprefix(ZOO)
    if not plugins.family(family).__name__.startswith(f"{__name__}."):  # whose sources, all together, are not known
        return _built_to_size(family, spec)
    from viewsphere.assets.mesh_file import packed, unpacked
    from viewsphere.assets.normalise import sorted_by_part
    from viewsphere.assets.primitive import FileFacts

    facts = FileFacts(Path(spec.source), "zoo", "+z", "-y", 1.0)
    name = hashlib.sha256(f"{_digest(family)} {family} {spec.seed} {spec.size}".encode()).hexdigest()
    return kept(
        "zoo",
        name,
        lambda: sorted_by_part(_built_to_size(family, spec)),
        lambda mesh: packed(mesh, facts),
        lambda content: unpacked(content, facts.path)[0],
    )


def _built_to_size(family: str, spec: ModelSpec) -> Mesh:
    import numpy as np

    rng = np.random.default_rng(spec.seed)
    return build(family, rng) if spec.size is None else getattr(plugins.family(family), f"{family}_sized")(rng, spec.size)


def clips_of(family: str) -> tuple[str, ...]:
    """Names of the animations of a family, none of those that stay as they are; raises UserError for an unknown family."""
    return getattr(plugins.family(family), "CLIPS", ())


def file_of(spec: ModelSpec) -> Path | None:
    """The GLB file of a model of a family that moves, made unless the cache has it; None for all others.

    Raises UserError for an unknown family, and OSError where neither the cache nor a temporary folder can be written.
    """
    import numpy as np

    family = spec.source.removeprefix(ZOO)
    if not spec.source.startswith(ZOO) or not clips_of(family):
        return None
    file = cache_of("zoo") / f"{family}-{_digest(family)}-{spec.seed}.glb"
    spare = _spare_files(os.getpid())
    if os.access(file, os.R_OK):  # `is_file` fails in a folder that cannot be read
        note_use(file)
    elif file not in spare:
        from viewsphere.assets.exporting.glb import rigged_glb_bytes

        data = rigged_glb_bytes(_built(family, np.random.default_rng(spec.seed)))
        try:
            with making(file) as half:
                half.write_bytes(data)
        except OSError:  # the cache is full, or cannot be written
            own = _own_folder(os.getpid()) / file.name
            own.write_bytes(data)
            spare[file] = own
    return spare.get(file, file)


@cache
def _spare_files(_process: int) -> dict[Path, Path]:
    """Files of this process in place of those that the cache did not take."""
    return {}


@cache
def _own_folder(_process: int) -> Path:
    """A folder of this process, for such files."""
    then = ExitStack()
    atexit.register(then.close)
    return then.enter_context(temporary("zoo"))


def _built(family: str, rng: np.random.Generator) -> Any:
    return getattr(plugins.family(family), f"{family}_random")(rng)


def _digest(family: str) -> str:
    """Of the sources that a family's file is made by, and of what else it is made of."""
    also = getattr(plugins.family(family), "made_of", None)
    return hashlib.sha256(f"{_sources()} {also() if also else ''}".encode()).hexdigest()[:20]


@cache
def _sources() -> str:
    """Digest of all sources that models of the zoo are made by, and of what their numbers depend on: the processor's type and
    the kernels' build.
    """
    from viewsphere.assets.cache import readers_digest
    from viewsphere.kernels.build import PAINTER

    own = Path(__file__).parent
    digest = hashlib.sha256(f"{readers_digest()} {PAINTER}".encode())
    for source in [*sorted(own.rglob("*.py")), *sorted(own.with_name("geometry").rglob("*.py"))]:
        digest.update(read_bytes(source))
    return digest.hexdigest()


@lru_cache(maxsize=1024)
def rooms_of(source: str, seed: int | None) -> tuple[NDArray[np.float64], ...]:
    """The air of the rooms in the member of the zoo of this source and seed, each a box (8, 3) in its own axes, metres; none
    where it has no rooms.

    A family with rooms has a function `rooms` that gives them by its parameters.
    """
    import numpy as np

    if not source.startswith(ZOO):
        return ()
    module = plugins.family(source.removeprefix(ZOO))
    if not hasattr(module, "rooms"):
        return ()
    rooms: tuple[NDArray[np.float64], ...] = module.rooms(module.draw(np.random.default_rng(seed)))
    for room in rooms:
        room.setflags(write=False)  # kept for the next call
    return rooms


def real_size(mesh: Mesh) -> tuple[float, float, float]:
    """Width, height, length (extent along x, z, y) of a mesh in metres, since a zoo mesh is modelled at real size."""
    low, high = mesh.bounds
    x, y, z = (high - low).tolist()
    return x, z, y
