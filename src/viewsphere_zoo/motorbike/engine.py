"""Engines with their pipes, the frame around them, pegs and stand."""

from __future__ import annotations

import numpy as np

from viewsphere_zoo.cycle.wheels import on_axle
from viewsphere_zoo.motorbike.design import Coats, Motorcycle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod, shifted, smooth
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, mirrored, moved, rounded_box, tube, turned


def middle(p: Motorcycle) -> Float:
    """The crankcase's middle, (3,)."""
    return np.array((0.0, -0.03, p.radius[1] + 0.1 - 0.03 * (p.style == "cruiser")))


def engine_pieces(p: Motorcycle, c: Coats) -> list[Piece]:
    """Crankcase with round covers, finned cylinders, pipes and mufflers."""
    at = middle(p)
    case = moved(rounded_box((0.27, 0.46, 0.26), 0.07, 3), at)
    cover = on_axle(lathe([(0, 0.0), (0.115, 0.0), (0.11, 0.03), (0.08, 0.045), (0, 0.05)], 22))
    covers = join(
        moved(cover, shifted(at, 0.13, -0.08, -0.01)),
        moved(Solid(cover.vertices * 0.8, cover.triangles), shifted(at, 0.13, 0.13, 0.01)),
    )
    fins, ports = {"four": _four, "single": _single, "v_twin": _v_twin}[p.engine](at)
    return [
        Piece("engine", c.engine, join(case, fins)),
        Piece("engine", c.pipe, both_sides(covers)),
        *_pipes(p, ports, at, c),
    ]


def _fins(size: tuple[float, float], foot: Float, lean: float, height: float, round_: bool) -> Solid:
    """Cooling fins about a barrel that leans back by `lean` radians, its foot at (3,)."""
    w, d = size
    solids: list[Solid] = []
    for z in np.linspace(0.02, height - 0.05, 8):
        fin = lathe([(0, z - 0.005), (w / 2, z - 0.005), (w / 2, z + 0.005), (0, z + 0.005)], 18) if round_ else None
        solids.append(fin if fin else moved(rounded_box((w, d, 0.011), 0.005, 1), (0, 0, z)))
    core = rounded_box((0.82 * w, 0.8 * d, height), 0.03, 2)
    lid = rounded_box((0.9 * w, 0.9 * d, 0.07), 0.025, 2)
    whole = join(*solids, moved(core, (0, 0, height / 2)), moved(lid, (0, 0, height)))
    return moved(turned(whole, 0, -lean), foot)


def _four(at: Float) -> tuple[Solid, list[Float]]:
    """A bank of four, leaning ahead."""
    foot = shifted(at, 0, -0.06, 0.1)
    return _fins((0.36, 0.19), foot, -0.2, 0.22, False), [shifted(foot, x, -0.13, 0.13) for x in (-0.14, -0.05, 0.05, 0.14)]


def _single(at: Float) -> tuple[Solid, list[Float]]:
    foot = shifted(at, 0, -0.06, 0.1)
    return _fins((0.19, 0.2), foot, -0.12, 0.26, False), [shifted(foot, -0.03, -0.13, 0.17)]


def _v_twin(at: Float) -> tuple[Solid, list[Float]]:
    """Two round barrels in a V."""
    a, b = (_fins((0.18, 0.18), shifted(at, 0, y, 0.09), lean, 0.25, True) for y, lean in ((-0.08, -0.4), (0.07, 0.4)))
    return join(a, b), [shifted(at, -0.09, -0.22, 0.22), shifted(at, -0.09, 0.1, 0.26)]


def _pipes(p: Motorcycle, ports: list[Float], at: Float, c: Coats) -> list[Piece]:
    """Bent pipes from the ports to one muffler or two behind."""
    low, rear = at[2] - 0.17, p.rear_axle
    start = np.array((-0.13, 0.2, low))
    lift = {"sport": 0.14, "naked": 0.1}.get(p.style, 0.0)
    end = np.array((-p.tyre[1] / 2 - 0.09, rear[1] + 0.12, rear[2] - 0.02 + lift))
    head = start + 0.12 * (end - start)
    solids: list[Solid] = []
    for port in ports:
        out = np.array((0.0, -0.1, -0.02)) if port[1] < at[1] else np.array((-0.06, 0.02, -0.02))
        bend = (port[0] * 0.9, port[1] - 0.09, low + 0.09) if port[1] < at[1] else (-0.16, port[1] + 0.06, low + 0.15)
        foot = (0.5 * port[0] - 0.05, at[1] - 0.1, low) if port[1] < at[1] else (-0.15, at[1] + 0.2, low + 0.03)
        solids.append(tube(smooth(np.array([port, port + out, bend, foot, start, head]), 4), 0.021, 10))
    along = np.linspace(0, 1, 9)[:, None]
    line = head + along * (end - head)
    r = np.array([0.022, 0.036, 0.046, 0.05, 0.05, 0.05, 0.048, 0.043, 0.035])
    can = tube(line, r * (1.15 if p.style == "sport" else 0.9), 16)
    pieces = [Piece("exhaust", c.pipe, join(*solids)), Piece("muffler", c.pipe, can)]
    hole = rod(end, end + 0.012 * (end - head) / np.linalg.norm(end - head), 0.024, 12)
    pieces.append(Piece("muffler", c.black, hole))
    if p.mufflers > 1:
        pieces += [Piece("muffler", q.material, mirrored(q.solid)) for q in pieces if q.part == "muffler"]
        pieces.append(Piece("exhaust", c.pipe, tube([start, start * (-1, 1, 1), head * (-1, 1, 1)], 0.021, 8)))
    return pieces


def frame_pieces(p: Motorcycle, c: Coats, paint: bool) -> list[Piece]:
    """Tubes from the steering head around the engine to the tail, pegs, side stand."""
    at, head = middle(p), p.head - 0.1 * p.up
    back = np.array((0.09, 0.26, at[2] + 0.02))
    down = [head, (0.1, head[1] + 0.06, head[2] - 0.16), (0.14, at[1] - 0.26, at[2] + 0.05), (0.13, at[1] - 0.2, at[2] - 0.17)]
    down += [(0.13, at[1] + 0.2, at[2] - 0.17), back]
    top = [head, (0.07, head[1] + 0.12, p.seat - 0.04), (0.1, 0.12, p.seat - 0.12), back]
    tail = [(0.1, 0.12, p.seat - 0.1), (0.1, p.rear_axle[1] + 0.02, p.seat - 0.04)]
    stay = [back, (0.1, p.rear_axle[1] - 0.2, p.seat - 0.08)]
    tubes = [
        tube(smooth(np.array(down), 4), 0.017, 8),
        tube(smooth(np.array(top), 4), 0.02, 8),
        tube(tail, 0.014, 8),
        tube(np.array(stay), 0.012, 8),
    ]
    neck = rod(p.head - 0.2 * p.up, p.head - 0.01 * p.up, 0.034, 14)
    ahead = -0.28 if p.style == "cruiser" else 0.22
    peg = rod((0.12, at[1] + ahead, at[2] - 0.05), (0.28, at[1] + ahead, at[2] - 0.05), 0.014, 8)
    rear_peg = rod((0.11, at[1] + 0.42, at[2] + 0.02), (0.24, at[1] + 0.42, at[2] + 0.02), 0.012, 8)
    stand = tube([(0.13, at[1] + 0.12, at[2] - 0.16), (0.25, at[1] + 0.22, 0.012), (0.3, at[1] + 0.24, 0.012)], 0.012, 6)
    return [
        Piece("frame", c.paint if paint else c.black, join(both_sides(join(*tubes)), neck)),
        Piece("peg", c.rubber, both_sides(join(peg, rear_peg))),
        Piece("stand", c.black, stand),
    ]
