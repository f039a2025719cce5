"""The weights of joints on each point of a body in its bind pose."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere_zoo.people import flesh
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.skeleton import JOINTS, Skeleton
from viewsphere_zoo.shapes.solids import Float

MOST = 4
"""Number of joints of a vertex, as many as fit into one attribute of a glTF primitive."""

HEAD, SHOES = ("head", "hair", "eyes"), ("shoes",)


def weights(b: Build, s: Skeleton, points: Float, parts: NDArray[np.str_], is_skirt: bool) -> tuple[NDArray[np.int64], Float]:
    """Joints (N, 4) of points (N, 3) of these parts (N,) and their weights (N, 4), which sum to 1, the largest first. A skirt
    hangs between the legs.
    """
    w = np.zeros((len(points), len(JOINTS)))
    left = np.where(points[:, :1] < 0, points * (-1, 1, 1), points)
    arm, leg = _arm_share(b, s, left), _leg_share(b, s, left)
    firm = np.isin(parts, HEAD)
    arm[firm | np.isin(parts, ("shoes", "legs", "bottom"))] = 0
    leg[firm | np.isin(parts, ("arms", "top")) & (left[:, 2] > s["Spine1"][2])] = 0
    leg[np.isin(parts, ("shoes", "legs"))] = 1
    # A hem follows the thighs only in part, and the legs under it no further.
    under = np.where(parts == "top", 1.0, (parts == "bottom") * _ramp(points[:, 2] - 0.500 * b.height, 0.03 * b.height))
    leg *= 1 - 0.4 * under
    arm[parts == "arms"] = 1
    crotch = np.clip((points[:, 2] - 0.45 * b.height) / (0.04 * b.height), 0.04, 1)
    hanging = np.isin(parts, ("bottom",)) & is_skirt
    side = _ramp(points[:, 0], np.where(hanging, 0.045, 0.024 * crotch) * b.height)  # 1 on the left
    free = (1 - arm) * (1 - leg)
    for name, share in _trunk(b, s, points, firm).items():
        w[:, JOINTS.index(name)] += free * share
    for prefix, own in (("L_", side), ("R_", 1 - side)):
        for name, share in _chain(s, left, ("Shoulder", "Elbow", "Wrist", "Hand"), (0.035, 0.020, 0.014), b.height).items():
            w[:, JOINTS.index(prefix + name)] += own * arm * share
        for name, share in _chain(s, left, ("Hip", "Knee", "Ankle", "Foot"), (0.055, 0.022, 0.016), b.height).items():
            w[:, JOINTS.index(prefix + name)] += own * (1 - arm) * leg * share
        collar = w[:, JOINTS.index("Spine3")] * own * _collar(b, s, left)
        w[:, JOINTS.index(prefix + "Collar")] += collar
    w[:, JOINTS.index("Spine3")] -= w[:, JOINTS.index("L_Collar")] + w[:, JOINTS.index("R_Collar")]
    return strongest_four(w)


def strongest_four(w: Float) -> tuple[NDArray[np.int64], Float]:
    """The four largest of weights (N, 24): joints and weights (N, 4), which sum to 1."""
    order = np.argsort(-w, axis=1, kind="stable")[:, :MOST]
    best = np.maximum(np.take_along_axis(w, order, axis=1), 0)
    best[best < 1e-3] = 0
    return np.where(best > 0, order, 0), best / best.sum(axis=1, keepdims=True)


def _ramp(x: Float, width: float | Float) -> Float:
    """A smooth ramp from 0 at -width to 1 at width."""
    t = np.clip(x / width * 0.5 + 0.5, 0, 1)
    return t * t * (3 - 2 * t)


def _arm_share(b: Build, s: Skeleton, p: Float) -> Float:
    """1 on the arm, 0 on the trunk: from the nearer flesh, and the distance outwards."""
    nearer = flesh.torso(b, s)(p) - flesh.arm(b, s)(p)
    out = ((p - s["L_Shoulder"]) * (s["L_Elbow"] - s["L_Shoulder"])).sum(axis=1) / (0.166 * b.height)
    return _ramp(nearer - 0.004 * b.height, 0.028 * b.height) * _ramp(out - 0.012 * b.height, 0.045 * b.height)


def _leg_share(b: Build, s: Skeleton, p: Float) -> Float:
    """1 below the crease of the hip, which rises outwards and backwards."""
    hip = s["L_Hip"]
    crease = hip[2] + 0.55 * np.maximum(p[:, 0] - hip[0], -0.5 * hip[0]) - 0.30 * (p[:, 1] - hip[1])
    return _ramp(crease - 0.004 * b.height - p[:, 2], 0.042 * b.height)


def _collar(b: Build, s: Skeleton, p: Float) -> Float:
    out = p[:, 0] - 0.62 * s["L_Shoulder"][0]
    return _ramp(out, 0.035 * b.height) * _ramp(p[:, 2] - s["Spine3"][2] - 0.03 * b.height, 0.03 * b.height)


def _trunk(b: Build, s: Skeleton, p: Float, firm: NDArray[np.bool_]) -> dict[str, Float]:
    """Shares of the joints from the pelvis to the head, by height."""
    names = ("Pelvis", "Spine1", "Spine2", "Spine3", "Neck", "Head")
    tilt = p[:, 2] + 0.25 * (p[:, 1] - s["Head"][1]) * (p[:, 2] > s["Neck"][2])
    heights = [s[name][2] for name in names[1:]]
    bands = (0.045, 0.040, 0.035, 0.024, 0.018)
    above = [_ramp(tilt - z, w * b.height) for z, w in zip(heights, bands, strict=True)]
    shares = [1 - above[0], *(a * (1 - c) for a, c in pairwise(above)), above[-1]]
    whole = np.zeros(len(p))
    head = firm & (p[:, 2] > s["Head"][2])
    for share in shares:
        whole += share
    return {name: np.where(head, float(name == "Head"), share / whole) for name, share in zip(names, shares, strict=True)}


def _chain(s: Skeleton, p: Float, names: tuple[str, ...], bands: tuple[float, ...], height: float) -> dict[str, Float]:
    """Shares of the joints of a limb, blended where the limb bends."""
    places = [s[f"L_{name}"] for name in names]
    beyond = list[Float]()
    for k, band in enumerate(bands, 1):
        before, after = places[k] - places[k - 1], places[min(k + 1, len(places) - 1)] - places[k]
        if k == len(places) - 1:
            after = before
        across = _unit(before) + _unit(after)
        beyond.append(_ramp(((p - places[k]) * _unit(across)).sum(axis=1), band * height))
    shares, rest = dict[str, Float](), np.ones(len(p))
    for name, share in zip(names, [*beyond, np.zeros(len(p))], strict=True):
        shares[name] = rest * (1 - share)
        rest = rest * share
    return shares


def _unit(v: Float) -> Float:
    return v / np.sqrt((v * v).sum())
