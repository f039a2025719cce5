"""Bodies and boards as MuJoCo simulates them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.physics._body import Board, Body, Touch, needed
from viewsphere.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from viewsphere.model.scene import Matrix4

Float = NDArray[np.float64]

TYPICAL = 0.4
"""Length in metres that the typical body is simulated with."""

STEP_S = 0.002  # MuJoCo's own default
SOFT_S = 4 * STEP_S
"""Seconds in which a contact gives way: shorter ones need shorter steps, longer ones let bodies sink into one another."""

GRAVITY = 9.81  # metres a second squared

LOOK = 25
"""Steps between two looks at whether bodies move."""

CALM_LOOKS = 12
CALM_SPEED, CALM_TURN = 0.03, 0.3
CALM_WAY, CALM_ANGLE = 0.0003, 0.002
"""Bodies seem to be at rest if they were slower than `CALM_SPEED` and `CALM_TURN` (metres and radians a second) in
`CALM_LOOKS` successive checks, and moved no farther than `CALM_WAY` and `CALM_ANGLE` in total. The speeds are those of a
body that trembles on the spot, from one touching corner to the next.
"""

REST_S, REST_WAY, REST_ANGLE = 1.0, 0.0009, math.radians(0.45)
"""Bodies are at rest if, released from there, they stay within this distance, metres and radians, for this many seconds. All
are in the world's scale, not the simulation's. The wait is needed because a body on an edge falls a moment later.
"""

ASLEEP = 0.006
"""Bodies that settle and are slower than this, metres a second, for ten steps sleep until something touches them, and cost no
time (MuJoCo 3.4 and newer). The check for rest wakes all of them.
"""

DAMPED_S, DAMPING = 2.0, 4.0
"""Seconds after which settling bodies are damped, and the share of speed that they lose per second: boats would rock on
otherwise. The check for rest runs without this damping.
"""

LONGEST_S = 15.0
"""Simulated seconds after which the search for rest ends without success."""

HULL_CORNERS = 256
"""Largest number of corners of a part: fewer would cut off millimetres, which then overlap other bodies."""

SPINNING, ROLLING = 0.005, 0.002
"""Friction against spinning on the spot, and against any turning, metres: the latter is a torque on a body, of its weight at
this distance. As a part of each contact, it adds two rows to the solver for each, and half as much time again.
"""

STIFF, GRIP = 0.95, 100.0
"""Share of a contact's acceleration that its force takes away, and how much stiffer it is against sliding: things creep where
either is less. MuJoCo's iterations against slipping, which make up for a grip of 1, take more than half of a step.
"""


class World:
    """Bodies in a gravity of 9.81 m/s2 on a floor, among boards and bodies that are `fixed`. `typical` is the length of its
    typical body, metres. If `floor` is below 0, z = 0 is only the top of a board.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        poses: Sequence[Matrix4],
        boards: Sequence[Board],
        typical: float,
        floor: float = 0.0,
        fixed: Sequence[tuple[Body, Matrix4]] = (),
    ) -> None:
        self._mujoco = needed("mujoco")
        self._scale = TYPICAL / typical
        self._bodies, self._fences = len(bodies), [i for i, board in enumerate(boards, 1) if board.is_fence]
        self._model = self._compiled(bodies, boards, floor, fixed)
        self.begin(poses)

    def begin(self, poses: Sequence[Matrix4]) -> None:
        """Release the bodies from these poses, as in a new world; removed fences stay removed."""
        self._fall_asleep(False)
        self._data, self._steps = self._mujoco.MjData(self._model), 0
        for number, pose in enumerate(poses):
            self.put(number, pose)
        self._mujoco.mj_forward(self._model, self._data)  # places fixed bodies: steps do not once bodies sleep

    def _fall_asleep(self, may: bool) -> None:
        """Let slow bodies sleep, or wake all."""
        if sleep := int(getattr(self._mujoco.mjtEnableBit, "mjENBL_SLEEP", 0)):
            flags = self._model.opt.enableflags
            self._model.opt.enableflags, self._model.opt.sleep_tolerance = flags | sleep if may else flags & ~sleep, ASLEEP

    def _compiled(
        self, bodies: Sequence[Body], boards: Sequence[Board], floor: float, fixed: Sequence[tuple[Body, Matrix4]]
    ) -> Any:
        mujoco = self._mujoco
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, GRIP
        still = spec.worldbody
        still.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, floor * self._scale], **_contact(Touch()))
        for board in boards:
            pos, size = np.multiply(board.center, self._scale), np.multiply(board.half, self._scale)
            turn = [np.cos(board.turn / 2), 0, 0, np.sin(board.turn / 2)]
            still.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=pos, quat=turn, size=size, **_contact(Touch()))
        for number, body in enumerate(bodies):
            made = still.add_body(name=f"body {number}")
            made.add_freejoint()
            self._add(spec, made, f"part {number}", body)
        for number, (body, pose) in enumerate(fixed):
            matrix = np.array(pose)
            at = {"pos": matrix[:3, 3] * self._scale, "quat": quaternion_from_matrix(matrix[:3, :3])}
            self._add(spec, still.add_body(name=f"fixed {number}", **at), f"fixed part {number}", body)
        model = spec.compile()
        weights = GRAVITY * model.body_mass[1 : 1 + self._bodies]
        model.dof_frictionloss.reshape(-1, 6)[:, 3:] = ROLLING * weights[:, None]
        model.dof_solref[:], model.dof_solimp[:, :2] = (SOFT_S, 1.0), 0.99
        return model

    def _add(self, spec: Any, made: Any, name: str, body: Body) -> None:
        mujoco = self._mujoco
        shares = body.mass * body.volumes / body.volumes.sum() * self._scale**3
        for part, ((corners, triangles), mass) in enumerate(zip(body.parts, shares, strict=True)):
            flat = (corners * self._scale).ravel(), triangles.ravel()
            mesh = spec.add_mesh(name=f"{name} {part}", uservert=flat[0], userface=flat[1], maxhullvert=HULL_CORNERS)
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # needs no watertight mesh, and comes to rest soonest
            made.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, mass=mass, priority=1, **_contact(body.touch))

    def put(self, number: int, pose: Matrix4) -> None:
        """Move a body, given by its number, to another pose, without velocity."""
        matrix = np.array(pose)
        at, speed = self._data.qpos.reshape(-1, 7)[number], self._data.qvel.reshape(-1, 6)[number]
        at[:3], at[3:], speed[:] = matrix[:3, 3] * self._scale, quaternion_from_matrix(matrix[:3, :3]), 0.0

    def take_fences_away(self) -> None:
        """Remove the fences."""
        for number in self._fences:
            self._model.geom_contype[number] = self._model.geom_conaffinity[number] = 0
        self._fences = []

    @property
    def seconds(self) -> float:
        """Elapsed seconds of the world."""
        return self._steps * STEP_S / self._scale**0.5

    def step(self, steps: int = 1) -> None:
        """Simulate this number of steps."""
        self._mujoco.mj_step(self._model, self._data, steps)
        self._steps += steps

    def _damped(self, steps: int) -> None:
        for _ in range(steps):
            self.step()
            self._data.qvel *= 1 - DAMPING * STEP_S

    def settle(
        self,
        longest_s: float = LONGEST_S,
        rest_s: float = REST_S,
        each: int = LOOK,
        look: Callable[[], None] | None = None,
        ends: Callable[[], bool] | None = None,
        is_calm: bool = False,
    ) -> bool:
        """Simulate until all bodies stay in place for `rest_s` seconds of the world, then return to the start of this rest.
        Returns whether rest begins within `longest_s` simulated seconds and before `ends` returns true. Every `each` steps,
        `look` and then `ends` are called. is_calm: whether the bodies seem to be at rest at the beginning.
        """
        calm, tried, begun, step = list[Float](), None, self._steps, 0
        self._fall_asleep(not is_calm)
        if is_calm:
            tried = self._data.qpos.reshape(-1, 7).copy()
        while tried is not None or (step + each) * STEP_S <= longest_s:
            step += each
            if calm or tried is not None or self._steps * STEP_S < DAMPED_S:
                self.step(each)
            else:
                self._damped(each)
            if look is not None:
                look()
            if ends is not None and ends():
                return False
            if step % LOOK >= each:
                continue
            now = self._data.qpos.reshape(-1, 7).copy()
            if tried is not None and _are_near(tried, now, REST_WAY * self._scale, REST_ANGLE):
                if (self._steps - begun) * STEP_S >= rest_s * self._scale**0.5:
                    self._begin_at(tried, begun)
                    return True
                continue
            if tried is not None:
                self._fall_asleep(True)
            tried, calm = None, [*calm, now] if self._is_slow else []
            if len(calm) >= CALM_LOOKS and _are_near(calm[-CALM_LOOKS], now, CALM_WAY, CALM_ANGLE):
                tried, begun, calm = now, self._steps, []
                self._begin_at(now, begun)
                if not rest_s:
                    return True
        return False

    def _begin_at(self, state: Float, steps: int) -> None:
        """Put all bodies, awake and without velocity, into a state (N, 7), and set the number of elapsed steps."""
        self._fall_asleep(False)
        self._data.qpos[:], self._data.qvel[:], self._steps = state.ravel(), 0.0, steps
        self._mujoco.mj_forward(self._model, self._data)

    @property
    def _is_slow(self) -> bool:
        speeds = np.abs(self._data.qvel.reshape(-1, 6))
        return bool(speeds[:, :3].max() < CALM_SPEED and speeds[:, 3:].max() < CALM_TURN)

    @property
    def speed(self) -> float:
        """Speed of the fastest body, metres a second."""
        return float(np.linalg.norm(self._data.qvel.reshape(-1, 6)[:, :3], axis=1).max()) / self._scale**0.5

    @property
    def poses(self) -> tuple[Matrix4, ...]:
        """World from body of each, to 1e-10 m."""
        return tuple(_matrix(row, self._scale) for row in self._data.qpos.reshape(-1, 7))

    @property
    def states(self) -> Float:
        """World from body of each: x, y, z in metres and a quaternion w, x, y, z, (N, 7)."""
        rows = self._data.qpos.reshape(-1, 7).copy()
        rows[:, :3] /= self._scale
        return rows

    @property
    def deepest(self) -> float:
        """Largest overlap of awake bodies with one another, boards or the floor, metres."""
        distances = self._data.contact.dist[: self._data.ncon]
        return max(0.0, -float(distances.min())) / self._scale if len(distances) else 0.0

    @property
    def touching(self) -> frozenset[tuple[int, int]]:
        """Pairs of numbers of touching bodies, at least one of them awake, the lower number first; -1 stands for fixed
        objects.
        """
        owner = self._model.geom_bodyid - 1
        pairs = self._data.contact.geom[: self._data.ncon]
        owner[owner >= self._bodies] = -1  # fixed objects
        return frozenset((int(min(p)), int(max(p))) for p in owner[pairs])


def _are_near(before: Float, now: Float, way: float, angle: float) -> bool:
    """Return whether all bodies moved and turned by less than these limits between two states (N, 7)."""
    gone = np.linalg.norm(now[:, :3] - before[:, :3], axis=1)
    half = np.abs((now[:, 3:] * before[:, 3:]).sum(axis=1)).clip(0, 1)
    return bool(gone.max() < way and 2 * np.arccos(half.min()) < angle)


def _contact(touch: Touch) -> dict[str, Any]:
    """A contact's settings: a spring of equal stiffness whatever its damping."""
    ratio = touch.damping_ratio
    return {
        "solref": [SOFT_S / ratio, ratio],
        "solimp": [STIFF, STIFF, 0.001, 0.5, 2],
        "friction": [touch.friction, SPINNING, 0.0],
        "condim": 4,
        "margin": 0.0,
    }


def _matrix(row: Float, scale: float) -> Matrix4:
    turn = np.round(matrix_from_quaternion(row[3:]), 12) + 0.0
    x, y, z = (np.round(row[:3] / scale, 10) + 0.0).tolist()
    (a, b, c), (d, e, f), (g, h, i) = turn.tolist()
    return ((a, b, c, x), (d, e, f, y), (g, h, i, z), (0.0, 0.0, 0.0, 1.0))
