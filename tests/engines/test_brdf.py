"""The shading stages against closed forms and numeric integration, on single blocks."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from called import called

from quick import quick
from viewsphere.engines.raster.records import NO_BOUNCES
from viewsphere.engines.raster.shading import kernels_block as rows
from viewsphere.engines.raster.shading import kernels_light
from viewsphere.engines.raster.sky.environment import Surrounding, bake_surrounding, lobe_albedo
from viewsphere.engines.raster.sky.kernels_environment import BELOW
from viewsphere.model.scene import Sky
from viewsphere.rendering.view import EXPOSURE

N = rows.BLOCK
NAMES = "weigh", "add_light", "add_light_matte", "ambient", "ambient_matte", "compose"
stages = SimpleNamespace(**{name: called(getattr(kernels_light, name)) for name in NAMES})
WHITE = Sky(zenith=(1, 1, 1), horizon=(1, 1, 1))
DEFAULTS = {
    "ALPHA": 1, "F0R": 0.04, "F0G": 0.04, "F0B": 0.04, "RED": 1, "GREEN": 1, "BLUE": 1, "ROUGH": 0.5, "OPEN": 1, "BOUNCE": 1,
    "SHARE": 1, "IR": 1, "IG": 1, "IB": 1,
}  # fmt: skip


def block(normal=(0, 0, 1), view=(0, 0, 1), light=(0, 0, 1), **values) -> np.ndarray:
    """A block with these rows, each a number or up to N of them."""
    b = np.zeros(rows.ROWS * N, np.float32)
    vectors = {"N": normal, "G": normal, "C": normal, "V": view, "L": light}
    for letter, vector in vectors.items():
        for axis, value in zip("XYZ", vector, strict=True):
            values.setdefault(letter + axis, value)
    for name, value in {**DEFAULTS, **values}.items():
        start = getattr(rows, name)
        b[start : start + N] = np.resize(value, N)
    return b


def out(b: np.ndarray, name: str) -> np.ndarray:
    return b[getattr(rows, name) :][:N].astype(np.float64)


def lit(b: np.ndarray) -> np.ndarray:
    stages.weigh(N, lobe_albedo(), b)
    stages.add_light(N, b)
    return b


def white_furnace() -> Surrounding:
    """Light 1 from everywhere."""
    surrounding = bake_surrounding(WHITE, None, None, even=np.zeros((2, 3)))
    light = surrounding.light.copy()
    light[BELOW] = 1
    return surrounding._replace(light=light)


def upward(rng):
    """N random unit vectors above the surface, (3, N)."""
    v = rng.normal(size=(3, N))
    v[2] = abs(v[2]) + 0.1
    return v / np.linalg.norm(v, axis=0)


def tilted(cosine):
    cosine = np.asarray(cosine, float)
    return np.sqrt(1 - cosine**2), np.zeros_like(cosine), cosine


def ggx(n_l, n_v, n_h, v_h, alpha, f0):
    """Walter et al. 2007 with height-correlated Smith (Heitz 2014, eq. 99), straight from the papers."""
    d = alpha**2 / (math.pi * (n_h**2 * (alpha**2 - 1) + 1) ** 2)

    def lam(c):
        return (-1 + np.sqrt(1 + alpha**2 * (1 - c**2) / c**2)) / 2

    g = 1 / (1 + lam(n_l) + lam(n_v))
    return d * g * (f0 + (1 - f0) * (1 - v_h) ** 5) / (4 * n_l * n_v)


def test_matt_surface_follows_lambert():
    cosines = np.linspace(-1, 1, N)
    b = block(light=tilted(cosines), view=tilted(0.05), F0R=0, F0G=0, F0B=0, RED=0.5)
    lit(b)
    # What mirrors nothing straight on has no bright rim, either.
    assert np.allclose(out(b, "DR"), 0.5 * np.maximum(cosines, 0) / math.pi, atol=1e-6)
    assert (out(b, "SR") == 0).all()


def test_the_rim_of_little_reflectance_has_its_share():
    shares = np.repeat([0.0, 0.005, 0.01, 0.02, 0.04], 2)
    b = block(view=tilted(0.1), F0R=shares, F0G=shares, F0B=shares)
    stages.weigh(N, lobe_albedo(), b)
    edge, face = out(b, "EDGE_R"), out(b, "FACE_R")
    assert np.allclose(
        edge + face, np.resize(np.minimum(50 * shares, 1), N) * (1 + np.resize(shares, N) * (1 / out(b, "LOBE") - 1))
    )


@pytest.mark.parametrize("rough", [0.1, 0.3, 0.6, 1.0])
def test_specular_is_ggx(rough):
    rng = np.random.default_rng(0)
    light, view = upward(rng), upward(rng)
    half = (light + view) / np.linalg.norm(light + view, axis=0)
    b = lit(block(view=view, light=light, ROUGH=rough, METAL=1, RED=0.7))
    v_h = (view * half).sum(axis=0)
    expected = ggx(light[2], view[2], half[2], v_h, rough**2, 0.7) * light[2]
    lobe = out(b, "LOBE")
    expected *= 1 + 0.7 * (1 - lobe) / lobe  # what bounces more than once
    assert np.allclose(out(b, "SR"), expected, rtol=2e-3, atol=1e-5)
    assert (out(b, "DR") == 0).all()


def test_one_bounce_is_reciprocal():
    rng = np.random.default_rng(1)
    a, c = upward(rng), upward(rng)

    def reflected(view, light):
        b = lit(block(view=view, light=light, ROUGH=0.4, METAL=1, RED=0.5))
        lobe = out(b, "LOBE")
        return out(b, "SR") / light[2] / (1 + 0.5 * (1 - lobe) / lobe)

    assert np.allclose(reflected(a, c), reflected(c, a), rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("rough", "metal", "coat"),
    quick(
        [
            *((0.35, metal, coat) for metal, coat in ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))),
            *((0.6, metal, coat) for metal, coat in ((0.0, 1.0), (0.5, 0.0), (1.0, 1.0))),
            *((1.0, metal, coat) for metal, coat in ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))),
        ],
        *((0.35, 0.5, 1.0), (0.6, 0.0, 1.0), (1.0, 1.0, 0.0)),
    ),
)
def test_distant_lights_all_around_are_a_furnace(rough, metal, coat):
    """Integrated over directions as the kernel's own light, not through the maps."""
    view = tilted(np.array([0.9, 0.6, 0.3]))
    heights, around = (160, 128) if rough < 0.5 else (80, 64)  # narrow highlights need more directions
    z = (np.arange(heights) + 0.5) / heights
    phi = (np.arange(around) + 0.5) * 2 * math.pi / around
    light = np.stack(
        [np.outer(np.sqrt(1 - z * z), np.cos(phi)), np.outer(np.sqrt(1 - z * z), np.sin(phi)), np.outer(z, phi * 0 + 1)]
    )
    light = light.reshape(3, -1)
    total = np.zeros(3)
    each = 2 * math.pi / light.shape[1]
    for k in range(3):
        v = [float(c[k]) for c in view]
        for start in range(0, light.shape[1], N):
            part = light[:, start : start + N]
            b = lit(block(view=v, light=part, ROUGH=rough, METAL=metal, COAT=coat, COAT_ROUGH=0.4))
            total[k] += (out(b, "DR") + out(b, "SR")).sum() * each
    # The coat and the facets that the normal view sees are sampled; grazing ones need Fresnel's average only.
    assert total == pytest.approx(np.ones(3), abs=0.02)


@pytest.mark.slow
def test_white_furnace():
    """Within 1 %: any roughness, metal, coat and angle."""
    surrounding = white_furnace()
    rng = np.random.default_rng(2)
    cosines = np.concatenate([np.linspace(0.01, 1, N // 2), rng.uniform(0, 1, N // 2)])
    for rough in np.linspace(0, 1, 7):
        for metal in (0.0, 0.3, 1.0):
            for coat in (0.0, 0.5, 1.0):
                view = tilted(cosines)
                b = block(view=view, ROUGH=rough, METAL=metal, COAT=coat, COAT_ROUGH=rng.uniform(0, 1, N))
                stages.weigh(N, surrounding.albedo, b)
                stages.ambient(N, surrounding, NO_BOUNCES, b)
                stages.compose(N, b)
                for name in ("RED", "GREEN", "BLUE"):
                    assert out(b, name) == pytest.approx(1, abs=0.01), (rough, metal, coat)


def test_level_ground_reflects_its_own_share():
    surrounding = white_furnace()
    b = block(BASE_R=0.3, BASE_G=0.2, BASE_B=0.1, OPEN=0.5, light=tilted(np.full(N, 0.6)))
    stages.ambient_matte(N, surrounding, NO_BOUNCES, b)
    assert out(b, "DG") == pytest.approx(0.1, rel=0.01)
    stages.add_light_matte(N, b)
    assert out(b, "DR") == pytest.approx(0.15 + 0.3 * 0.6 / math.pi, rel=0.01)


@pytest.mark.parametrize("rough", [0.05, 0.3, 0.7])
@pytest.mark.parametrize("width_deg", [0.25, 2.0, 8.0])
def test_large_light_has_the_light_of_a_small_one(rough, width_deg):
    """All that the highlight sends out, over all directions to the viewer."""

    def total(width):
        heights, around = 704, 16  # the light is straight above
        z = np.cos((np.arange(heights) + 0.5) / heights * 1.2)
        ring = np.sin((np.arange(heights) + 0.5) / heights * 1.2) * 1.2 / heights * 2 * math.pi / around
        phi = (np.arange(around) + 0.5) * 2 * math.pi / around
        x = np.outer(np.sqrt(1 - z * z), np.cos(phi)).ravel()
        y = np.outer(np.sqrt(1 - z * z), np.sin(phi)).ravel()
        zz, weight = np.repeat(z, around), np.repeat(ring * z, around)
        result = 0.0
        for s in range(0, len(x), N):
            part = slice(s, s + N)
            view = np.stack([x[part], y[part], zz[part]])
            b = lit(block(view=view, METAL=1, ROUGH=rough, WIDTH=width))
            result += float((out(b, "SR") * weight[part]).sum())
        return result

    assert total(math.radians(width_deg)) == pytest.approx(total(0.0), rel=0.25 if rough < 0.1 else 0.1)


def test_mirror_shows_the_light_ball_at_its_own_size():
    width = math.radians(4)
    angles = np.linspace(0, math.radians(10), N)
    view = np.stack([np.sin(angles), np.zeros(N), np.cos(angles)])
    b = lit(block(view=view, METAL=1, ROUGH=0.0, WIDTH=width))
    shine = out(b, "SR")
    radiance = 1 / (math.pi * width**2)
    inside, outside = angles < 0.9 * width, angles > 1.15 * width
    assert np.allclose(shine[inside], radiance, rtol=0.1)
    assert shine[outside].max() < 0.1 * radiance


def test_coat_covers_and_shines():
    plain = lit(block(view=tilted(np.full(N, 0.5)), light=(0, 0, 1), RED=0.5))
    coated = lit(block(view=tilted(np.full(N, 0.5)), light=(0, 0, 1), RED=0.5, COAT=1, COAT_ROUGH=0.05))
    assert (out(coated, "DR") < out(plain, "DR")).all()
    mirror = tilted(np.full(N, 0.5))
    shiny = lit(block(view=mirror, light=(-mirror[0], mirror[1], mirror[2]), RED=0.5, ROUGH=1, COAT=1, COAT_ROUGH=0.1))
    dull = lit(block(view=mirror, light=(-mirror[0], mirror[1], mirror[2]), RED=0.5, ROUGH=1))
    assert (out(shiny, "SR") > 20 * out(dull, "SR")).all()


def test_coat_uses_its_own_normal():
    bent = np.array([0.3, 0.0, 1.0]) / np.linalg.norm([0.3, 0, 1])
    light = 2 * bent[2] * bent - [0, 0, 1]
    values = {"light": light, "RED": 0.0, "ROUGH": 1, "COAT": 1, "COAT_ROUGH": 0.1, "F0R": 0}
    straight = lit(block(**values))
    turned = lit(block(**values, CX=bent[0], CY=bent[1], CZ=bent[2]))
    assert (out(turned, "SR") > 10 * out(straight, "SR")).all()


def test_glass_lets_through_by_its_tint():
    surrounding = white_furnace()
    b = block(TRANSMISSION=1, ROUGH=0.0, RED=0.8, GREEN=0.5, BLUE=0.5)
    stages.weigh(N, surrounding.albedo, b)
    stages.ambient(N, surrounding, NO_BOUNCES, b)
    stages.compose(N, b)
    shown = 1 - out(b, "ALPHA")
    assert shown == pytest.approx(0.96 * 0.5, abs=0.01)
    # Before something white as its surroundings: its reflection, and the rest tinted.
    assert out(b, "RED") + shown == pytest.approx(0.04 + 0.96 * 0.8, abs=0.01)
    assert out(b, "GREEN") + shown == pytest.approx(0.04 + 0.96 * 0.5, abs=0.01)


def test_unlit_shows_its_colour_alone():
    surrounding = white_furnace()
    b = block(UNLIT=1, RED=0.3, ER=5, ALPHA=0.5)
    stages.weigh(N, surrounding.albedo, b)
    stages.add_light(N, b)
    stages.ambient(N, surrounding, NO_BOUNCES, b)
    stages.compose(N, b)
    assert out(b, "RED") == pytest.approx(0.15 / EXPOSURE, abs=1e-6)
    assert out(b, "ALPHA") == pytest.approx(0.5)


def test_occlusion_dims_and_never_brightens():
    surrounding = white_furnace()
    last = np.full(N, np.inf)
    for open_ in (1.0, 0.7, 0.3, 0.0):
        b = block(view=tilted(np.linspace(0.05, 1, N)), OPEN=open_, ROUGH=0.3, METAL=0.5)
        stages.weigh(N, surrounding.albedo, b)
        stages.ambient(N, surrounding, NO_BOUNCES, b)
        light = out(b, "DR") + out(b, "SR")
        assert (light <= last + 1e-6).all()
        last = light
    assert (last == 0).all()


def test_nothing_is_negative_or_not_a_number():
    """Any directions, normals that look away or are no numbers, lights below, extremes of every material."""
    surrounding = white_furnace()
    rng = np.random.default_rng(3)
    for _ in range(60):
        vectors = [rng.normal(size=(3, N)) for _ in range(3)]
        vectors = [v / np.linalg.norm(v, axis=0) for v in vectors]
        for v in vectors:
            v[:, rng.random(N) < 0.05] = rng.choice([0.0, np.nan])
        ends = {
            name: rng.choice([0.0, 1.0, rng.random()], N)
            for name in ("ROUGH", "METAL", "COAT", "COAT_ROUGH", "TRANSMISSION", "RED", "F0R", "OPEN", "BOUNCE", "ALPHA")
        }
        b = block(vectors[0], vectors[1], vectors[2], **ends, WIDTH=rng.choice([0, 0.005, 1.0], N), IR=rng.choice([0, 1e4], N))
        stages.weigh(N, surrounding.albedo, b)
        stages.add_light(N, b)
        stages.ambient(N, surrounding, NO_BOUNCES, b)
        stages.compose(N, b)
        for name in ("RED", "GREEN", "BLUE", "ALPHA"):
            values = out(b, name)
            assert np.isfinite(values).all() and (values >= 0).all(), name


def test_lobe_albedo_has_its_closed_forms():
    albedo = lobe_albedo()
    assert albedo[-1, -1, 0] == pytest.approx(1 - math.log(2), abs=4e-3)  # alpha 1, seen from above
    assert albedo[0, 8:, 0] == pytest.approx(1, abs=2e-3)  # a mirror
    side = np.linspace(0, 1, len(albedo))
    assert albedo[0, 8:, 1] == pytest.approx((1 - side[8:] ** 2) ** 5, abs=3e-3)
