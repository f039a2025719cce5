"""Warnings and notes about a finished run: random values that missed the recipe's targets, and changes of materials without
effect.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import islice

from viewsphere.assets.exporting.glb import material_names
from viewsphere.composing.redraws import fewer, redraws_frames
from viewsphere.limits import limits
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.planning.extension import DatasetPart
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import model_files
from viewsphere.store import Dataset, Store

MOST_NAMES = 8
"""Maximum number of materials in a warning."""

MOST_READ = 5_000
"""Number of frames whose records are read, in about two seconds, if the recipe sets neither `wanted` nor `min_visibility`."""


def left_by_chance(dataset: Dataset, portion: DatasetPart) -> Iterator[str]:
    """Lines about frames of a run that miss the recipe's targets, and about scenes that lost objects.

    For a large run whose recipe sets no targets, an even selection of shots is read.
    """
    recipe, tally, read = portion.plan.recipe, _Tally(portion), 0
    asks = recipe.wanted is not None or recipe.min_visibility is not None
    step = 1 if asks else max(1, -(-portion.part.frames // MOST_READ))
    own = (one for one in dataset.shots() if portion.find(one[0]) is not None)
    for key, places in islice(own, 0, None, step):
        if shot := dataset.store.labelled(key):
            tally.add(shot, list(dataset.samples_of(key, places)))
        read += len(places)
    yield from tally.lines(read)


@dataclass(eq=False)
class _Tally:
    """Counts frames and scenes as their shots are added."""

    portion: DatasetPart
    hidden: int = 0
    misses: list[float] = field(default_factory=list[float])
    empty: int = 0
    smaller: set[str] = field(default_factory=set[str])

    @property
    def _recipe(self) -> Recipe:
        return self.portion.plan.recipe

    def add(self, shot: Shot, samples: Sequence[Sample]) -> None:
        """Count a shot and its chosen samples."""
        wanted, least = self._recipe.wanted, self._recipe.min_visibility
        ids = {thing.id for thing in shot.targets(self._recipe.scenes is not None)}
        for sample in samples:
            own = [o for o in sample.objects if o.id in ids]
            if own and wanted is not None:
                self.misses.append(wanted.miss(min(o.visibility for o in own), max(o.truncation for o in own)))
            self.hidden += bool(own) and least is not None and min(o.visibility for o in own) < least
        if self._recipe.time is None:
            self.empty += self._empty(samples, len(shot.rig.sensors))
        if shot.redraw and fewer(self._recipe, shot.redraw):
            row = self.portion.find(shot.key)
            if row and len(self.portion.cast(row)) > sum(thing.is_target for thing in shot.things):
                self.smaller.add(row.subject)

    def _empty(self, samples: Sequence[Sample], sensors: int) -> int:
        """Number of pictures at instants with objects that no sensor sees."""
        moments = [samples[i : i + sensors] for i in range(0, len(samples), sensors)]
        there = [sum((sample.objects for sample in moment), ()) for moment in moments]
        return sum(len(m) for m, objects in zip(moments, there, strict=True) if objects and not any(o.area for o in objects))

    def lines(self, frames: int) -> Iterator[str]:
        """The warnings and notes for this number of frames."""
        best = f"the best of {limits.MAX_REDRAWS} draws each"
        missed = sum(miss > 0 for miss in self.misses)
        if missed:
            yield (
                f"warning: wanted: {missed:,} of {frames:,} frames are not as wanted, {best}; the farthest is "
                f"{max(self.misses):.2g} beside: ask for wider shares, or for more that is random"
            )
        if self.hidden:
            yield (
                f"warning: min_visibility: {self.hidden:,} of {frames:,} frames show less than {self._recipe.min_visibility:g} "
                f"of their models, {best}: ask for less, or for less around the models"
            )
        if self.empty:
            shows = "picture shows" if self.empty == 1 else "pictures show"
            drawn = f", the best of {limits.MAX_REDRAWS} draws each" if redraws_frames(self._recipe) else ""
            yield (
                f"warning: viewpoints: {self.empty:,} of {frames:,} {shows} no object{drawn}: look at the objects, "
                "come nearer, or choose another side"
            )
        if self.smaller:
            have = "scene has" if len(self.smaller) == 1 else "scenes have"
            scenes = len(self.portion.plan.varied_subjects)
            yield (
                f"note: scenes.objects: {len(self.smaller):,} of {scenes:,} {have} fewer objects than "
                f"drawn: after {limits.MAX_REDRAWS} draws not all fitted"
            )


def materials_not_found(recipe: Recipe, specs: Sequence[ModelSpec], store: Store) -> dict[str, tuple[str, ...]]:
    """Warnings by the keys of finished models, for each change that applies to the model but matches none of its materials.

    A change for all models (`models: '*'`) needs to match only some of them.
    """
    warnings: defaultdict[str, tuple[str, ...]] = defaultdict(tuple)
    for i, entry in enumerate(recipe.scene.materials):
        meant = [spec.key for spec in specs if fnmatchcase(spec.key, entry.models)]
        if entry.material == "*":
            continue
        files = {key: store.root / model_files(key)[1] for key in meant}
        names = {key: material_names(file) for key, file in files.items() if file.is_file()}
        missed = [key for key in names if not any(fnmatchcase(name, entry.material) for name in names[key])]
        if entry.models == "*" and len(missed) < len(names):
            continue
        for key in missed:
            known = sorted(filter(None, set(names[key])))
            listed = ", ".join(known[:MOST_NAMES]) + (", ..." if len(known) > MOST_NAMES else "")
            such = f"a pattern of its materials' names ({listed})" if known else "names of its materials, which have none,"
            text = f"expected {such}; found {entry.material!r}, which fits none: it changes nothing"
            warnings[key] += (recipe.locate(f"scene.materials[{i}].material: {text}"),)
    return dict(warnings)
