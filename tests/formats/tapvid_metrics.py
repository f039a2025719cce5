"""The evaluation of TAP-Vid and TAPVid-3D, written from the papers: queries, and the shares of what is right.

Doersch et al. 2022, section 3 and appendix; Koppula et al. 2024, section 4. None of it is tapnet's code.
"""

from __future__ import annotations

import numpy as np

PIXELS = (1, 2, 4, 8, 16)


def queries_first(occluded):
    """Of each point that is ever seen its number and the first picture that shows it."""
    seen = np.flatnonzero(~occluded.all(axis=1))
    return [(n, int(np.argmin(occluded[n]))) for n in seen]


def queries_strided(occluded, stride=5):
    """At every fifth picture all points that it shows."""
    return [(n, t) for t in range(0, occluded.shape[1], stride) for n in np.flatnonzero(~occluded[:, t])]


def evaluated(queries, frames, mode):
    """Which pictures count for each query, (Q, T): those after it, or all others."""
    at, picture = np.array([t for _, t in queries])[:, None], np.arange(frames)
    return picture > at if mode == "first" else picture != at


def scores(truth, seen, found, said, counts, most):
    """Average Jaccard, average share of points within the thresholds, and accuracy of occlusion.

    truth, found: (Q, T, 2 or 3); seen, said: what is visible, and what the tracker says so, (Q, T); counts: which are judged;
    most: for each threshold the largest distance, a number or (Q, T).
    """
    distance = np.linalg.norm(found - truth, axis=-1)
    within, jaccard = [], []
    for limit in most:
        near = distance < limit
        within.append((near & seen & counts).sum() / (seen & counts).sum())
        right = (near & seen & said & counts).sum()
        wrong = (said & ~(near & seen) & counts).sum()
        missed = (seen & ~(near & said) & counts).sum()
        jaccard.append(right / (right + wrong + missed))
    return {
        "average_jaccard": np.mean(jaccard),
        "average_pts_within_thresh": np.mean(within),
        "occlusion_accuracy": ((seen == said) & counts).sum() / counts.sum(),
    }
