"""The two kinds of work a data set is made of: a model to normalise and export, a shot to render."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from viewsphere.assets.cache import read_ahead
from viewsphere.assets.export import export_glb, export_obj
from viewsphere.assets.mesh import Mesh
from viewsphere.errors import StoreError
from viewsphere.geometry.box import box_size, box_vertices
from viewsphere.model.frozen import Frozen
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.run.stages import Stages, StoredBoxes, model_files
from viewsphere.run.warm import compile_kernels
from viewsphere.sampling.extension import Portion
from viewsphere.store import ModelInfo, Row, Store

Kind = Literal["model", "same model", "damaged model"]


@dataclass(frozen=True)
class ModelTask:
    """A model, with its moments behind it; the "same model" has to be what the store holds, if it is there. What is made of a
    "damaged model" takes its place.
    """

    kind: Kind
    specs: tuple[ModelSpec, ...]


@dataclass(frozen=True)
class Damaged:
    """A shot that is there, and is to be made again."""

    row: Row


@dataclass(frozen=True)
class KernelTask:
    """The kernels that a shot needs, to be compiled before others ask for them."""

    shot: Shot


class SceneryRecord(Frozen):
    """What is background in a shot: things of id 0, and the digest of each model's mesh by its key."""

    things: tuple[Thing, ...]
    digests: dict[str, str]


class Worker:
    """Does tasks for a part of a data set."""

    def __init__(self, root: Path, portion: Portion) -> None:
        self.store = Store(root)
        self.stages = Stages()
        self._portion = portion
        self._boxes = StoredBoxes(self.store)
        self._digests: dict[str, str] = {}

    def do(self, task: ModelTask | KernelTask | Row | Damaged) -> int:
        """Make models, kernels, or the shot of a row; gives the number of frames that were made."""
        if isinstance(task, Row):
            return self.make_shot(task)
        if isinstance(task, Damaged):
            return self.make_shot(task.row, again=True)
        if isinstance(task, KernelTask):
            compile_kernels(task.shot)
            return 0
        if task.kind == "damaged model":
            for spec in task.specs:
                mesh = self.stages.model(spec)
                self._export(spec, mesh, mesh_digest(mesh), again=True)
            return 0
        self.make_models(task.specs, trusted=task.kind == "model")
        return 0

    def make_shot(self, row: Row, again: bool = False) -> int:
        """Make the shot of a row and render it into the store; gives the number of its frames. Errors of one that takes the
        place of a damaged one (`again`) as for `Store.aside`.
        """
        with self._portion.plan.recipe.located():
            shot = self._portion.shot(row, self._boxes)
        return self.store.write_shot(shot.key, self.stages.render(shot), self._scenery(shot), shot.files, shot, again)

    def _scenery(self, shot: Shot) -> str:
        """What is background in a shot, and digests of its meshes, as `SceneryRecord` reads it; empty if nothing is."""
        things = tuple(p for p in shot.things if p.id == 0)
        for spec in {p.model.key: p.model for p in things}.values():
            if spec.key not in self._digests:
                self._digests[spec.key] = mesh_digest(self.stages.model(spec))
        digests = {p.model.key: self._digests[p.model.key] for p in things}
        return SceneryRecord(things=things, digests=digests).model_dump_json() if things else ""

    def make_models(self, specs: Sequence[ModelSpec], trusted: bool = True) -> None:
        """Make a model, and its moments behind it, as `make_model` does."""
        if len(specs) > 1 and specs[0].parts is None:
            read_ahead(specs)
        for spec in specs:
            self.make_model(spec, trusted)

    def make_model(self, spec: ModelSpec, trusted: bool = True) -> None:
        """Normalise a model and export it into the store, or see that the one there is the same.

        `trusted`: the plan's digest and version vouch for models of the zoo that are there. Raises ModelError for a file that
        cannot be used, StoreError for one that changed since its frames were made.
        """
        known = self.store.model_info(spec.key)
        if known is not None and trusted and spec.source.startswith("zoo:"):
            return
        mesh = self.stages.model(spec)
        digest = mesh_digest(mesh)
        if known is not None:
            self._compare(spec, known, digest)
            return
        self._export(spec, mesh, digest)

    def _export(self, spec: ModelSpec, mesh: Mesh, digest: str, again: bool = False) -> None:
        box = box_vertices(*mesh.bounds)
        obj, glb = model_files(spec.key)
        info = ModelInfo(
            key=spec.key,
            category=spec.category,
            supercategory=spec.supercategory,
            category_id=spec.category_id,
            obj=obj,
            glb=glb,
            box3d_object=box,
            size=box_size(box),
            real_size=self.stages.real_size(spec),
            parts=mesh.parts,
            triangles=len(mesh.triangles),
            digest=digest,
            warnings=mesh.warnings,
        )
        with self.store.aside(self.store.model_folder(spec.key), again) as folder:
            export_obj(mesh, folder, spec.key)
            export_glb(mesh, folder / f"{spec.key}.glb")
            self.store.write_model_info(folder, info)

    def _compare(self, spec: ModelSpec, known: ModelInfo, digest: str) -> None:
        if known.digest != digest:
            raise StoreError(
                f"{self.store.root}: model {spec.key!r} ({spec.source}) changed since this data set was begun: "
                "put the old one back, or choose another output folder"
            )
        now = {"category": spec.category, "supercategory": spec.supercategory, "real_size": self.stages.real_size(spec)}
        for name, value in now.items():
            if getattr(known, name) != value:
                raise StoreError(
                    f"{self.store.root}: expected {name} {getattr(known, name)!r} of model {spec.key!r}, as the data set has; "
                    f"found {value!r}: keep it, or choose another output folder"
                )


def mesh_digest(mesh: Mesh) -> str:
    """SHA-256 of all that is rendered or labelled of a mesh."""
    digest = hashlib.sha256()
    for name in (f.name for f in fields(Mesh) if f.name not in {"images", "warnings"}):
        value = getattr(mesh, name)
        digest.update(name.encode())
        digest.update(value.tobytes() if hasattr(value, "tobytes") else repr(value).encode())
    for image in mesh.images:
        digest.update(repr((image.name, image.pixels.shape)).encode() + image.pixels.tobytes())
    return digest.hexdigest()
