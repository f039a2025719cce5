"""The options of the format in recipes and on the command line."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.fields.frozen import Frozen


class Options(Frozen):
    """The size of files."""

    samples_per_shard: int = Field(default=1000, ge=1, description="most samples of a file")
