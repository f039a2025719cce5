"""The spec of a format: how a data set is written as files, proved, and read back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Annotated, Any, ClassVar

from pydantic import Field

from viewsphere.model.channel import PICTURES
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import SpecWithOptions
from viewsphere.validation.specs import Takes

Remark = tuple[int | None, str]
"""A fault of an export: the number of its frame in the plan (None: of the whole export), and the error."""


class FormatSpec(SpecWithOptions):
    """Functions that write data sets in one format, and facts about the format.

    Most formats are trees of files (`viewsphere.formats.shared.writing.tree`), whose functions follow from a class. Functions
    take the format's options, if it has any, as their last value.
    """

    KIND: ClassVar[Kind] = "formats"

    about: str | None = Field(description="documentation, whose first sentence lists show: usually `__doc__`")
    holds: tuple[str, ...] = Field(default=(), description="the contents of an export: a few words each")
    read_by: tuple[str, ...] = Field(default=(), description="programs that read the format")
    channels: tuple[str, ...] | None = Field(
        default=None,
        description="names of all labels and passes that it reads, besides pictures that happen to be there; None: all that "
        "are kept. A run that does not keep one of them is refused before it begins; an export computes those that are labels",
    )
    pictures: tuple[str, ...] = Field(
        default=PICTURES,
        description="kinds of picture that it holds: `rgb` and `rgba` have eight bits, `rgb16` sixteen, `rgb_linear` is light. "
        "A format that needs `rgb` refuses a data set whose picture is of another kind",
    )
    needs: Annotated[Callable[..., Sequence[str]] | None, Takes(0)] = Field(
        default=None, description="names of further labels and passes that its options require"
    )
    lidar: bool = Field(default=False, description="whether frames of a LiDAR may lack the channels")
    panoramas: bool = Field(
        default=False, description="whether it holds pictures of lenses without z-depth, such as panoramas; others are refused"
    )
    holds_seam: bool = Field(
        default=False,
        description="whether boxes may reach across the seam of a full turn; False: samples have such an object as two, with "
        "one id and `seam_piece` 1 and 2 in `extra`",
    )
    parallel_rays: bool = Field(
        default=False,
        description="whether it holds pictures whose rays are parallel: it stores no cameras, or also the kind of lens",
    )
    rolling: bool = Field(
        default=False,
        description="whether it holds pictures of rolling shutters: it stores no poses of cameras, or also the readout",
    )
    refuses: Annotated[Callable[..., Iterator[str]] | None, Takes(1)] = Field(
        default=None,
        description="the parts of a `viewsphere.formats.Scope` that the format cannot hold, as `expected ...; found ...`",
    )
    check: Callable[[], None] | None = Field(
        default=None, description="raises a UserError where the format cannot be written on this machine"
    )
    keeps_all_objects: bool = Field(
        default=False, description="whether samples have all objects, also those that the recipe leaves out of annotations"
    )
    names_credits: bool = Field(
        default=True,
        description="whether it names the models' credits; False: it is not written again where only credits change",
    )
    writer: Annotated[Callable[..., AbstractContextManager[Callable[[Any], None]]] | None, Takes(3)] = Field(
        default=None,
        description="`writer(dataset, folder, note)`: a context manager that writes an export into an empty folder. Entering "
        "it returns a function that takes the finished samples, or what `preparer` makes of them, one after another in frame "
        "order; leaving it finishes the export. `note` takes lines for the user. Without, the format is only read",
    )
    preparer: Annotated[Callable[..., Callable[[Any], Any]] | None, Takes(2)] = Field(
        default=None,
        description="`preparer(dataset, folder)`: a function that writes a sample's own files and returns the writer's part of "
        "it, something that pickle takes. Several processes call it, once for each sample, in any order",
    )
    verify: Annotated[Callable[..., Iterator[Remark]] | None, Takes(3)] = Field(
        default=None,
        description="`verify(dataset, folder, sampled)`: every fault of an export, as pairs of a frame's number (None: no "
        "single frame) and a message. `sampled` are positions of the frames for costly proofs",
    )
    notes: Annotated[Callable[..., Iterator[str]] | None, Takes(1)] = Field(
        default=None, description="`notes(categories)`: lines for the user about the options and a data set's categories"
    )
    read: Callable[..., Any] | None = Field(
        default=None,
        description="`read(path, *, keep_going)`: a data set of this format as a `viewsphere.store.foreign.ForeignDataset`, "
        "for `viewsphere import`",
    )
    as_recipe: Callable[[Any], Any] | None = Field(
        default=None,
        description="`as_recipe(path)`: the cameras and models of a data set, a "
        "`viewsphere.store.source_cameras.SourceCameras`, for `viewsphere new --from`",
    )
