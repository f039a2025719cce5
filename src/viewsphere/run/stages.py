"""From a shot to its samples: load the models, keep the stage warm, render frame by frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from viewsphere import plugins
from viewsphere.annotate import annotate
from viewsphere.assets.cache import load_normalised
from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.box import box_size, box_vertices
from viewsphere.geometry.rotation import transform
from viewsphere.model.recipe import Recipe
from viewsphere.model.sample import Float, Sample
from viewsphere.model.shot import Frame, ModelSpec, Shot, Size
from viewsphere.sampling.plan import Plan, check_images, plan
from viewsphere.sampling.viewpoints import camera_for
from viewsphere.truth.channels import observe
from viewsphere.truth.visibility import rasterize
from viewsphere.zoo import build

WARM_MODELS = 8


def build_zoo_model(spec: ModelSpec) -> Mesh:
    """The procedural model a `zoo:family` source names, drawn from its seed."""
    return build(spec.source.removeprefix("zoo:"), np.random.default_rng(spec.seed))


def prepare(recipe: Recipe) -> Plan:
    """The recipe's plan, once everything is checked that can be before a model is read.

    Raises UserError for the user's mistakes: files, names, counts, engine options, background images.
    """
    planned = plan(recipe)
    engine: plugins.Engine = plugins.load("engines", recipe.engine.name)
    with recipe.located():
        engine.check(recipe.engine.options)
    check_images(planned)
    return planned


def model_files(key: str) -> tuple[str, str]:
    """Paths of a model's OBJ and GLB in a data set, relative to its root."""
    return f"store/models/{key}/{key}.obj", f"store/models/{key}/{key}.glb"


@dataclass(eq=False)
class Stages:
    """Renders shots; keeps the last shot's stage and the last few models warm."""

    _stage: plugins.Stage | None = None
    _stage_key: str = ""
    _models: dict[str, Mesh] = field(default_factory=dict[str, Mesh])
    _sizes: dict[str, Size] = field(default_factory=dict[str, Size])

    def model(self, spec: ModelSpec) -> Mesh:
        """The normalised model; raises ModelError if its file cannot be used."""
        name = spec.model_dump_json()
        if name not in self._models:
            self._models[name] = load_normalised(spec, build_zoo_model)
            while len(self._models) > WARM_MODELS:
                del self._models[next(iter(self._models))]
        return self._models[name]

    def real_size(self, spec: ModelSpec) -> Size | None:
        """The model's true (width, height, length) in metres, None if nobody said."""
        if spec.real_size != "file":
            return spec.real_size
        name = spec.model_dump_json()
        if name not in self._sizes:
            unscaled = self.model(spec.model_copy(update={"scale": "as_is"}))
            self._sizes[name] = box_size(box_vertices(*unscaled.bounds))
        return self._sizes[name]

    def check_distances(self, planned: Plan, spec: ModelSpec) -> None:
        """Raise RecipeError if a pose's camera would stand inside this model."""
        problem = planned.distance_problem(spec, box_vertices(*self.model(spec).bounds))
        with planned.recipe.located():
            if problem:
                raise problem

    def stage(self, shot: Shot) -> plugins.Stage:
        """The engine's stage for this shot, built anew only when the scene is another one."""
        if self._stage is None or self._stage_key != shot.stage_key:
            engine: plugins.Engine = plugins.load("engines", shot.engine)
            self._stage = engine.stage(shot, self.model)
            self._stage_key = shot.stage_key
        return self._stage

    def render(self, shot: Shot) -> Iterator[Sample]:
        """The shot's samples in order, channels in memory."""
        stage = self.stage(shot)
        boxes = [box_vertices(*self.model(p.model).bounds) for p in shot.placements]
        sizes = [self.real_size(p.model) for p in shot.placements]
        for frame in shot.frames:
            yield render_frame(shot, frame, stage, boxes, sizes)


def render_frame(
    shot: Shot, frame: Frame, stage: plugins.Stage, boxes: Sequence[Float], sizes: Sequence[Size | None]
) -> Sample:
    """One frame: colour from the engine, every label from truth.

    `boxes` and `sizes`: each object's 3D box in its own axes, and its real size if known.
    """
    camera = camera_for(shot.intrinsics, frame.pose, _target(shot, boxes))
    visibility = rasterize(stage.geometry, camera)
    names = [name for name in shot.channels if name != "rgb"]
    observed = observe(stage.geometry, camera, visibility, names)
    if "rgb" in shot.channels:
        observed["rgb"] = stage.color(camera, frame, visibility)
    files = [model_files(p.model.key)[0] for p in shot.placements]
    objects = annotate(shot, frame, camera, stage.geometry, visibility, boxes, files, sizes)
    channels = {name: observed[name] for name in shot.channels}
    return Sample(frame.index, frame.split, camera, frame.pose, objects, channels, {})


def _target(shot: Shot, boxes: Sequence[Float]) -> Float:
    """Box centre of object 1 in the world: what a pose without a target of its own looks at."""
    return transform(shot.placements[0].world_from_object, boxes[0].mean(axis=0))
