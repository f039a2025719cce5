"""The list of installed plug-ins, including those that cannot be loaded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version

from viewsphere.errors import UserError
from viewsphere.labels import LabelSpec
from viewsphere.plugin_modules import PACKAGES
from viewsphere.plugins.effect import EffectSpec
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.family import ZooFamily
from viewsphere.plugins.format import FormatSpec
from viewsphere.plugins.lens import LensSpec
from viewsphere.plugins.light import LightSpec
from viewsphere.plugins.material import MaterialSpec
from viewsphere.plugins.motion import MotionSpec
from viewsphere.plugins.place import PlaceSpec
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.plugins.reader import ReaderSpec
from viewsphere.plugins.registry import OWN, SEAMS, Kind, entry_points, gap, load, names, origin, shipped
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.plugins.source import SourceSpec
from viewsphere.plugins.spec import Spec
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.validation.errors import one_of

SPECS: tuple[type[Spec | LensSpec], ...] = (
    EffectSpec,
    EngineSpec,
    FormatSpec,
    LabelSpec,
    LensSpec,
    LightSpec,
    MaterialSpec,
    MotionSpec,
    PlaceSpec,
    PlacerSpec,
    ReaderSpec,
    SamplerSpec,
    SourceSpec,
    TrajectorySpec,
    ZooFamily,
)
"""The specs of all kinds."""


@dataclass(frozen=True)
class Installed:
    """A plug-in, its distribution with the version, and the reason why it cannot be loaded (None: it can). For a package
    without a kind, `kind` is the group of its entry point.
    """

    kind: str
    name: str
    distribution: str
    error: str | None


def overview() -> tuple[Installed, ...]:
    """Return all plug-ins, by kind and name; each is loaded. Packages of a kind that there is not follow, and kinds whose
    plug-ins viewsphere's installation lacks.
    """
    found = [Installed(kind, name, origin(kind, name), _error(kind, name)) for kind in SEAMS for name in names(kind)]
    gaps = (Installed(kind, "(all)", f"{OWN} {version(OWN)}", gap()) for kind in SEAMS if not shipped(kind))
    return (*found, *_packages_of_no_kind(), *gaps)


def _packages_of_no_kind() -> Iterator[Installed]:
    for entry in entry_points(PACKAGES):
        if entry.name not in SEAMS:
            distribution = f"{entry.dist.name} {entry.dist.version}" if entry.dist else ""
            yield Installed(PACKAGES, entry.value, distribution, f"{PACKAGES}: {one_of(entry.name, sorted(SEAMS))}")


def _error(kind: Kind, name: str) -> str | None:
    try:
        load({spec.KIND: spec for spec in SPECS}[kind], name)
    except UserError as error:
        return str(error)
    return None
