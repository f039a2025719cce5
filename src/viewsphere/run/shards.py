"""The shard of the frames that this process renders: for a job array's task, a rank, or a data loader's worker.

PyTorch is used only if the program has already imported it, because it is not a dependency.
"""

from __future__ import annotations

import re

from viewsphere.errors import UserError
from viewsphere.model.shard import Shard
from viewsphere.validation.errors import shown


def shard_of(shard: object) -> Shard:
    """The shard that the argument `shard` names; raises UserError for anything but (k, n) with 0 <= k < n."""
    match shard:
        case (int(number), int(of)) if 0 <= number < of:
            return Shard(number, of)
        case _:
            raise UserError(
                f"shard: expected (k, n), the k-th of n shards counted from 0, such as (0, 4); found {shown(shard)}"
            )


def shard_named(text: str) -> tuple[int, int]:
    """The shard given on the command line as k/n, k from 0; raises UserError for anything else."""
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if found is None or int(found[1]) >= int(found[2]):
        raise UserError(f"--shard: expected k/n, the k-th of n shards counted from 0, such as 0/16; found {shown(text)}")
    return int(found[1]), int(found[2])
