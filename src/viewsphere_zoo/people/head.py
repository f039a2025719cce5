"""Head, face, eyes and neck."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.fields import Field, ball, grown, joined, limb, mirror, without
from viewsphere_zoo.people.skeleton import Skeleton
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, turned


@dataclass(frozen=True)
class Face:
    """The features that vary between faces, each from about -1 to 1."""

    jaw: float = 0.0
    nose: float = 0.0
    length: float = 0.0
    lips: float = 0.0
    brow: float = 0.0


@dataclass(frozen=True, eq=False)
class Head:
    """A head: `center` between its ears at the height of its eyes, `size` the scale of the head that this module describes."""

    center: Float
    size: float
    face: Face
    male: float

    def at(self, x: float, y: float, z: float) -> Float:
        """The position of a point given in the head's own axes, before scaling."""
        return self.center + self.size * np.array([x, y, z])

    @property
    def eye(self) -> Float:
        """The middle of the left eye."""
        return self.at(0.0315, -0.0735, 0.002)

    def skull(self) -> Field:
        """Cranium and jaw without features."""
        s, f = self.size, self.face
        jaw = 0.039 + 0.0035 * f.jaw + 0.0065 * self.male
        low = -0.077 - 0.004 * f.length
        return joined(
            0.030 * s,
            self._ball((0, 0.014, 0.035), (0.0745, 0.092, 0.081)),
            self._ball((0, -0.034, -0.030), (0.0585, 0.0535, 0.068)),
            self._ball((0, -0.044, low), (jaw, 0.040, 0.030)),
        )

    def field(self) -> Field:
        """The head with its face and ears; openings for the eyes."""
        s, f, chin = self.size, self.face, -0.098 - 0.004 * self.face.length
        skull = joined(
            0.016 * s,
            self.skull(),
            self._ball((0, -0.079, chin), (0.016 + 0.003 * self.male, 0.010, 0.012)),
            mirror(self._ball((0.041, -0.059, -0.024), (0.020, 0.020, 0.017))),
            mirror(self._ball((0.033, -0.050, -0.052), (0.024, 0.026, 0.028))),
            self._ball((0, -0.0775, 0.0205 + 0.001 * f.brow), (0.044 + 0.003 * self.male, 0.0095 + 0.0055 * self.male, 0.0100)),
        )
        hollow = mirror(self._ball((0.0325, -0.0990, 0.002), (0.0175, 0.0150, 0.0115)))
        skull = without(skull, hollow, 0.012 * s)
        lid = mirror(ball(self.eye, 0.0146 * s))
        slit = mirror(self._ball((0.0322, -0.0885, 0.0018), (0.0138, 0.0110, 0.0056)))
        lids = without(joined(0.006 * s, skull, lid), slit, 0.002 * s)
        return joined(0.006 * s, joined(0.010 * s, lids, self._nose(), self._lips()), mirror(self._ear()))

    def _nose(self) -> Field:
        s, n, small = self.size, self.face.nose, 0.88 + 0.12 * self.male
        thick = (0.0090 + 0.0012 * n) * small * s
        tip = (0, -0.085 - (0.0225 + 0.004 * n) * small, -0.0340 - 0.003 * n)
        bridge = limb(
            self.at(0, -0.0815, 0.012),
            self.at(*tip),
            ((0, 0.0060 * s), (0.6, 0.0072 * small * s), (1, thick)),
        )
        wing = mirror(self._ball(((0.0106 + 0.001 * n) * small, -0.0960, -0.0362), (0.0068 * small, 0.0092, 0.0064)))
        return joined(0.008 * s, bridge, wing)

    def _lips(self) -> Field:
        s, full = self.size, 1 + 0.25 * self.face.lips - 0.15 * self.male
        upper = self._ball((0, -0.0850, -0.0605), (0.0215, 0.0105, 0.0052 * full))
        lower = self._ball((0, -0.0845, -0.0708), (0.0190, 0.0105, 0.0062 * full))
        return joined(0.0025 * s, upper, lower)

    def _ear(self) -> Field:
        s = self.size
        turn = np.array([[np.cos(0.35), np.sin(0.35), 0], [-np.sin(0.35), np.cos(0.35), 0], [0, 0, 1.0]])
        shell = ball(self.at(0.0775, 0.016, -0.012), np.array((0.0080, 0.0180, 0.0300)) * s, turn)
        hole = ball(self.at(0.0845, 0.012, -0.010), np.array((0.0070, 0.0095, 0.0180)) * s, turn)
        return without(shell, hole, 0.004 * s)

    def _ball(self, center: tuple[float, float, float], radii: tuple[float, float, float]) -> Field:
        return ball(self.at(*center), self.size * np.array(radii))

    def eyes(self, at: Float | None = None, radius: float | None = None) -> tuple[Solid, Solid, Solid]:
        """White, iris and pupil of both eyes, which look ahead: the left one at `at` with this size; by default at the head's
        own.
        """
        r, middle = radius or 0.0125 * self.size, self.eye if at is None else at
        out = list[Solid]()
        for k, reach in enumerate(np.radians((180.0, 28.0, 11.0))):
            angle = np.linspace(reach, 0, 13 if k == 0 else 4)
            lift = 1 + 0.003 * k  # each is on top of the previous one
            profile = lift * r * np.stack([np.sin(angle), np.cos(angle)], axis=1)
            profile = np.concatenate([[(0.0, profile[0, 1])], profile])  # a flat back closes it
            profile[-1, 0] = 0.0
            one = turned(lathe(profile, 18), 0, np.pi / 2)
            out.append(join(*(moved(one, middle * (side, 1, 1)) for side in (1, -1))))
        white, iris, pupil = out
        return white, iris, pupil


def head_of(b: Build, s: Skeleton, face: Face) -> Head:
    """The head of a person of this build, which ends at its height."""
    size = (0.30 * 1.75 + 0.70 * b.height) / 1.75 * (0.965 + 0.035 * b.male)
    return Head(np.array([0.0, s["Head"][1] - 0.012 * size, b.height - 0.1165 * size]), size, face, b.male)


def neck(b: Build, s: Skeleton, head: Head) -> Field:
    """The neck, from between the shoulders into the skull, and its muscles."""
    h, k = b.height, 0.027 + 0.0055 * b.male + 0.003 * max(b.weight, 0)
    column = limb(
        s["Neck"] + (0, 0.002 * h, -0.03 * h),
        head.at(0, 0.022, -0.045),
        ((0, 1.22 * k * h), (0.45, 1.02 * k * h), (1, 0.98 * k * h)),
    )
    muscle = mirror(limb((0.010 * h, -0.018 * h, 0.818 * h), head.at(0.055, 0.020, -0.045), ((0, 0.008 * h), (1, 0.011 * h))))
    return joined(0.012 * h, column, grown(muscle, 0.0))
