"""The actions of people, as clips: walk, run, stand, sit. Legs follow the feet, so feet on the ground do not slide.

A foot's path over a stride is in the person's own axes, in which the ground moves backwards at a constant speed. The foot
lands on the heel, lies flat, rises on the ball, and moves forward through the air. Hip and knee follow by inverse kinematics.
Durations and angles approximate normal gait (Winter 1991, Biomechanics and Motor Control of Human Gait; Perry and Burnfield
2010, Gait Analysis).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from viewsphere.assets.exporting.rigged import Clip, Pose
from viewsphere.geometry.rotation import product
from viewsphere_zoo.people.skeleton import JOINTS, Skeleton
from viewsphere_zoo.shapes.solids import Float

RATE = 60
"""Keys per second: every frame time at 60, 30, 20, 15, 12 or 10 frames per second has a key."""

SPEEDS = {"walk": 1.25, "run": 3.0}
"""Speeds at which feet do not slide for any person, metres per second."""

FITTED = 24
"""Number of phases of a stride at which legs are checked to reach the ground."""

SEAT = 0.45
"""Height of the chair that people sit on, metres."""


@dataclass(frozen=True)
class Manner:
    """The manner of a person's movement: `swing` of the arms and `lively`, both about 1.
    `stance`: half the distance between the feet, as a share of the distance between the hips; `lean` of the trunk, degrees.
    `phase` 0 to 1: the position of a still pose within the stride.
    """

    swing: float = 1.0
    lively: float = 1.0
    stance: float = 1.15
    lean: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True)
class Gait:
    """A stride: speed in metres per second, duration in seconds, share of it with the foot on the ground. Then the foot's
    pitch at landing and at lift-off, degrees; its lift on the way (share of the leg); the pelvis' drop (share of the leg), and
    its rise and fall, metres. Last the arms' swing to either side, the elbows' bend and the trunk's lean, degrees.
    """

    speed: float
    seconds: float
    contact: float
    heel: float
    push: float
    lift: float
    hang: float
    bob: float
    arms: float
    elbow: float
    lean: float


def gait(name: str, leg: float) -> Gait:
    """A walk or a run for legs of this length, metres; longer legs take longer strides."""
    if name == "walk":
        return Gait(SPEEDS["walk"], _frames(1.03 * (leg / 0.83) ** 0.5), 0.61, 20, 50, 0.115, 0.020, 0.016, 22, 14, 2.0)
    return Gait(SPEEDS["run"], _frames(0.70 * (leg / 0.83) ** 0.5), 0.36, 4, 62, 0.40, 0.050, -0.032, 36, 82, 8.0)


def _frames(seconds: float) -> float:
    """The number of whole frames in a stride, so that its end matches its beginning."""
    return round(seconds * RATE) / RATE


def clips(s: Skeleton, manner: Manner) -> dict[str, Clip]:
    """The clips of a person. Walking and running clips stay on the spot and record their speed."""
    leg = float(s["L_Hip"][2] - s["L_Ankle"][2])
    found = dict[str, Clip]()
    for name in ("walk", "run"):
        stride = gait(name, leg)
        count = round(stride.seconds * RATE)
        poses = _reaching(s, manner, stride, [k / count % 1 for k in range(count + 1)])
        found[name] = Clip(tuple(k / RATE for k in range(count + 1)), poses, {"speed": stride.speed})
    still = range(0, 4 * RATE + 1, 6)
    times = tuple(k / RATE for k in still)
    found["stand"] = Clip(times, tuple(standing(s, manner, k / (4 * RATE) % 1) for k in still), {"speed": 0.0})
    found["sit"] = Clip(times, tuple(sitting(s, manner, k / (4 * RATE) % 1) for k in still), {"speed": 0.0})
    return found


def _reaching(s: Skeleton, manner: Manner, g: Gait, phases: Sequence[float]) -> tuple[Pose, ...]:
    """The poses of a stride, with the pelvis lowered until the legs reach the ground."""
    looked_at = [k / FITTED for k in range(FITTED)]
    while any(striding(s, manner, g, phase)[1] > 0 for phase in looked_at):
        g = replace(g, hang=g.hang + 0.006)
    return tuple(striding(s, manner, g, phase)[0] for phase in phases)


def still(s: Skeleton, manner: Manner, walks: bool) -> Pose:
    """Return the pose of a person without an action: standing, or in the middle of a walk."""
    if not walks:
        return standing(s, manner, manner.phase)
    return _reaching(s, manner, gait("walk", float(s["L_Hip"][2] - s["L_Ankle"][2])), (manner.phase,))[0]


def striding(s: Skeleton, manner: Manner, g: Gait, phase: float) -> tuple[Pose, float]:
    """A pose of a walk or a run at a phase from 0 (the left heel lands) to 1. Also the length that the legs lack for it,
    metres.
    """
    turn = 2 * np.pi * phase
    leg = float(s["L_Hip"][2] - s["L_Ankle"][2])
    body = _Body(s)
    yaw, roll = 5.0 * manner.lively * np.cos(turn), 3.0 * manner.lively * np.sin(turn + 0.5)
    body.turn("Pelvis", z=-yaw, y=roll)
    lean = g.lean + manner.lean
    body.turn("Spine1", x=-0.5 * lean, z=0.5 * yaw, y=-0.6 * roll)
    body.turn("Spine2", x=-0.3 * lean, z=0.8 * yaw, y=-0.4 * roll)
    body.turn("Spine3", z=0.7 * yaw)
    body.turn("Neck", x=0.3 * lean, z=-0.5 * yaw)
    body.turn("Head", x=0.4 * lean, z=-0.5 * yaw)
    side = 0.018 * manner.lively * np.sin(turn + 0.3)
    rise = -g.hang * leg - g.bob * np.cos(2 * turn + 0.2)
    body.root = s["Pelvis"] + (side, -0.012 * (lean / 4), rise)
    for prefix, sign, own in (("L_", 1, phase), ("R_", -1, (phase + 0.5) % 1)):
        foot = _Foot(s, prefix, g, own, manner)
        body.reach(prefix, foot.ankle, foot.pitch, foot.toes)
        swing = -np.cos(2 * np.pi * own - 0.25)
        ahead = manner.swing * g.arms * swing + (6 if g.elbow > 40 else 2)
        bend = g.elbow * (1 + 0.35 * swing * manner.swing) + 8 * max(swing, 0)
        body.arm(prefix, sign, ahead, 5.0, bend, 20 if g.elbow > 40 else 6)
    return body.pose(), body.short


def standing(s: Skeleton, manner: Manner, phase: float) -> Pose:
    """The poses of a person who stands, shifts the weight a little and breathes."""
    turn = 2 * np.pi * phase
    body = _Body(s)
    breath, shift = 0.8 * np.sin(2 * turn), np.sin(turn)
    contra = 4.0 * (manner.lively - 1) + 0.5 * shift
    body.turn("Pelvis", y=contra)
    body.turn("Spine1", y=-0.7 * contra, x=-0.5 * manner.lean)
    body.turn("Spine2", x=breath * 0.5)
    body.turn("Spine3", x=breath * 0.5, y=-0.5 * contra)
    body.turn("Neck", x=-0.6 * breath + 0.3 * manner.lean)
    body.turn("Head", z=14 * (manner.phase - 0.5) + 2 * shift, x=3.0 - 0.3 * breath)
    body.root = s["Pelvis"] + (0.012 * contra / 2, 0.0, -0.012 - 0.004 * abs(contra))
    half = float(s["L_Hip"][0])
    for prefix, sign in (("L_", 1), ("R_", -1)):
        rest = s[f"{prefix}Ankle"]
        ankle = np.array([sign * manner.stance * half, rest[1] - 0.02 * sign * (manner.phase - 0.5), rest[2]])
        body.reach(prefix, ankle, 0.0, 0.0, out=sign * 7)
        body.arm(prefix, sign, 2.0 + 3 * (manner.swing - 1) * sign, 8.0, 16.0 * manner.swing, 4)
    return body.pose()


def sitting(s: Skeleton, manner: Manner, phase: float) -> Pose:
    """The poses of a person who sits on a chair of height `SEAT`: thighs level, shanks upright, hands on the thighs."""
    turn = 2 * np.pi * phase
    body = _Body(s)
    breath = 0.8 * np.sin(2 * turn)
    thick = 0.047 * float(s["Head"][2]) / 0.89
    thigh = float(s["L_Hip"][2] - s["L_Knee"][2])
    knee = float(s["L_Knee"][2])
    hip = max(SEAT + thick + 0.022, 0.0)
    lift = float(s["Pelvis"][2] - s["L_Hip"][2])
    body.turn("Pelvis", x=6.0)
    body.turn("Spine1", x=-4.0)
    body.turn("Spine2", x=-4.0 + breath)
    body.turn("Neck", x=2.0)
    body.turn("Head", x=4.0, z=16 * (manner.phase - 0.5) + 3 * np.sin(turn))
    body.root = np.array([0.0, 0.0, hip + lift])
    half = float(s["L_Hip"][0])
    for prefix, sign in (("L_", 1), ("R_", -1)):
        rest = s[f"{prefix}Ankle"]
        reach = np.sqrt(max(thigh**2 - (hip - knee) ** 2, 0.5 * thigh**2))
        forward = -reach - 0.03 + 0.05 * sign * (manner.phase - 0.5)
        ankle = np.array([sign * half * (manner.stance + 0.35), forward, rest[2]])
        body.reach(prefix, ankle, 0.0, 0.0, out=sign * 6)
        body.arm(prefix, sign, 20.0, 6.0, 62.0, 24.0)
    return body.pose()


@dataclass(frozen=True)
class _Foot:
    """The foot at a phase of its own stride, which begins at landing."""

    s: Skeleton
    prefix: str
    g: Gait
    phase: float
    manner: Manner

    @property
    def pitch(self) -> float:
        """Pitch of the foot, degrees, positive with the toes higher than the heel."""
        g, p, c = self.g, self.phase, self.g.contact
        flat, rise = 0.20 * c, 0.52 * c
        if p < c:
            down = _ease(1 - p / flat) if p < flat else 0.0
            up = _ease((p - rise) / (c - rise)) if p > rise else 0.0
            return g.heel * down - g.push * up
        t = (p - c) / (1 - c)
        knots = (-g.push, -1.05 * g.push, -0.55 * g.push, 0.1 * g.heel, 1.1 * g.heel, g.heel)
        return float(np.interp(t, (0, 0.12, 0.42, 0.72, 0.92, 1), knots))

    @property
    def toes(self) -> float:
        """Upward bend of the toes against the foot, degrees: they stay on the ground as long as the ball does."""
        p, c = self.phase, self.g.contact
        if p < c:
            return max(-self.pitch, 0.0)
        return max(-self.pitch, 0.0) * _ease(1 - (p - c) / (0.25 * (1 - c))) if p < c + 0.25 * (1 - c) else 0.0

    @property
    def ankle(self) -> Float:
        """The position of the ankle (3,).
        While the foot is down, the ankle turns about its heel or its ball, which stay on the ground.
        """
        p, c = self.phase, self.g.contact
        if p < c:
            return self._down(p, self.pitch)
        start, end, t = self._down(c, -self.g.push), self._down(0.0, self.g.heel), (p - c) / (1 - c)
        # A cubic in y that leaves and meets the ground at the ground's speed, and a lift that is lowest at both ends.
        slope = self.g.speed * self.g.seconds * (1 - c)
        h00, h10, h01, h11 = 2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, 3 * t**2 - 2 * t**3, t**3 - t**2
        y = h00 * start[1] + h10 * slope + h01 * end[1] + h11 * slope
        leg = float(self.s["L_Hip"][2] - self.s["L_Ankle"][2])
        bump = 27 / 4 * t * (1 - t) ** 2
        z = start[2] + (end[2] - start[2]) * _ease(t) + self.g.lift * leg * bump * (0.9 if self.g.contact < 0.5 else 0.62)
        return np.array([start[0], y, z])

    def _down(self, phase: float, pitch: float) -> Float:
        """The ankle of a foot on the ground, tilted about its heel (toes up) or its ball (heel up)."""
        rest, hip = self.s[f"{self.prefix}Ankle"], self.s[f"{self.prefix}Hip"]
        ball = self.s[f"{self.prefix}Foot"] * (1, 1, 0)
        heel = rest * (1, 1, 0) + (0, 0.045, 0)
        pivot = heel if pitch > 0 else ball
        angle = np.radians(pitch)
        arm = rest - pivot
        turned = np.array(
            [arm[0], np.cos(angle) * arm[1] + np.sin(angle) * arm[2], np.cos(angle) * arm[2] - np.sin(angle) * arm[1]]
        )
        middle = 0.42 * self.g.contact
        along = self.g.speed * self.g.seconds * (phase - middle)
        across = hip[0] * (0.85 if self.g.contact > 0.5 else 0.5) - rest[0]
        return pivot + turned + (across, along, 0.0)


class _Body:
    """A pose under construction."""

    def __init__(self, s: Skeleton) -> None:
        self._s, self.root, self.short = s, s["Pelvis"], 0.0
        self._turns = np.tile(np.eye(3), (len(JOINTS), 1, 1))

    def turn(self, name: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        """Turn a joint: degrees about x (above 0: backwards), then y, then z."""
        self._turns[JOINTS.index(name)] = product(_about(2, z), product(_about(1, y), _about(0, -x)))

    def arm(self, prefix: str, sign: int, ahead: float, away: float, bend: float, inward: float) -> None:
        """Hang an arm this many degrees ahead and away from the body, with its elbow bent and its forearm turned inwards."""
        s = self._s
        down = _unit(np.array([sign * np.sin(np.radians(away)), 0.0, -np.cos(np.radians(away))]))
        hang = _between(_unit(s[f"{prefix}Elbow"] - s[f"{prefix}Shoulder"]), down)
        low = _about(1, sign * 8.0)  # shoulders are lower with hanging arms than in the bind pose
        self._turns[JOINTS.index(f"{prefix}Collar")] = low
        self._turns[JOINTS.index(f"{prefix}Shoulder")] = product(low.T, product(_about(0, -ahead), hang))
        lower = product(hang, _unit(s[f"{prefix}Wrist"] - s[f"{prefix}Elbow"])[:, None])[:, 0]
        straight = _between(lower, down)
        fold = product(_about(2, -sign * inward), product(_about(0, -bend), straight))
        self._turns[JOINTS.index(f"{prefix}Elbow")] = product(hang.T, product(fold, hang))

    def reach(self, prefix: str, ankle: Float, pitch: float, toes: float, out: float = 0.0) -> None:
        """Bend hip and knee so that the ankle reaches a point, and orient the foot: pitch and outward turn, degrees."""
        s = self._s
        pelvis = self._turns[0]
        hip = self.root + product(pelvis, (s[f"{prefix}Hip"] - s["Pelvis"])[:, None])[:, 0]
        thigh, shank = s[f"{prefix}Knee"] - s[f"{prefix}Hip"], s[f"{prefix}Ankle"] - s[f"{prefix}Knee"]
        a, b = (float(np.sqrt((v * v).sum())) for v in (thigh, shank))
        way = ankle - hip
        d = float(np.sqrt((way * way).sum()))
        self.short = max(self.short, d - 0.997 * (a + b))
        d = min(d, 0.999 * (a + b))
        along = _unit(way)
        front = np.array([np.sin(np.radians(out)), -np.cos(np.radians(out)), 0.0])
        front = _unit(front - float((front * along).sum()) * along)
        share = (a * a - b * b + d * d) / (2 * d)
        knee = hip + share * along + np.sqrt(max(a * a - share * share, 0.0)) * front
        upper = _frame(_unit(knee - hip), front)
        lower = _frame(_unit(hip + d * along - knee), front)
        world_hip = product(upper, _frame(_unit(thigh), np.array([0.0, -1.0, 0.0])).T)
        world_knee = product(lower, _frame(_unit(shank), np.array([0.0, -1.0, 0.0])).T)
        world_foot = product(_about(2, out), _about(0, -pitch))
        world_toes = product(_about(2, out), _about(0, -pitch - toes))
        above = pelvis
        for name, world in (("Hip", world_hip), ("Knee", world_knee), ("Ankle", world_foot), ("Foot", world_toes)):
            self._turns[JOINTS.index(prefix + name)] = product(above.T, world)
            above = world

    def pose(self) -> Pose:
        """Return the finished pose."""
        return Pose(self._turns, np.array(self.root, np.float64))


def _about(axis: int, degrees: float) -> Float:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def _cross(a: Float, b: Float) -> Float:
    (p, q, r), (x, y, z) = a.tolist(), b.tolist()  # for this few numbers plain Python is ten times as fast as numpy
    return np.array([q * z - r * y, r * x - p * z, p * y - q * x])


def _unit(v: Float) -> Float:
    return v / np.sqrt((v * v).sum())


def _frame(along: Float, front: Float) -> Float:
    """A rotation (3, 3) whose columns are a limb's direction, its front and its side."""
    side = _unit(_cross(along, front))
    return np.array([along, _cross(side, along), side]).T


def _between(a: Float, b: Float) -> Float:
    """The shortest rotation (3, 3) from one unit vector to another."""
    v, c = _cross(a, b), float((a * b).sum())
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + k + product(k, k) / (1 + c)


def _ease(t: float) -> float:
    t = min(max(t, 0.0), 1.0)
    return t * t * (3 - 2 * t)
