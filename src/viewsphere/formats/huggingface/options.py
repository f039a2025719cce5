"""What recipes and the command line may say of the format."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.frozen import Frozen


class Options(Frozen):
    """Where files end."""

    samples_per_shard: int = Field(default=1000, ge=1, description="most samples of a file")
