"""The spec of a reader: how model files become meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from viewsphere.errors import PluginError
from viewsphere.model.model_spec import Axis
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec

MeshAndFacts = tuple[Any, Any]
"""A `viewsphere.assets.mesh.Mesh` in the file's axes and unit, and `viewsphere.assets.primitive.FileFacts`;
`viewsphere.assets.primitive.assemble` makes both.
"""


class ReaderSpec(Spec):
    """Functions that read model files of some suffixes. They run in a process of its own, which has limits of time and memory.
    They open files only through the folder that they receive (`viewsphere.assets.paths.folder.ModelFolder`).
    """

    KIND: ClassVar[Kind] = "readers"

    about: str = Field(min_length=1, description="the kinds of files, for documentation and messages")
    suffixes: tuple[str, ...] = Field(
        min_length=1, description="suffixes of its files, in lower case and without dots; of two readers for a suffix, one "
        "that comes with viewsphere is used, and rather one without Blender"
    )  # fmt: skip
    read: Callable[[Any], MeshAndFacts] = Field(
        description="`read(folder)`: the model of the file `folder.model` at rest. Raises ModelError, made by `folder.error`"
    )
    axes: tuple[Axis, Axis] | None = Field(
        default=None, description="the axes that are up and front; None: the file states them"
    )
    assumes_up: bool = Field(default=False, description="whether the format states no axes, so that files may differ")
    unit: str = Field(default="from the file", description="the unit of lengths, for documentation")
    frames: Callable[[Any, Sequence[int]], Iterator[MeshAndFacts]] | None = Field(
        default=None,
        description="`frames(folder, frames)`: the model at the first frame of the animation `folder.clip`, then at each of "
        "the ascending `frames`, `folder.fps` of which make a second. Without, its models do not move",
    )
    timeline: Callable[[Any], Mapping[str, Any]] | None = Field(
        default=None,
        description="`timeline(folder)`: plain data with the `first` and `last` frame of the animation, `fps`, whether it "
        "`moves`, and `clips`, each with `name`, `first` and `last`. A reader with `frames` needs it, except with `by_blender`",
    )
    by_blender: bool = Field(default=False, description="whether Blender reads the files: patterns must then end in the suffix")
    joins_files: bool = Field(
        default=False, description="whether a file joins the models of others: folders leave it out, patterns end in the suffix"
    )
    is_picture: bool = Field(default=False, description="whether files are pictures, which folders and patterns leave out")
    packages: tuple[str, ...] = Field(default=(), description="optional packages that it imports")
    install: str = Field(default="", description="the name that pip installs for these packages, such as `viewsphere[usd]`")
    reserves_memory: bool = Field(
        default=False, description="whether it reserves much more memory than it writes to, and works on all cores; the "
        "process then limits memory that is written to"
    )  # fmt: skip
    modules: tuple[str, ...] = Field(
        default=(), description="modules that are imported once, before the process forks for each file"
    )
    first_bytes: Mapping[bytes, tuple[str, ...]] = Field(
        default={}, description="suffixes by the first bytes of such files, the usual one first, for messages about wrong names"
    )
    archives: Mapping[str, str] = Field(
        default={}, description="suffixes of files that are archives, and their kind: `ZIP` or `gzip`"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.frames is not None and self.timeline is None and not self.by_blender:
            raise PluginError("ReaderSpec.timeline: expected a function, which `frames` needs; found none")
        wrong = next((one for one in self.suffixes if one != one.lower() or one.startswith(".")), None)
        if wrong is not None:
            raise PluginError(f"ReaderSpec.suffixes: expected lower case without dots; found {wrong!r}")
        return self
