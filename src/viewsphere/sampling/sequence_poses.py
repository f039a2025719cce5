"""The poses of sequences: every viewpoint of a recipe at every instant."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from viewsphere.model.camera import Intrinsics
from viewsphere.model.instant import Viewpoint
from viewsphere.model.scene import Vector
from viewsphere.recipe.sequence import TimeEntry
from viewsphere.sampling.viewpoints import Orbit, Poses


@dataclass(frozen=True)
class SequencePoses(Poses):
    """Poses that stand still for all instants of a sequence; the pose is the outer loop, the instant the inner one."""

    base: Poses
    instants: int

    @staticmethod
    def of(base: Poses, time: TimeEntry) -> SequencePoses:
        """Poses of a recipe with this time."""
        return SequencePoses(base.viewpoints, base.seed, base, time.count)

    @property
    def digest(self) -> str:
        """SHA-256 of the number of instants, and of what stands in a file of poses."""
        return hashlib.sha256(repr((self.base.digest, self.instants)).encode()).hexdigest()

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens that a file of poses names."""
        return self.base.intrinsics

    @property
    def lowest_elevation(self) -> float:
        """That of the poses."""
        return self.base.lowest_elevation

    @property
    def counts(self) -> dict[str, int]:
        """Those of the poses, then the number of instants."""
        return {**self.base.counts, "instants": self.instants}

    def target(self, index: int) -> Vector | None:
        """The pose's."""
        return self.base.target(index // self.instants)

    def place(self, index: int) -> str:
        """Name of the pose, which is the sequence's among those of its subject."""
        return self.base.place(index // self.instants)

    def name(self, index: int) -> str:
        """The pose's and the instant's."""
        return f"{self.place(index)} at instant {index % self.instants}"

    def view(self, index: int) -> Orbit:
        """The pose's."""
        return self.base.view(index // self.instants)

    def drawn_for(self, name: str) -> SequencePoses:
        """The same instants of poses, random ones of which are drawn anew for this name."""
        base = self.base.drawn_for(name)
        return SequencePoses(base.viewpoints, base.seed, base, self.instants)

    def _pose(self, index: int) -> Viewpoint:
        return self.base[index // self.instants].model_copy(update={"index": index})
