"""The choice of a report's frames: the same ones every time, from every model and split, spread over the poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.report.table import FrameTable

GOLDEN = (5**0.5 - 1) / 2


def chosen_frames(table: FrameTable, count: int) -> list[int]:
    """Positions of at most `count` frames, ascending.

    Frames of one subject (model, or category where there is none) and split make a group. If there are at most `count` groups,
    each gives at least one frame, and more in proportion to its size; of more groups, `count` spread evenly give one each.
    Within a group the picks are stratified, at a place in the stratum that the golden ratio moves on, so that the picks do not
    fall into step with the poses.
    """
    total = len(table.frames)
    if count >= total:
        return list(range(total))
    groups = _groups(table)
    if len(groups) > count:
        groups = [groups[i] for i in np.linspace(0, len(groups) - 1, count).round().astype(int)]
        shares = [1] * count
    else:
        shares = _shares([len(g) for g in groups], count)
    picks: list[int] = []
    for number, (group, share) in enumerate(zip(groups, shares, strict=True)):
        turns = (np.arange(share) + number + 1) * GOLDEN % 1
        places = ((np.arange(share) + turns) * len(group) / share).astype(int)
        picks += group[places].tolist()
    return sorted(picks)


def _groups(table: FrameTable) -> list[NDArray[np.intp]]:
    """Positions of the frames of each subject and split, in order of appearance."""
    code = table.frames["subject"].astype(np.int64) * max(1, len(table.splits)) + table.frames["split"]
    order = np.argsort(code, kind="stable")
    starts = np.flatnonzero(np.diff(code[order], prepend=-1))
    return sorted(np.split(order, starts[1:]), key=lambda group: int(group[0]))


def _shares(sizes: list[int], count: int) -> list[int]:
    """Whole shares of `count` in proportion to the sizes: at least 1, at most the size, by largest remainder."""
    shares = np.ones(len(sizes), int)
    room = np.array(sizes) - 1
    left = count - len(sizes)
    exact = room * left / max(1, room.sum())
    shares += exact.astype(int)
    remainders = np.argsort(-(exact - exact.astype(int)), kind="stable")
    shares[remainders[: count - int(shares.sum())]] += 1
    return shares.tolist()
