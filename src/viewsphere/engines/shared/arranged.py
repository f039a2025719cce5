"""The parts that the stages of all engines share: a shot's things, meshes and triangles at each instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from viewsphere.assets.animation.deforming import Load, sharing
from viewsphere.assets.appearance.repaint import textured
from viewsphere.assets.appearance.wetting import wetted
from viewsphere.assets.mesh import Mesh
from viewsphere.engines.shared.lamps import lit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Repaint, Thing, TimeStep
from viewsphere.truth.moving import ROOMS, Ring, changed, differs_in_shape_only, shot_floor
from viewsphere.truth.raster.geometry import Geometry, placed_meshes, present

STEPS = 16
"""Number of time steps of models whose meshes are cached for the next instants."""


@dataclass(frozen=True, eq=False)
class Arranged:
    """The things of a shot at an instant. meshes[i] is the mesh of things[i], without triangles if that thing is absent.

    `whole` has the triangles of absent things, too. `geometry` is a new object only if some thing has moved.

    moving: the things that move in the shot, or during its exposures. known: the meshes used instead of `whole` for results
    that are costly to compute from a mesh; between two time steps, this is the nearer step's mesh. is_sequence: whether the
    shot is part of a sequence; otherwise its pictures are unrelated.
    """

    things: tuple[Thing, ...]
    whole: tuple[Mesh, ...]
    geometry: Geometry
    moving: tuple[int, ...]
    known: tuple[Mesh, ...]
    is_sequence: bool

    @property
    def meshes(self) -> list[Mesh]:
        """The meshes that the geometry was built from."""
        return present(self.things, self.whole)

    @cached_property
    def targets(self) -> int:
        """The number of targets: the things that are not scenery, which come first."""
        return sum(not thing.scenery for thing in self.things)

    @property
    def has_scenery(self) -> bool:
        """Return whether there is any scenery."""
        return self.targets < len(self.things)

    def changed_since(self, before: Arranged) -> list[int]:
        """Return the indices of the same things that have moved or deformed."""
        return changed(before.things, before.whole, self.things, self.whole)


@dataclass(frozen=True)
class _Look:
    """The appearance of a mesh: a model at a time step, with its changes to materials."""

    model: ModelSpec
    step: TimeStep
    repaints: tuple[Repaint, ...]

    def mesh(self, load: Load) -> Mesh:
        """The painted mesh of the model that `load` gives."""
        rest = load(self.model) if any(repaint.texture for repaint in self.repaints) else None
        return textured(load(self.model, self.step), self.repaints, rest)


@dataclass(frozen=True, eq=False)
class _Shown:
    """Gives models at their time steps; the latest `STEPS` are cached, so that a repeated request returns the same object."""

    load: Load
    soaked: float = 0.0
    _held: dict[_Look, Mesh] = field(default_factory=dict[_Look, Mesh])

    def mesh(self, thing: Thing, step: TimeStep, resting: Mesh) -> Mesh:
        """A thing's mesh at a time step, which shares equal data with the mesh at rest."""
        look = _Look(thing.model, step, thing.repaints)
        mesh_now = self._held.pop(look, None) or sharing(self._soaked(look.mesh(self.load)), resting)
        self._held[look] = mesh_now  # the most recently used comes last
        if len(self._held) > STEPS:
            del self._held[next(iter(self._held))]
        return mesh_now

    def _soaked(self, mesh: Mesh) -> Mesh:
        return wetted(mesh, self.soaked, evenly=True) if self.soaked else mesh


@dataclass(frozen=True, eq=False)
class Arrangements:
    """A shot's things at each of its instants; still things are loaded and placed once.

    The triangles of the latest instants are cached: see `truth.moving.Ring`.
    """

    shot: Shot
    shown: _Shown
    meshes: tuple[Mesh, ...]  # at rest
    floor: Floor | None
    ring: Ring
    _known: dict[int, Arranged] = field(default_factory=dict[int, Arranged])

    @classmethod
    def build(cls, shot: Shot, load: Load) -> Arrangements:
        """The arrangements of a shot, with all its models loaded; `load` gives a model's normalised mesh."""
        ring = Ring(shot.scene.ground is not None, shot.label_alpha, keeps_scenery=not shot.sequence)
        soaked = 0.0 if shot.scene.wet is None else shot.scene.wet.amount
        meshes = _dressed(shot.things, placed_meshes(shot.things, load), soaked)
        if shot.scene.lamps is not None:
            meshes = lit(shot.things, meshes, shot.scene.lamps)
        return cls(shot, _Shown(load, soaked), meshes, None, ring).for_shot(shot)

    def for_shot(self, shot: Shot) -> Arrangements:
        """The arrangements of another shot with an equal `stage_key`, which share the loaded meshes."""
        own = replace(self, shot=shot, _known={})
        return replace(own, floor=shot_floor(shot, lambda instant: own._meshes(shot.things_at(instant))))

    def at(self, instant: int) -> Arranged:
        """The things at an instant, counted from 0 in the shot."""
        known = self._known.pop(instant, None)
        things = self.shot.things_at(instant) if known is None else known.things
        meshes = self._meshes(things) if known is None else known.whole
        geometry = self.ring.geometry_at(things, meshes, self.floor)
        if known is None or known.geometry is not geometry:
            known = self._arranged(things, meshes, meshes, geometry)
        self._known[instant] = known  # the most recently requested comes last
        if len(self._known) > ROOMS:
            del self._known[next(iter(self._known))]
        return known

    def aside(self, instant: int) -> Arranged:
        """The things at an instant, without a place among the latest ones. The geometry is valid until the next call of this
        method or of `during`.
        """
        things = self.shot.things_at(instant)
        meshes = self._meshes(things)
        return self._arranged(things, meshes, meshes, self.ring.passing(things, meshes, self.floor))

    def during(self, instant: int, moment: float) -> Arranged:
        """The things a moment after an instant (as in `Sweep`) during the exposure. The geometry is valid until the next call
        of this method.
        """
        things = self.shot.things_during(instant, moment)
        known = self._meshes(things)
        exposure = self.shot.exposures[instant]
        sweeps = exposure.things if exposure else [None] * len(things)
        meshes = tuple(
            mesh if sweep is None or now.step is None else self._deformed(now, sweep.steps(moment), rest, mesh)
            for now, sweep, rest, mesh in zip(things, sweeps, self.meshes, known, strict=True)
        )
        return self._arranged(things, meshes, known, self.ring.passing(things, meshes, self.floor))

    def _arranged(
        self, things: tuple[Thing, ...], meshes: tuple[Mesh, ...], known: tuple[Mesh, ...], geometry: Geometry
    ) -> Arranged:
        return Arranged(things, meshes, geometry, self._moving, known, bool(self.shot.sequence))

    @cached_property
    def _moving(self) -> tuple[int, ...]:
        swept = {i for each in self.shot.exposures if each for i, sweep in enumerate(each.things) if sweep}
        return tuple(i for i, thing in enumerate(self.shot.things) if i in swept or not thing.motion.is_still)

    def _deformed(self, thing: Thing, steps: tuple[TimeStep | None, TimeStep | None, float], rest: Mesh, nearest: Mesh) -> Mesh:
        """The mesh between two time steps, or the nearest one if these are not made of the same triangles."""
        before, after, share = steps
        if before is None or after is None or before == after:
            return nearest
        start, end = self.shown.mesh(thing, before, rest), self.shown.mesh(thing, after, rest)
        return _blended(start, end, share) or nearest

    def _meshes(self, things: tuple[Thing, ...]) -> tuple[Mesh, ...]:
        """The meshes of these things, at the time steps that they show."""
        held = zip(things, self.meshes, strict=True)
        return tuple(mesh if now.step is None else self.shown.mesh(now, now.step, mesh) for now, mesh in held)


def _dressed(things: Sequence[Thing], meshes: Sequence[Mesh], soaked: float) -> tuple[Mesh, ...]:
    """The meshes with the textures that things are painted with, and wet if `soaked`; things with the same mesh and paint share
    one.
    """
    found: dict[tuple[int, tuple[Repaint, ...]], Mesh] = {}
    for thing, mesh in zip(things, meshes, strict=True):
        if (id(mesh), thing.repaints) not in found:
            dressed = textured(mesh, thing.repaints)
            if soaked:
                dressed = wetted(dressed, soaked, thing.model.category, evenly=bool(thing.motion.steps))
            found[id(mesh), thing.repaints] = dressed
    return tuple(found[id(mesh), thing.repaints] for thing, mesh in zip(things, meshes, strict=True))


def _blended(a: Mesh, b: Mesh, share: float) -> Mesh | None:
    """A mesh at a share of the way from one to another that differs only in shape, otherwise None."""
    if not differs_in_shape_only(a, b):
        return None
    vertices, normals = ((1 - share) * x + share * y for x, y in ((a.vertices, b.vertices), (a.normals, b.normals)))
    length = np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    unit = normals / np.where(length > 0, length, 1)
    return replace(a, vertices=vertices.astype(np.float32), normals=unit.astype(np.float32))
