"""Pictures in which enough is seen of their models: what is random in a frame is drawn again where too little is.

What decides is the label `visibility` itself, of the whole picture. A frame's draws follow from its names and the number of the
try, and it is judged by itself: neither workers nor the cut of shots change what is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import itemgetter

from viewsphere.assets.mesh import Mesh
from viewsphere.labels import Sight
from viewsphere.labels.visibility import LABEL as VISIBILITY
from viewsphere.model.shot import Shot
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.wanted import WantedEntry
from viewsphere.run.stages import Stages
from viewsphere.store import Dataset
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.moving import Ring, shot_floor
from viewsphere.truth.shot_views import ShotViews

MOST_TRIES = 32
"""Draws of a frame, the first one included, of which the one that shows most is taken where none shows enough."""

Take = Callable[[Sequence[int]], Shot]
"""Makes a shot, each frame at its try."""


@dataclass(frozen=True, eq=False)
class Framing:
    """How shots of a recipe come to show enough of their models."""

    recipe: Recipe
    stages: Stages

    def shot(self, take: Take) -> Shot:
        """The shot that `take` makes, with the first draw of each frame that shows enough of its models, or the best.

        Shots of several frames differ by their instants alone, whatever these's tries: the best of each are put together.
        """
        shot, least, wanted = take(()), self.recipe.min_visibility, self.recipe.wanted
        if wanted is None and least is None:
            return shot
        enough = 0.0 if wanted is not None or least is None else least
        ring = Ring(shot.scene.ground is not None, shot.label_alpha)
        best = [(self._seen(shot, i, ring), shot) for i in range(len(shot.instants))]
        for number in range(1, MOST_TRIES):
            hidden = [i for i, (seen, _) in enumerate(best) if seen < enough]
            if not hidden:
                break
            shot = take([number if i in hidden else 0 for i in range(len(best))])
            for i in hidden:
                best[i] = max(best[i], (self._seen(shot, i, ring), shot), key=itemgetter(0))
        instants = tuple(shot.instants[i] for i, (_, shot) in enumerate(best))
        return best[0][1].model_copy(update={"instants": instants})

    def _seen(self, shot: Shot, instant: int, ring: Ring) -> float:
        """How good a frame is: the least visibility of what has to be seen in it, or, below 0, how much it misses what is
        wanted; far below where its camera is inside of something.
        """
        wanted = shot.targets(self.recipe.scenes is not None)
        if not all(thing.at(instant).is_there for thing in wanted):
            return 1.0 if self.recipe.wanted is None else 0.0
        if not self.stages.is_free(shot, instant):
            return -10.0
        views = ShotViews(shot, lambda i: self._geometry(shot, i, ring))
        view = views.view(instant, 0)
        sight = Sight(view.geometry, view.camera, view.visibility)
        labels = [VISIBILITY.compute(sight, thing.id - 1) for thing in wanted]
        visibility, truncation = min(o["visibility"] for o in labels), max(o["truncation"] for o in labels)
        return visibility if self.recipe.wanted is None else -self.recipe.wanted.miss(visibility, truncation)

    def _geometry(self, shot: Shot, instant: int, ring: Ring) -> Geometry:
        """The triangles that stages of all engines have at an instant."""

        def meshes(at: int) -> tuple[Mesh, ...]:
            return tuple(self.stages.model(thing.model, thing.step) for thing in shot.things_at(at))

        return ring.at(shot.things_at(instant), meshes(instant), shot_floor(shot, meshes))


def missed_frames(dataset: Dataset, wanted: WantedEntry, together: bool) -> tuple[int, float]:
    """How many frames of a data set are not as wanted, and how far the farthest is from it; empty ones do not count."""
    misses: list[float] = []
    for key, places in dataset.shots():
        shot = dataset.store.labelled(key)
        ids = {thing.id for thing in shot.targets(together)} if shot else set[int]()
        for sample in dataset.samples_of(key, places):
            own = [o for o in sample.objects if o.id in ids]
            if own:
                misses.append(wanted.miss(min(o.visibility for o in own), max(o.truncation for o in own)))
    return sum(miss > 0 for miss in misses), max(misses, default=0.0)


def hidden_frames(dataset: Dataset, least: float, together: bool) -> int:
    """How many frames of a data set show less than this visibility of what has to be seen; empty ones do not count."""
    count = 0
    for key, places in dataset.shots():
        shot = dataset.store.labelled(key)
        wanted = {thing.id for thing in shot.targets(together)} if shot else set[int]()
        for sample in dataset.samples_of(key, places):
            shown = [o.visibility for o in sample.objects if o.id in wanted]
            count += bool(shown) and min(shown) < least
    return count
