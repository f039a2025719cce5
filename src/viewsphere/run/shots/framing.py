"""Shots that fit: random values of a scene or frame are redrawn if a camera has an invalid place or too little is visible.

The label `visibility` of the whole picture decides. A frame's random values follow from its names and the number of the try,
and each frame is judged by itself. A scene's random values follow from its names and the number of the redraw, and all of its
cameras judge it. So neither the workers nor the division into shots affect the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter
from typing import Protocol

from viewsphere.assets.mesh import Mesh
from viewsphere.composing.composition import BoxOf
from viewsphere.composing.redraws import redraws_frames
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.labels import LabelContext
from viewsphere.labels.visibility import LABEL as VISIBILITY
from viewsphere.limits import limits
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.plan import Plan
from viewsphere.run.shots.camera_collisions import CameraChecks
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Row
from viewsphere.truth.moving import Ring, shot_floor
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.shot_views import ShotViews

NO_PLACE = -10.0
"""Value of a frame with an invalid camera: far below the value of any frame that misses its targets."""

OUT_OF_VIEW = -1.0
"""Value of a frame in which no object can be seen, if the recipe sets no visibility."""

Take = Callable[[Sequence[int], int], Shot]
"""Makes a shot from the try of each frame and a redraw number. The scene uses the first redraw from it on with enough room."""


class _Source(Protocol):
    """A plan, or a part of a data set, that provides shots."""

    def shot(self, row: Row, box_of: BoxOf, redraws: Sequence[int] = (), redraw: int = 0) -> Shot:
        """The shot of a row."""
        ...

    def whole(self, row: Row) -> Row | None:
        """Return a row with all poses of the row's scene, in the plan's numbering; None if the row has them already."""
        ...


@dataclass(frozen=True, eq=False)
class Framing:
    """Composes the shots of a plan, or of a part of a data set (`source`), so that they fit."""

    plan: Plan
    source: _Source
    stages: Stages
    box_of: BoxOf
    _scenes: dict[Row, int] = field(default_factory=dict[Row, int])

    def shot(self, row: Row, settled: int | None = None) -> Shot:
        """The shot of a row. It uses the first redraw of its scene that fits, and each frame's first try that shows enough of
        its models, or else the best try. `settled` is the redraw number of the scene in existing frames.

        Raises RecipeError if nothing fits.
        """
        take, whole = self._taker(self.source, row), self.source.whole(row)
        if settled is not None:
            return self._fitting(take, settled, settled + 1)
        if whole is None:
            return self._fitting(take, 0, self.plan.draws)
        if whole not in self._scenes:
            self._scenes.clear()  # the shots of a scene follow one another
            self._scenes[whole] = self._fitting(self._taker(self.plan, whole), 0, self.plan.draws, False).redraw
        return self._fitting(take, self._scenes[whole], self._scenes[whole] + 1)

    def _taker(self, source: _Source, row: Row) -> Take:
        return lambda redraws, redraw: source.shot(row, self.box_of, redraws, redraw)

    def _fitting(self, take: Take, redraw: int, stop: int, is_judged: bool = True) -> Shot:
        """The shot in the first redraw of its scene that fits; without `is_judged`, only its cameras have to fit."""
        problems: list[RecipeError] = []
        while redraw < stop:
            try:
                shot, problem = self._framed(take, redraw, is_judged)
            except RecipeError as error:
                problems.append(error)
                break
            if problem is None:
                return shot
            problems.append(problem)
            redraw = shot.redraw + 1
        raise problems[0]

    def _framed(self, take: Take, redraw: int, is_judged: bool) -> tuple[Shot, RecipeError | None]:
        """The shot in one redraw of its scene, and the problem of the first frame whose camera never fits.

        The tries of a shot differ only in their instants, so the best instants of all tries are combined.
        """
        shot = take((), redraw)
        first = self._problems(shot)
        if not redraws_frames(self.plan.recipe):
            return shot, next((problem for problem in first if problem), None)
        judge = self._judge(shot) if is_judged else _content
        best = [(NO_PLACE if problem else judge(shot, i), shot) for i, problem in enumerate(first)]
        for number in range(1, limits.MAX_REDRAWS):
            poor = [i for i, (seen, _) in enumerate(best) if seen < self._enough]
            if not poor:
                break
            try:
                other = take([number if i in poor else 0 for i in range(len(best))], shot.redraw)
            except RecipeError:  # no room for the frame's own random objects
                continue
            if other.redraw != shot.redraw:
                continue
            for i in poor:
                seen = NO_PLACE if self._problem(other, i) else judge(other, i)
                best[i] = max(best[i], (seen, other), key=itemgetter(0))
        framed = best[0][1].model_copy(update={"instants": tuple(shot.instants[i] for i, (_, shot) in enumerate(best))})
        return framed, next((first[i] for i, (seen, _) in enumerate(best) if seen == NO_PLACE), None)

    @property
    def _enough(self) -> float:
        """Value of a frame that need not be drawn again."""
        return 0.0 if self.plan.recipe.wanted is not None else self.plan.recipe.min_visibility or 0.0

    def _problems(self, shot: Shot) -> list[RecipeError | None]:
        """The problems of each frame's cameras."""
        try:
            CameraChecks(self.stages).check_shot(shot)
        except RecipeError as error:
            if len(shot.instants) == 1 or shot.sequence:  # a sequence is redrawn as a whole
                return [error] * len(shot.instants)
            return [self._problem(shot, i) for i in range(len(shot.instants))]
        return [None] * len(shot.instants)

    def _problem(self, shot: Shot, instant: int) -> RecipeError | None:
        try:
            CameraChecks(self.stages).check_instant(shot, instant)
        except RecipeError as error:
            return error
        return None

    def _judge(self, shot: Shot) -> Callable[[Shot, int], float]:
        """The function that returns the quality of a frame of such a shot."""
        recipe = self.plan.recipe
        if recipe.wanted is None and recipe.min_visibility is None:
            return partial(_in_view, self.box_of, recipe.scenes is not None)
        return partial(self._seen, Ring(shot.scene.ground is not None, shot.label_alpha))

    def _seen(self, ring: Ring, shot: Shot, instant: int) -> float:
        """Return the quality of a frame: the least visibility of its targets.
        With `wanted` in the recipe, it is minus the distance from the wanted ranges of visibility and truncation.
        """
        recipe = self.plan.recipe
        wanted = shot.targets(recipe.scenes is not None)
        if not all(thing.still_at(instant).is_there for thing in wanted):
            return 1.0 if recipe.wanted is None else 0.0
        views = ShotViews(shot, lambda i: self._geometry(shot, i, ring))
        view = views.view(instant, 0)
        context = LabelContext(view.geometry, view.camera, view.visibility)
        labels = [VISIBILITY.compute(context, thing.id - 1) for thing in wanted]
        visibility, truncation = min(o["visibility"] for o in labels), max(o["truncation"] for o in labels)
        return visibility if recipe.wanted is None else -recipe.wanted.miss(visibility, truncation)

    def _geometry(self, shot: Shot, instant: int, ring: Ring) -> Geometry:
        """The triangles that stages of all engines have at an instant."""

        def meshes(at: int) -> tuple[Mesh, ...]:
            return tuple(self.stages.model(thing.model, thing.step) for thing in shot.things_at(at))

        return ring.geometry_at(shot.things_at(instant), meshes(instant), shot_floor(shot, meshes))


def _content(shot: Shot, instant: int) -> float:
    return 0.0


def _in_view(box_of: BoxOf, together: bool, shot: Shot, instant: int) -> float:
    """The value of a frame, judged by the corners of the objects' boxes: whether any sensor's picture may show an object."""
    targets = [now for thing in shot.targets(together) if (now := thing.still_at(instant)).is_there]
    cameras = (shot.camera(instant, sensor) for sensor in range(len(shot.rig.sensors)))
    seen = not targets or any(_may_show(camera, thing, box_of) for camera in cameras for thing in targets)
    return 0.0 if seen else OUT_OF_VIEW


def _may_show(camera: Camera, thing: Thing, box_of: BoxOf) -> bool:
    """Return whether a camera may show a thing; any lens but a plain pinhole counts as showing everything."""
    lens = camera.intrinsics
    if not lens.lens.is_linear or lens.skew:
        return True
    corners = transform(thing.world_from_object, box_of(thing.model, thing.step))
    x, y, z = (transform(camera.R, corners) + camera.t).T
    u, v = lens.fx * x + lens.cx * z, lens.fy * y + lens.cy * z
    beside = (u < 0, u > lens.width * z, v < 0, v > lens.height * z, z <= 0)
    return not any(side.all() for side in beside)
