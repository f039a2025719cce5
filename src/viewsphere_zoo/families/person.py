"""People: a mannequin on the 24 joints of SMPL and SURREAL that walks, runs, stands and sits."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass, field

import numpy as np

from viewsphere.assets.exporting.rigged import RiggedModel
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.people import makehuman
from viewsphere_zoo.people.actions import Manner, clips, still
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.hair import Style
from viewsphere_zoo.people.head import Face
from viewsphere_zoo.people.human import human
from viewsphere_zoo.people.makehuman import HERITAGES
from viewsphere_zoo.people.mannequin import Looks, mannequin
from viewsphere_zoo.people.outfit import Bottom, Outfit, Top
from viewsphere_zoo.people.skeleton import JOINTS, PARENTS, skeleton
from viewsphere_zoo.shapes.paint import Color

CLIPS = ("walk", "run", "stand", "sit")
"""A person's animations; the first one plays by default."""

SKINS: tuple[Color, ...] = ((0.24, 0.15, 0.11), (0.48, 0.32, 0.23), (0.78, 0.58, 0.45), (0.93, 0.77, 0.68))
DARK_HAIR: tuple[Color, ...] = ((0.06, 0.05, 0.045), (0.11, 0.075, 0.05), (0.19, 0.12, 0.075))
FAIR_HAIR: tuple[Color, ...] = ((0.33, 0.21, 0.12), (0.62, 0.47, 0.27), (0.76, 0.62, 0.40), (0.45, 0.20, 0.09))
GREY_HAIR: tuple[Color, ...] = ((0.45, 0.44, 0.43), (0.72, 0.71, 0.70))
EYES: tuple[Color, ...] = ((0.20, 0.12, 0.07), (0.28, 0.40, 0.52), (0.32, 0.38, 0.24))
MEN: tuple[Style, ...] = ("short", "short", "crop", "side", "curls", "bald")
WOMEN: tuple[Style, ...] = ("bob", "long", "long", "ponytail", "bun", "curls", "side")
BOTTOMS: tuple[Color, ...] = (
    (0.16, 0.20, 0.31),
    (0.25, 0.33, 0.47),
    (0.10, 0.10, 0.11),
    (0.55, 0.48, 0.37),
    (0.33, 0.34, 0.33),
)
SHOES: tuple[Color, ...] = ((0.08, 0.07, 0.07), (0.26, 0.16, 0.09), (0.85, 0.84, 0.82), (0.45, 0.10, 0.10), (0.18, 0.22, 0.35))


@dataclass(frozen=True)
class Person:
    """A person: body, looks, clothes, how it moves, and whether it walks when no animation plays (else it stands). MakeHuman
    bodies also have an `age`, from 0 (young) to 1 (old), and a `heritage`: the shares of African, Asian and Caucasian.
    """

    build: Build = field(default_factory=Build)
    looks: Looks = field(default_factory=Looks)
    outfit: Outfit = field(default_factory=Outfit)
    manner: Manner = field(default_factory=Manner)
    walks: bool = False
    age: float = 0.15
    heritage: tuple[float, float, float] = (0.3, 0.3, 0.4)


def person(parameters: Person | None = None) -> RiggedModel:
    """The person in metres, front -Y, the ground at z = 0. Parts: head, eyes, hair, arms, top, bottom, legs, shoes."""
    p = parameters or Person()
    data = makehuman.data()
    if data is None:
        s = skeleton(p.build)
        mesh, joints, shares = mannequin(p.build, s, p.looks, p.outfit)
    else:
        made = human(data, p.build, p.looks, p.outfit, p.age, dict(zip(HERITAGES, p.heritage, strict=True)))
        mesh, s, joints, shares = made.mesh, made.skeleton, made.joints, made.weights
    return RiggedModel(mesh, JOINTS, PARENTS, s.places, joints, shares, still(s, p.manner, p.walks), clips(s, p.manner))


def made_of() -> str:
    """A digest of the data used for people apart from this package's sources: MakeHuman's data, if set up."""
    return makehuman.digest()


def person_random(rng: np.random.Generator) -> RiggedModel:
    """A person with all parameters drawn."""
    return person(draw(rng))


def draw(rng: np.random.Generator) -> Person:
    """The parameters of a random person."""
    is_man = bool(rng.random() < 0.5)
    male = float(rng.uniform(0.8, 1.0) if is_man else rng.uniform(0.0, 0.2))
    height = float(np.clip(rng.normal(1.765 if is_man else 1.65, 0.068), 1.50, 1.98))
    weight = float(np.clip(rng.normal(0.1, 0.45), -0.8, 1.0))
    build = Build(round(height, 3), male, weight, float(rng.uniform(0.513, 0.533)))
    looks = _looks(rng, is_man)
    outfit = _outfit(rng, is_man)
    manner = Manner(
        swing=float(rng.uniform(0.75, 1.3)),
        lively=float(rng.uniform(0.6, 1.4)),
        stance=float(rng.uniform(1.0, 1.6)),
        lean=float(rng.uniform(-1.5, 3.0)),
        phase=float(rng.random()),
    )
    return Person(build, looks, outfit, manner, bool(rng.random() < 0.5), float(rng.beta(1.2, 2.5)), _heritage(rng, looks))


def _heritage(rng: np.random.Generator, looks: Looks) -> tuple[float, float, float]:
    """Shares of MakeHuman's heritage shapes that suit a skin tone."""
    fair = (sum(looks.skin) - 0.5) / 1.9
    african, asian, caucasian = rng.dirichlet((0.2 + 1.5 * max(0.6 - fair, 0), 0.7, 0.2 + 1.2 * fair)).tolist()
    return african, asian, caucasian


def _looks(rng: np.random.Generator, is_man: bool) -> Looks:
    jaw, nose, length, lips, brow = rng.uniform(-1, 1, 5).tolist()
    # Skin from deep to fair, along a line of measured tones, a little redder or yellower.
    tone, tint = float(rng.random()), float(rng.uniform(-0.02, 0.02))
    r, g, b = (np.interp(tone, (0, 0.35, 0.7, 1), column) for column in zip(*SKINS, strict=True))
    dark = tone < 0.45 or rng.random() < 0.45
    locks = DARK_HAIR if dark else DARK_HAIR + FAIR_HAIR
    styles: tuple[Style, ...] = MEN if is_man else WOMEN
    return Looks(
        face=Face(jaw, nose, length, lips + (0.6 if tone < 0.35 else 0.0), brow),
        skin=(float(r), float(g) + 0.5 * tint, float(b) - tint),
        hair=styles[int(rng.integers(len(styles)))],
        hair_color=GREY_HAIR[int(rng.integers(len(GREY_HAIR)))]
        if rng.random() < 0.15
        else locks[int(rng.integers(len(locks)))],
        eyes=EYES[int(rng.integers(1 if dark else len(EYES)))],
        fold=tuple(rng.uniform(0, 6.28, 3).tolist()),
    )


def _outfit(rng: np.random.Generator, is_man: bool) -> Outfit:
    tops: tuple[Top, ...] = ("t_shirt", "t_shirt", "shirt", "jumper", "jacket")
    legs: tuple[Bottom, ...] = ("trousers", "trousers", "shorts") if is_man else ("trousers", "trousers", "shorts", "skirt")
    return Outfit(
        top=tops[int(rng.integers(len(tops)))],
        bottom=legs[int(rng.integers(len(legs)))],
        top_color=_dye(rng),
        bottom_color=BOTTOMS[int(rng.integers(len(BOTTOMS)))] if rng.random() < 0.75 else _dye(rng),
        shoe_color=SHOES[int(rng.integers(len(SHOES)))],
        sole_color=((0.86, 0.85, 0.82), (0.1, 0.09, 0.09), (0.55, 0.42, 0.3))[int(rng.integers(3))],
    )


def _dye(rng: np.random.Generator) -> Color:
    """A cloth colour: any hue, seldom bright."""
    r, g, b = colorsys.hsv_to_rgb(float(rng.random()), float(rng.beta(2, 2)) * 0.85, float(rng.uniform(0.15, 0.9)))
    return r, g, b


FAMILY = ZooFamily(
    random=person_random,
    home="street",
    classes={"": "person"},
    draw=draw,
    made_of=made_of,
    clips=CLIPS,
)
