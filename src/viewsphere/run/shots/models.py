"""The models of a data set: normalisation, export, and comparison with the stored models."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from textwrap import shorten

from viewsphere import codecs
from viewsphere.assets.animation.deforming import DeformingMesh
from viewsphere.assets.cache import frame_of, read_ahead, readers_digest
from viewsphere.assets.exporting.export import export_deforming, export_glb, export_obj
from viewsphere.assets.mesh import Mesh
from viewsphere.caches.budget import EXPORTS
from viewsphere.caches.folders import cached_files
from viewsphere.errors import StoreError, each
from viewsphere.files import read_bytes
from viewsphere.geometry.box3d import Box3d
from viewsphere.kernels.build import HOST
from viewsphere.kernels.digests import package_digest
from viewsphere.labels import ShotAppearance, labels, requires
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.planning.distances import Distances
from viewsphere.planning.plan import Plan
from viewsphere.plugins.source import is_versioned
from viewsphere.run.progress import Listener, Progress, null_listener
from viewsphere.run.shots.stages import Stages, model_files
from viewsphere.store import ModelInfo, PlanRecord, Store
from viewsphere.store.shots.manifest import Manifest

Steps = dict[int, TimeStep]
"""Time steps by the frames of their model's file, ascending."""

Export = Callable[[Path], None]
"""Writes a model's files into a folder."""


@dataclass(frozen=True)
class Models:
    """Makes the models of a store for this plan's data set."""

    store: Store
    stages: Stages
    record: PlanRecord

    @cached_property
    def _keeps_looks(self) -> bool:
        """Return whether a label of the data set needs the appearance of models."""
        asked = {name for part in self.record.parts for name in part.recipe.get("annotations", ())}
        return any(requires(labels()[name].needs, ShotAppearance) for name in asked if name in labels())

    def make(self, spec: ModelSpec, steps: Iterable[TimeStep] = (), credit: Credit | None = None, trusted: bool = True) -> None:
        """Normalise a model, at these time steps if it deforms, and export it into the store. If the store has the model, check
        that it is the same, add missing time steps, and replace its credit.

        With `trusted`, existing models that follow the version are not compared: the plan's digest and version guarantee them.
        Raises ModelError for an unusable file, StoreError for a model that changed since its frames were made.
        """
        known, wanted = self.store.model_info(spec.key), _with_rest(spec, steps)
        self._check_key(spec)
        credit = credit or (known and known.credit)
        if known is not None and trusted and not wanted and is_versioned(spec.source) and credit == known.credit:
            return
        if wanted:
            read_ahead(spec, wanted)
        if known is not None:
            self._compare(spec, known, wanted)
            held = _steps(known)
            if wanted.keys() <= held.keys() and credit == known.credit:
                return
            wanted = _with_rest(spec, chain(held.values(), wanted.values()))
            if wanted:
                read_ahead(spec, wanted)
        target = self.store.model_folder(spec.key)
        self._write(spec, wanted, credit, self.store.scratch_folder(target) if known is None else self.store.replacing(target))

    def mend(self, spec: ModelSpec, steps: Iterable[TimeStep], credit: Credit | None = None) -> None:
        """Replace a damaged model; raises StoreError if the damaged one was a different model. `credit` is used if the damaged
        model's credit is unknown.
        """
        wanted = _with_rest(spec, steps)
        if wanted:
            read_ahead(spec, wanted)
        place = self.store.scratch_folder(self.store.model_folder(spec.key), again=True)
        self._write(spec, wanted, self._credit_of(spec.key, credit), place)

    def _credit_of(self, key: str, otherwise: Credit | None) -> Credit | None:
        """Return the credit in a model's record, if its manifest confirms the record."""
        file = self.store.model_folder(key) / "model.json"
        try:
            Manifest.read(file.parent).check(file.name, read_bytes(file), file)
            known = self.store.model_info(key)
        except (StoreError, OSError):
            return otherwise
        return otherwise if known is None else known.credit

    def _check_key(self, spec: ModelSpec) -> None:
        """Raise StoreError if the key belongs to a time step of a model in the store."""
        track, _, frame = spec.key.rpartition("-f")
        info = self.store.model_info(track) if track and frame.isdecimal() else None
        if info is not None and any(step.key == spec.key for step in info.steps):
            raise StoreError(
                f"{self.store.root}: expected another name for {spec.key!r}, which is a time step of its model {track!r}: "
                "give the recipe's entry a name"
            )

    def record_and_export(self, spec: ModelSpec, steps: Iterable[TimeStep], credit: Credit | None) -> tuple[ModelInfo, Export]:
        """The record of a model at these time steps, made from its source, and the function that writes its files. Raises
        ModelError for an unusable file.
        """
        return self._made(spec, _with_rest(spec, steps), credit)

    def _made(self, spec: ModelSpec, steps: Steps, credit: Credit | None) -> tuple[ModelInfo, Export]:
        info, export = self._deforming(spec, steps) if steps else self._still(spec)
        return replace(info, credit=credit, steps=tuple(replace(one, credit=credit) for one in info.steps)), export

    def _write(self, spec: ModelSpec, steps: Steps, credit: Credit | None, place: AbstractContextManager[Path]) -> None:
        """Export a model into a folder, with all its time steps if it deforms."""
        info, export = self._made(spec, steps, credit)
        with place as folder:
            cached_files(EXPORTS, _digest_of_export(info), export, folder)
            self.store.write_model_info(folder, info)

    def _still(self, spec: ModelSpec) -> tuple[ModelInfo, Export]:
        """The record and export of a model that does not deform."""
        mesh = self.stages.model(spec)

        def export(folder: Path) -> None:
            export_obj(mesh, folder, spec.key)
            export_glb(mesh, folder / f"{spec.key}.glb")

        return self._info(spec, mesh), export

    def _deforming(self, spec: ModelSpec, steps: Steps) -> tuple[ModelInfo, Export]:
        """The record and export of a deforming model with all its time steps."""
        model = DeformingMesh.from_meshes({frame: self.stages.model(spec, step) for frame, step in steps.items()})
        infos = tuple(replace(self._info(spec, model.meshes[f], step), track=spec.key) for f, step in steps.items())
        rest = next(info for info in infos if info.step == steps[_rest(spec)])

        def export(folder: Path) -> None:
            export_deforming(model, folder, spec.key, {frame: step.seconds for frame, step in steps.items()})

        return replace(rest, key=spec.key, track="", steps=infos), export

    def _info(self, spec: ModelSpec, mesh: Mesh, step: TimeStep | None = None) -> ModelInfo:
        """Return the metadata of a model, or of one of its time steps."""
        frame, box, metadata = step and step.frame, Box3d.between(*mesh.bounds).corners, self.stages.metadata(spec, step)
        obj, glb = model_files(spec.key, frame)
        return ModelInfo(
            key=spec.key_at(frame),
            category=spec.category,
            supercategory=spec.supercategory,
            category_id=spec.category_id,
            obj=obj,
            glb=glb,
            box3d_object=box,
            size=Box3d(box).size,
            real_size=self.stages.real_size(spec, step),
            parts=mesh.parts,
            triangles=len(mesh.triangles),
            digest=mesh_digest(mesh),
            warnings=mesh.warnings,
            step=step,
            materials=tuple(material.name for material in mesh.materials),
            diameter=metadata.diameter,
            symmetries=metadata.symmetries,
            keypoints=metadata.keypoints,
            body_parts=mesh.body_parts,
            looks=metadata.looks() if self._keeps_looks else None,
            faces=spec.faces,
        )

    def _compare(self, spec: ModelSpec, known: ModelInfo, wanted: Steps) -> None:
        """Raise StoreError if the model differs from the stored one at the stored time steps."""
        held = _steps(known)
        if bool(held) != bool(wanted):
            raise _changed(self.store, spec)
        for frame in wanted.keys() & held.keys() if wanted else (None,):
            info, step = known.at_frame(frame), None if frame is None else wanted[frame]
            if info.digest != mesh_digest(self.stages.model(spec, step)):
                raise _changed(self.store, spec)
            now: dict[str, object] = {
                "category": spec.category,
                "supercategory": spec.supercategory,
                "real_size": self.stages.real_size(spec, step),
            }
            if info.diameter is not None:
                metadata = self.stages.metadata(spec, step)
                now |= {"symmetries": metadata.symmetries, "keypoints": metadata.keypoints}
                if info.looks is not None:
                    now["looks"] = metadata.looks()
            for name, value in now.items():
                if getattr(info, name) != value:
                    raise StoreError(
                        f"{self.store.root}: expected {name} {_short(getattr(info, name))} of model {info.key!r}, as the data "
                        f"set has; found {_short(value)}: keep it, or choose another output folder"
                    )


def _digest_of_export(info: ModelInfo) -> str:
    """The digest of all that the files of a model depend on: meshes, names, times of their frames, and what writes them."""
    frames = [(one.key, one.digest, one.step) for one in info.steps]
    return hashlib.sha256(repr((_writers(), info.key, info.digest, frames)).encode()).hexdigest()


@cache
def _writers() -> str:
    """The sources that write models' files, and the processor's type and the library on which the bytes of PNG files depend."""
    return f"{readers_digest()} {package_digest(Path(codecs.__file__).parent)} {HOST} {version('isal')}"


def _short(value: object) -> str:
    """A value for a message, shortened because models' metadata may be long."""
    return repr(value) if value is None or isinstance(value, (str, tuple)) else shorten(str(value), 100, placeholder=" ...")


def _changed(store: Store, spec: ModelSpec) -> StoreError:
    return StoreError(
        f"{store.root}: model {spec.key!r} ({spec.source}) changed since this data set was begun: "
        "put the old one back, or choose another output folder"
    )


def _rest(spec: ModelSpec) -> int:
    """The frame of an animated model's rest pose."""
    frame = frame_of(spec, None)
    assert frame is not None
    return frame


def _with_rest(spec: ModelSpec, steps: Iterable[TimeStep]) -> Steps:
    """The time steps, including the one of the rest pose; none for a model that does not deform."""
    found = {step.frame: step for step in steps}
    return dict(sorted(({_rest(spec): TimeStep(frame=_rest(spec))} | found).items())) if found else {}


def _steps(known: ModelInfo) -> Steps:
    return {info.step.frame: info.step for info in known.steps if info.step}


def mesh_digest(mesh: Mesh) -> str:
    """SHA-256 of all that is rendered or labelled of a mesh."""
    digest = hashlib.sha256()
    for name in (f.name for f in fields(Mesh) if f.name not in {"images", "warnings"}):
        value = getattr(mesh, name)
        if "body_part" in name and not mesh.body_parts:
            continue  # models without bones keep the digests from before body parts existed
        digest.update(name.encode())
        digest.update(value.tobytes() if hasattr(value, "tobytes") else repr(value).encode())
    for image in mesh.images:
        digest.update(repr((image.name, image.pixels.shape)).encode() + image.pixels.tobytes())
    return digest.hexdigest()


def check_models(planned: Plan, tell: Listener = null_listener) -> tuple[str, ...]:
    """Read each model of a plan, place it and its cameras; returns the warnings, `<key>: <warning>`.

    Raises ModelError or RecipeError, with one line each for all unusable files, and for all models and scenes without room or
    with a camera inside.
    """
    stages, specs = Stages(), planned.kept_specs
    distances = Distances(planned, stages.box)

    def warnings(number: int) -> list[str]:
        mesh = stages.model(specs[number])
        tell(Progress("models", number + 1, len(specs)))
        return [f"{specs[number].key}: {warning}" for warning in mesh.warnings]

    def stand(subject: str) -> None:
        problem = distances.problem(subject)
        if problem:
            raise problem

    found = each(warnings, range(len(specs)))
    with planned.recipe.located():
        each(stand, planned.subjects)
    return tuple(dict.fromkeys(line for lines in found for line in lines))
