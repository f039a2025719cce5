"""The two kinds of work a data set is made of: a model to normalise and export, a shot to render."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from viewsphere.assets.export import export_glb, export_obj
from viewsphere.assets.mesh import Mesh
from viewsphere.errors import StoreError
from viewsphere.geometry.box import box_size, box_vertices
from viewsphere.model.shot import ModelSpec, Shot
from viewsphere.run.stages import Stages, model_files
from viewsphere.store import ModelInfo, Store


@dataclass(frozen=True)
class Task:
    """A model or a shot as JSON. Tasks of one `affinity` share a warm stage."""

    kind: Literal["model", "shot"]
    key: str
    affinity: str
    payload: str


class Worker:
    """Does tasks for one data set."""

    def __init__(self, root: Path) -> None:
        self.store = Store(root)
        self.stages = Stages()

    def do(self, task: Task) -> int:
        """Do one task; gives the number of frames it made."""
        if task.kind == "model":
            self.make_model(ModelSpec.model_validate_json(task.payload))
            return 0
        shot = Shot.model_validate_json(task.payload)
        return self.store.write_shot(shot.key, self.stages.render(shot))

    def make_model(self, spec: ModelSpec) -> None:
        """Normalise a model and export it into the store, or see that the one there is the same.

        Raises ModelError for a file that cannot be used, StoreError for one that changed since its frames were made.
        """
        known = self.store.model_info(spec.key)
        if known is not None and spec.source.startswith("zoo:"):
            return  # the plan's digest and version already vouch for it
        mesh = self.stages.model(spec)
        digest = mesh_digest(mesh)
        if known is not None:
            if known.digest != digest:
                raise StoreError(
                    f"{self.store.root}: model {spec.key!r} ({spec.source}) changed since this data set was begun: "
                    "put the old file back, or choose another output folder"
                )
            return
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
        with self.store.aside(self.store.model_folder(spec.key)) as folder:
            export_obj(mesh, folder, spec.key)
            export_glb(mesh, folder / f"{spec.key}.glb")
            self.store.write_model_info(folder, info)


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
