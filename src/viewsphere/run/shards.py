"""The shard of the frames that this process renders: for a job array's task, a rank, or a data loader's worker.

PyTorch is used only if the program has already imported it, because it is not a dependency.
"""

from __future__ import annotations

import re
import sys
from typing import Any

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


def shard_of_rank() -> Shard:
    """The shard of this process among the ranks of PyTorch's default process group; all frames without a group."""
    distributed: Any = sys.modules.get("torch.distributed")
    if distributed is None or not distributed.is_available() or not distributed.is_initialized():
        return Shard()
    return Shard(distributed.get_rank(), distributed.get_world_size())


def shard_of_worker(frames: object) -> Shard:
    """The shard of this process among the workers of a PyTorch DataLoader that iterates over its data set. It is all frames
    outside such a worker, or if the loader itself chooses the items of each worker.

    `frames` may be the loader's data set itself.
    """
    data: Any = sys.modules.get("torch.utils.data")
    if data is None:
        return Shard()
    info = data.get_worker_info()
    if info is None or not (info.dataset is frames or isinstance(info.dataset, data.IterableDataset)):
        return Shard()
    return Shard(info.id, info.num_workers)


def register_for_loaders(kind: type) -> None:
    """Register a class as an iterable data set of PyTorch's DataLoader."""
    data: Any = sys.modules.get("torch.utils.data")
    if data is not None:
        data.IterableDataset.register(kind)
