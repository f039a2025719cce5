"""Procedural models that ship with the tool, in metres, front -Y, up +Z, standing on z = 0.

A family is one module of this package, named as its file: `NAME(...)` builds a Mesh from parameters and `NAME_random(rng)`
draws the parameters; `NAME_sized(rng, (width, height, length))`, where a family has it, draws those that its size leaves open.
`HOME` says where its members are found, `KEYPOINTS` are its named points by its parts, and `SKELETON` lines between them.
Sub-packages hold the parts that families are built from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from viewsphere import plugins

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.model_spec import ModelSpec

Home = Literal["table", "floor", "street", "garden", "water", "place"]
"""Where a family is found; `place`: it is a place's ground or building, not a thing in it."""

HOMES: tuple[Home, ...] = get_args(Home)


def home(family: str) -> Home:
    """Where a family is found; raises UserError for an unknown family, with the nearest known one."""
    return plugins.family(family).HOME


def things() -> tuple[str, ...]:
    """Names of the families that are things, not parts of places, sorted; all families are imported."""
    return tuple(family for family in families() if home(family) != "place")


def families() -> tuple[str, ...]:
    """Names of all families, sorted; none is imported."""
    return plugins.families()


def build(family: str, rng: np.random.Generator) -> Mesh:
    """A random member of the family; the same generator state gives the same bytes.

    Raises UserError for an unknown family, with the nearest known one.
    """
    return getattr(plugins.family(family), f"{family}_random")(rng)


def build_zoo_model(spec: ModelSpec) -> Mesh:
    """The procedural model that a `zoo:family` source names, drawn from its seed, and built to the size that it asks for."""
    import numpy as np

    family, rng = spec.source.removeprefix("zoo:"), np.random.default_rng(spec.seed)
    return build(family, rng) if spec.size is None else getattr(plugins.family(family), f"{family}_sized")(rng, spec.size)


def rooms_of(spec: ModelSpec) -> tuple[NDArray[np.float64], ...]:
    """The air of the rooms in a member of the zoo, each a box (8, 3) in its own axes, metres; none where it has no rooms.

    A family with rooms has a function `rooms` that gives them by its parameters.
    """
    import numpy as np

    if not spec.source.startswith("zoo:"):
        return ()
    module = plugins.family(spec.source.removeprefix("zoo:"))
    if not hasattr(module, "rooms"):
        return ()
    return module.rooms(module.draw(np.random.default_rng(spec.seed)))


def real_size(mesh: Mesh) -> tuple[float, float, float]:
    """Width, height, length (extent along x, z, y) of a mesh in metres, since a zoo mesh is modelled at real size."""
    low, high = mesh.bounds
    x, y, z = (high - low).tolist()
    return x, z, y
