"""The scenery behind the objects of a data set's shots, which is remade because the data set does not store it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice

from viewsphere.assets.mesh import Mesh
from viewsphere.errors import ViewsphereError
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.run.shots.composing import SceneryRecord
from viewsphere.run.shots.models import mesh_digest
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Dataset

NONE = SceneryRecord(things=(), digests={})


@dataclass(eq=False)
class Scenery:
    """Provides shots as they were rendered and the meshes of their scenery. `notes` lists the changes since then."""

    dataset: Dataset
    notes: list[str] = field(default_factory=list[str])
    _stages: Stages = field(default_factory=Stages)
    _known: dict[str, Mesh | None] = field(default_factory=dict[str, Mesh | None])

    def __post_init__(self) -> None:
        self.shot = lru_cache(maxsize=4)(self._shot)
        self.around = lru_cache(maxsize=4)(self._around)

    def key_of(self, frame: int) -> str:
        """Key of the shot that contains a frame."""
        return self.dataset.plan.row_at(frame).key

    def position(self, sample: Sample, shot: Shot) -> tuple[int, int]:
        """The instant and the sensor of a sample, both counted from 0 in its shot."""
        place = sample.index - self.dataset.plan.row_at(sample.index).first
        _, instant, sensor = next(islice(shot.samples, place, None))
        return instant, sensor

    def _shot(self, key: str) -> Shot | None:
        return self.dataset.store.labelled(key)

    def _around(self, key: str) -> SceneryRecord:
        text = self.dataset.store.scenery(key)
        return SceneryRecord.model_validate_json(text) if text else NONE

    def mesh(self, record: SceneryRecord, thing: Thing) -> Mesh | None:
        """The mesh of a shot's scenery at the time step shown; None if it has changed. Merged data sets may have several
        meshes of one key.
        """
        digest = record.digests[thing.key]
        if digest not in self._known:
            self._known[digest] = None
            try:
                mesh = self._stages.model(thing.model, thing.step)
                if mesh_digest(mesh) == digest:
                    self._known[digest] = mesh
                else:
                    self.notes.append(f"background not checked where {thing.key} stands: it is not what it was")
            except ViewsphereError as error:
                self.notes.append(f"background not checked where {thing.key} stands: {error}")
        return self._known[digest]

    def unchanged_mesh(self, record: SceneryRecord, thing: Thing) -> Mesh:
        """The mesh of scenery that is known to be unchanged."""
        mesh = self.mesh(record, thing)
        assert mesh is not None
        return mesh
