"""MOTChallenge's sequences, as in MOT17 and MOT20: boxes of tracked objects, for trackers and their metrics.

    <split>/<sequence>/seqinfo.ini          name, imDir, frameRate, seqLength, imWidth, imHeight, imExt
    <split>/<sequence>/img1/000001.png      the pictures, numbered from 1
    <split>/<sequence>/gt/gt.txt            a line for each object and frame: frame, id, left, top, width, height, conf,
                                            class, visibility
    <split>/<sequence>/gt/labels.txt        class names, one a line; an addition that datumaro reads

Each sensor is a sequence; the folder of a sensor that is not named `camera` is `<sequence>-<sensor>`. Frames and ids count from
1, and an object keeps its id over the sequence. Its class is its category's number, from 1. MOTChallenge's own classes differ
(1 is a pedestrian), so switch off TrackEval's `DO_PREPROC`. Boxes are 1-based pixels: the picture's upper left corner is (1,
1). conf is 1: every line counts. Visibility is the visible share of the object's pixels, including pixels outside the picture.

Objects whose box has no visible pixel have no line. seqLength is the length of the whole sequence, even if you export some of
its frames. A fractional frame rate is written as a fraction; MOTChallenge has none, and datumaro does not read it. There are no
detections (`det`) and no cameras. Sources: Milan et al. 2016, "MOT16: A Benchmark for Multi-Object Tracking", arXiv:1603.00831;
TrackEval's readme of MOTChallenge, https://github.com/JonathonLuiten/TrackEval.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.refusals import plain_names, sequences
from viewsphere.formats.shared.writing.tree import LINES, File, Layout, Piece, Tree, functions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.store import Dataset

KINDS = (".png", ".jpg")


class _Options(Frozen):
    """The extent of boxes."""

    boxes: Literal["visible", "whole"] = Field(
        default="visible",
        description="`visible`: an object's visible pixels; `whole`: the whole object as far as the picture reaches, hidden "
        "ones too, as MOTChallenge's annotators guess it",
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Yield the refused samples: still pictures, and names longer than a line."""
    yield from sequences(scope)
    yield from plain_names(scope, r"\S([^\r\n]*\S)?", "of one line, without spaces at its ends")


class _Mot(Tree):
    """The tree of these boxes."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._field = {"visible": "box2d", "whole": "box2d_projected"}[options.boxes]
        self._labels = "".join(f"{category.name}\n" for category in dataset.categories)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its lines, and the description of its sequence."""
        name = sample.sequence if sample.sensor == CAMERA else f"{sample.sequence}-{sample.sensor}"
        folder, suffix = f"{sample.split or 'all'}/{name}", suffix_of(sample, *KINDS)
        yield File(f"{folder}/img1/{sample.instant + 1:06d}{suffix}", picture(sample, *KINDS))
        yield Piece(f"{folder}/gt/gt.txt", "".join(self._rows(sample)).encode())
        yield Piece(f"{folder}/gt/labels.txt", b"")
        yield Piece(f"{folder}/seqinfo.ini", b"", self._info(sample, name, suffix))

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """Return the parts of a file. The common text of a sequence's frames is the name of their section, and is written
        once.
        """
        if path.endswith("seqinfo.ini"):
            return (next(iter(counts)).encode(),)
        return (self._labels.encode(),) if path.endswith("labels.txt") else LINES

    def _info(self, sample: Sample, name: str, suffix: str) -> str:
        plan = self.dataset.plan
        said = plan.parts[plan.part_of(sample.index)].recipe.get("time") if plan.parts else None
        if not sample.sequence or said is None:
            raise UserError(f"mot: expected sequences only; found the still picture of frame {sample.index}")
        time = TimeEntry.model_validate(said)
        return (
            f"[Sequence]\nname={name}\nimDir=img1\nframeRate={time.fps:.10g}\nseqLength={time.count}\n"
            f"imWidth={sample.width}\nimHeight={sample.height}\nimExt={suffix}\n"
        )

    def _rows(self, sample: Sample) -> Iterator[str]:
        for o in sample.objects:
            box = getattr(o, self._field)
            if box is not None:
                yield ",".join(map(str, _columns(sample, o, *box))) + "\n"


def _columns(sample: Sample, o: ObjectAnnotation, x0: float, y0: float, x1: float, y1: float) -> tuple[int | str, ...]:
    """A line's values for a box (half-open corners) with origin 0."""
    box = (f"{value:.10g}" for value in (x0 + 1, y0 + 1, x1 - x0, y1 - y0))
    return (sample.instant + 1, o.id, *box, 1, o.category_id, f"{o.visibility:.10g}")


preparer, writer, verify = functions(_Mot)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "tracks of objects", "visibility"),
    read_by=("motmetrics", "TrackEval", "datumaro"),
    options=_Options,
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
