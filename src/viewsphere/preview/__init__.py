"""Pictures for people: a contact sheet of a recipe or a data set, films of sequences, a model from four sides."""

from collections.abc import Iterable, Iterator

from viewsphere.model.sample import Sample
from viewsphere.planning.checks.warnings import SMALLEST, TOO_SMALL
from viewsphere.preview.frame import INK, PAPER, draw_sample
from viewsphere.preview.shown import dataset_samples, preview_samples
from viewsphere.preview.sides import four_sides, one_view_each
from viewsphere.preview.tiles import contact_sheet
from viewsphere.preview.video import Video, write_video
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.reports.rig_view import recipe_rig
from viewsphere.store.samples.films import Earlier, Film, films_of

__all__ = [
    "INK",
    "PAPER",
    "Earlier",
    "Film",
    "Video",
    "contact_sheet",
    "dataset_samples",
    "draw_sample",
    "films_of",
    "four_sides",
    "one_view_each",
    "preview_samples",
    "small_objects",
    "write_video",
]


def small_objects(samples: Iterable[Sample], recipe: Recipe | None = None) -> Iterator[str]:
    """A warning that counts visible objects whose boxes are less than `SMALLEST` pixels wide and high. For a preview of a
    recipe, sizes are in pixels of the recipe's pictures.
    """
    widths = {} if recipe is None else {sensor.name: sensor.intrinsics.width for sensor in recipe_rig(recipe).sensors}
    shown: list[float] = []
    for sample in samples:
        scale = widths.get(sample.sensor, sample.width) / sample.width
        boxes = (o.box2d_unclipped for o in sample.objects if o.area)
        shown += (scale * max(box[2] - box[0], box[3] - box[1]) for box in boxes if box is not None)
    small = [size for size in shown if size < SMALLEST]
    if small:
        yield (
            f"{len(small):,} of {len(shown):,} objects shown are at most {max(small):.2g} pixels wide and high, {TOO_SMALL}: "
            "come nearer, or ask for larger pictures, a longer lens or distance: {fill: ...}"
        )
