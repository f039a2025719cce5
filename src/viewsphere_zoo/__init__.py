"""Procedural models that ship with the tool, in metres, front -Y, up +Z, standing on z = 0.

A family is one module of `families`, named as its file: `NAME(...)` builds a Mesh from parameters and `NAME_random(rng)`
draws the parameters; `NAME_sized(rng, (width, height, length))`, where a family has it, draws those that its size leaves open.
Its `FAMILY` states the facts. A family that moves has clips, names of animations, and builds a RiggedModel: from there on it is
a GLB file in the cache, read and played as any other. `places` has the layouts of families, and the other packages hold the
parts that families are built from. Installed packages may add families and places.
"""

from __future__ import annotations

import atexit
import hashlib
import os
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viewsphere import plugins
from viewsphere.caches import cache_of
from viewsphere.caches.entries import cached, making, note_use
from viewsphere.files import read_bytes
from viewsphere.scratch import temporary

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.model_spec import ModelSpec
    from viewsphere.plugins.family import ZooFamily

ZOO = "zoo:"

ANY = "any"
"""Stands for every shipped family whose members are things."""


def family(name: str) -> ZooFamily:
    """The spec of a family; raises UserError for an unknown one, with the nearest known one."""
    from viewsphere.plugins.family import ZooFamily

    return plugins.load(ZooFamily, name)


def drawing_of(name: str) -> Callable[[np.random.Generator], Any]:
    """The function that draws a family's parameters; raises PluginError for a family without one."""
    from viewsphere.errors import PluginError

    draw = family(name).draw
    if draw is None:
        raise PluginError(f"family {name}: places need `draw`, which it does not have")
    return draw


def things() -> tuple[str, ...]:
    """Names of the shipped families that are things, not parts of places, sorted; all of them are imported. Families of other
    packages are left out: installing one does not change what a recipe draws.
    """
    return tuple(sorted(name for name in plugins.shipped("families") if family(name).home != "place"))


def family_names() -> tuple[str, ...]:
    """Names of all families, sorted; none is imported."""
    return plugins.names("families")


def build(name: str, rng: np.random.Generator) -> Mesh:
    """A random member of the family, as it rests; the same generator state gives the same bytes.

    Raises UserError for an unknown family, with the nearest known one.
    """
    made = _random(name, rng)
    if not family(name).clips:
        return made
    from viewsphere.assets.exporting.glb import rigged_glb_bytes
    from viewsphere.assets.load import load_model
    from viewsphere.assets.normalise import normalise
    from viewsphere.model.model_spec import ModelSpec

    with temporary("zoo") as place:
        file = place / f"{name}.glb"
        file.write_bytes(rigged_glb_bytes(made))
        raw, facts = load_model(file)
    spec = ModelSpec(key=name, source=ZOO + name, category=name, category_id=0, centring="as_is")
    return normalise(raw, facts, spec)


def _random(name: str, rng: np.random.Generator) -> Any:
    """The result of the family's `random`: a Mesh, or a RiggedModel for a family that moves; raises PluginError for another."""
    from viewsphere.assets.mesh import Mesh
    from viewsphere.plugins.family import ZooFamily

    wanted: type[Any] = Mesh
    if family(name).clips:
        from viewsphere.assets.exporting.rigged import RiggedModel

        wanted = RiggedModel
    return plugins.checked(ZooFamily, name, "random", family(name).random(rng), wanted)


def build_zoo_model(spec: ModelSpec) -> Mesh | Path:
    """The procedural model that a `zoo:family` source names, drawn from its seed and built to its requested size: its mesh,
    from the cache if possible, or the file of a moving model.
    """
    file = file_of(spec)
    if file is not None:
        return file
    name = spec.source.removeprefix(ZOO)
    if plugins.is_third_party("families", name):  # whose sources, all together, are not known
        return _built_to_size(name, spec)
    from viewsphere.assets.mesh_file import packed, unpacked
    from viewsphere.assets.normalise import sorted_by_part
    from viewsphere.assets.primitive import FileFacts

    facts = FileFacts(Path(spec.source), "zoo", "+z", "-y", 1.0)
    return cached(
        "zoo",
        hashlib.sha256(f"{_digest(name)} {name} {spec.seed} {spec.size}".encode()).hexdigest(),
        lambda: sorted_by_part(_built_to_size(name, spec)),
        lambda mesh: packed(mesh, facts),
        lambda content: unpacked(content, facts.path)[0],
    )


def _built_to_size(name: str, spec: ModelSpec) -> Mesh:
    import numpy as np

    from viewsphere.assets.mesh import Mesh
    from viewsphere.errors import ModelError
    from viewsphere.plugins.family import ZooFamily

    rng, sized = np.random.default_rng(spec.seed), family(name).sized
    if spec.size is None:
        return build(name, rng)
    if sized is None:
        raise ModelError(f"{spec.source}: expected a family with `sized`, which builds it to a size; {name} has none")
    return plugins.checked(ZooFamily, name, "sized", sized(rng, spec.size), Mesh)


def file_of(spec: ModelSpec) -> Path | None:
    """The GLB file of a model of a family that moves, made unless the cache has it; None for all others. One of another
    package is made in each process, as all that it is made by is not known: one in the cache might be out of date.

    Raises UserError for an unknown family, and OSError where neither the cache nor a temporary folder can be written.
    """
    name = spec.source.removeprefix(ZOO)
    if not spec.source.startswith(ZOO) or not family(name).clips:
        return None
    is_third_party, spare = plugins.is_third_party("families", name), _spare_files(os.getpid())
    file = cache_of("zoo") / f"{name}-{_digest(name)}-{spec.seed}.glb"
    if not is_third_party and os.access(file, os.R_OK):  # `is_file` fails in a folder that cannot be read
        note_use(file)
    elif file not in spare:
        data = _glb(name, spec.seed)
        if is_third_party or not _into_cache(file, data):
            own = _own_folder(os.getpid()) / file.name
            own.write_bytes(data)
            spare[file] = own
    return spare.get(file, file)


def _glb(name: str, seed: int | None) -> bytes:
    import numpy as np

    from viewsphere.assets.exporting.glb import rigged_glb_bytes

    return rigged_glb_bytes(_random(name, np.random.default_rng(seed)))


def _into_cache(file: Path, data: bytes) -> bool:
    """Return whether the cache took the file; it may be full, or cannot be written."""
    try:
        with making(file) as half:
            half.write_bytes(data)
    except OSError:
        return False
    return True


@cache
def _spare_files(_process: int) -> dict[Path, Path]:
    """Files of this process in place of those in the cache."""
    return {}


@cache
def _own_folder(_process: int) -> Path:
    """A folder of this process, for such files."""
    then = ExitStack()
    atexit.register(then.close)
    return then.enter_context(temporary("zoo"))


def _digest(name: str) -> str:
    """Digest of the sources and the data from which a family's file is made."""
    made_of = family(name).made_of
    return hashlib.sha256(f"{_sources()} {made_of() if made_of else ''}".encode()).hexdigest()[:20]


@cache
def _sources() -> str:
    """Digest of all sources of the zoo's models, and of everything that changes their numbers: the processor's type and the
    kernels' build.
    """
    from viewsphere import geometry
    from viewsphere.assets.cache import readers_digest
    from viewsphere.kernels.build import PAINTER

    digest = hashlib.sha256(f"{readers_digest()} {PAINTER}".encode())
    for package in (__file__, geometry.__file__):
        for source in sorted(Path(package).parent.rglob("*.py")):
            digest.update(read_bytes(source))
    return digest.hexdigest()


def real_size(mesh: Mesh) -> tuple[float, float, float]:
    """Width, height, length (extent along x, z, y) of a mesh in metres, since a zoo mesh is modelled at real size."""
    low, high = mesh.bounds
    x, y, z = (high - low).tolist()
    return x, z, y
