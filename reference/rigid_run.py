"""The stepped runner for rigid bodies that turn (documents, rules R3, R4, R5 and R14, or Newton-Coulomb).

The order is that of the particles' runner (`stepped`): detect, impacts, gravity, lasting contacts and friction, move,
project. What is finer here:
- The instant of an impact is looked for within the step, so a body that flies into contact does not overlap.
- Between impacts motion is exact but for the turns of three unlike moments (`rigid_motion`).
- Overlap that is left (bodies that turn while they rest) is projected in the metric of kinetic energy, turns included:
  R4's rule for bodies with inertia. Each lift off a static body is owed by the body and taken from its next approach.

Kernels go on until something has to be struck or lifted; impacts are the laws' own (`rigid_strike`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.features import Features, room
from impactbench.reference.pairs import handled_pairs
from impactbench.reference.particles import Indices
from impactbench.reference.rigid_checks import check_rigid
from impactbench.reference.rigid_contact_solve import ROUNDS, SWEEPS, hold
from impactbench.reference.rigid_instant import Way, impact_time
from impactbench.reference.rigid_lift import lift_all as _lift
from impactbench.reference.rigid_motion import ROUND, Steps, move, poses, recalled
from impactbench.reference.rigid_strike import approaching, strike_all
from impactbench.reference.rigid_touches import Couples, Memory, Touches, least_gap, look_around, margin_of, touches_now
from impactbench.reference.solids import SPACE, Solids, build_solids
from impactbench.scenarios.records import Box, Capsule, HalfSpace, Law, Model, Scene, Shape, Sphere
from impactbench.scenarios.trajectory import Floats, State

TOUCH, KEEP, STILL = 1e-10, 1e-6, 1e-13
"""Gap that counts as touching, gap across which a lasting contact is kept (both next to the scene's length), and speed
that counts as none, next to the scene's speed."""
IMPACTS = 100
"""Instants of impact in one step; what falls into a step beyond these is left to projection."""
DONE, STRIKE, LIFT, UNSETTLED = range(4)
"""Why `run` came back."""


class Clock(NamedTuple):
    """Where a run stands: what is left [s] of the step, shape [1]; steps done, instants of impact in this step, and
    whether this instant's contacts are found and struck, shape [3].
    """

    left: Floats
    counts: Indices


class RigidBodies:
    """A scene whose bodies turn: spheres, capsules and boxes, in a plane or in space."""

    def __init__(self, scene: Scene, law: Law, model: Model, step: float) -> None:
        plane = SPACE if model.dimension != 2 else next(k for k in range(3) if k not in model.axes)
        check_rigid(scene, model, plane)
        self._scene, self._law = scene, law
        self._movable = np.array(scene.movable, dtype=np.int64)
        self._steps = steps_of(scene, law, model, step)
        self._solids = build_solids(scene, plane)
        self._solids.velocity[:] *= self._steps.carried
        self._solids.spin[:] *= self._steps.turning
        self._couples = build_couples(scene, self._solids)
        self._width = min((_width(body.shape) for body in scene.bodies), default=math.inf)
        self._clock = Clock(np.array([step]), np.zeros(3, dtype=np.int64))
        look_around(self._solids, self._couples, True)
        self._memory = Memory(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3)))
        self._touches = begin(self._solids, self._couples, self._memory, self._steps)
        count = len(self._touches.key)
        self._memory = Memory(self._touches.key, np.zeros(count), np.zeros((count, 3)))
        self.settings: Mapping[str, object] = {
            "order": "detect, impacts, gravity, lasting contacts and friction, move, project",
            "bodies": "rigid (R14)",
            "impacts": "located within the step",
            "touching gap [m]": self._steps.touch,
            "lasting contacts kept up to [m]": self._steps.keep,
            "negligible speed [m/s]": self._steps.still,
            "sweeps at most": SWEEPS * ROUNDS,
        }

    def advance(self, steps: int) -> None:
        until = self._clock.counts[0] + steps
        why = STRIKE
        while why != DONE:
            why, self._touches, self._memory = run(
                self._solids, self._couples, self._touches, self._memory, self._steps, self._clock, self._width, until
            )
            if why == STRIKE:
                strike_all(self._scene, self._law, self._solids, self._touches, self._steps)
            elif why == LIFT:
                _lift(self._solids, self._couples, self._memory, self._steps)
            elif why == UNSETTLED:
                where = f"{self._scene.name}: t = {self._clock.counts[0] * self._steps.step:.6g} s"
                raise RuntimeError(f"{where}: contacts did not settle within {SWEEPS * ROUNDS} sweeps")

    def read(self) -> State:
        solids, rows = self._solids, self._movable
        return State(solids.position[rows], solids.velocity[rows], solids.orientation[rows], solids.spin[rows])


def steps_of(scene: Scene, law: Law, model: Model, step: float) -> Steps:
    carried = np.array([float(axis in model.axes) for axis in range(3)])
    return Steps(
        step=step,
        gravity=np.array(scene.gravity, dtype=np.float64) * carried,
        carried=carried,
        turning=1 - carried if model.dimension == 2 else np.ones(3),
        doc=law == "doc",
        touch=TOUCH * scene.length,
        keep=KEEP * scene.length,
        still=STILL * scene.speed,
    )


def build_couples(scene: Scene, solids: Solids) -> Couples:
    """The pairs that can interact; two statics are never paired."""
    handled = list(handled_pairs(scene.statics, scene.movable)) if scene.collide else []
    contacts = [scene.contact_of(a, b) for a, b in handled]
    return Couples(
        first=np.array([a for a, _ in handled], dtype=np.int64),
        second=np.array([b for _, b in handled], dtype=np.int64),
        friction=np.array([c.friction for c in contacts], dtype=np.float64),
        viscosity=np.array([c.viscosity for c in contacts], dtype=np.float64),
        near=np.zeros(len(handled), dtype=np.int64),
        listed=np.zeros(1, dtype=np.int64),
        margin=margin_of(solids),
        seen=solids.position.copy(),
    )


def _width(shape: Shape) -> float:
    """Half width [m]: a body that moves less cannot pass another unseen."""
    match shape:
        case Sphere(radius) | Capsule(radius, _):
            return radius
        case Box(half):
            return min(half)
        case HalfSpace():
            return math.inf


@compiled
def begin(solids: Solids, couples: Couples, memory: Memory, steps: Steps) -> Touches:
    """Contacts that touch at t = 0 are lasting ones (documents, rule R3)."""
    return touches_now(solids, couples, memory, room(), steps.touch, steps.keep)


@compiled
def run(
    solids: Solids,
    couples: Couples,
    touches: Touches,
    memory: Memory,
    steps: Steps,
    clock: Clock,
    width: float,
    until: int,
) -> tuple[int, Touches, Memory]:
    """Advance until so many steps are done, or something is to be struck or lifted: returns which, the contacts of this
    instant and the memory of the last.
    """
    found, counts = room(), clock.counts
    enough = max(steps.still, 2 * steps.step * math.sqrt((steps.gravity**2).sum()))
    while counts[0] < until:
        if counts[2] == 0:
            touches = touches_now(solids, couples, memory, found, steps.touch, steps.keep)
            counts[2] = 1
            if approaching(solids, touches, steps, touches.known < 0).any():
                return STRIKE, touches, memory
        counts[2] = 0
        left = clock.left[0]
        closing = np.maximum(0.0, touches.gap - ROUND * steps.touch) / left
        hold(solids, solids.velocity, solids.spin, touches, closing, False, steps.still)
        start = poses(solids)
        after, rest = move(solids, touches, recalled(touches, memory), steps, left)
        if rest > enough:
            return UNSETTLED, touches, memory
        if counts[1] < IMPACTS:
            way = Way(solids, couples, touches, after, start, found)
            time, after = impact_time(way, steps, left, width)
            if time < left:
                memory, clock.left[0] = after, left - time
                counts[1] += 1
                continue
        memory, clock.left[0] = after, steps.step
        counts[0] += 1
        counts[1] = 0
        if overlapping(solids, couples, found, steps):
            return LIFT, touches, memory
    return DONE, touches, memory


@compiled
def overlapping(solids: Solids, couples: Couples, found: Features, steps: Steps) -> bool:
    none = np.zeros(0, dtype=np.int64)
    return least_gap(solids, couples, Memory(none, np.zeros(0), np.zeros((0, 3))), found) < -steps.touch / 2
