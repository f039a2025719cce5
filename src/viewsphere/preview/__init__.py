"""Pictures for people: a contact sheet of a recipe or a data set, films of sequences, a model from four sides."""

from viewsphere.preview.frame import INK, PAPER, draw_sample
from viewsphere.preview.shown import dataset_samples, preview_samples
from viewsphere.preview.sides import four_sides
from viewsphere.preview.smallness import small_objects
from viewsphere.preview.tiles import contact_sheet
from viewsphere.preview.video import Video, write_video
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
    "preview_samples",
    "small_objects",
    "write_video",
]
