"""The fast runner around its kernels: which scenes it takes, room for the lists, states in the scene's order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from impactbench.reference.particles import check, check_contact
from impactbench.reference.swarm import (
    BUILDS,
    CLOSING,
    DEEPEST,
    IMPACTS,
    LOOKED,
    NEAR,
    NEAR_SIDES,
    PAIRS,
    SIDES,
    SKIN,
    STIRRED,
    Swarm,
    build_swarm,
    make_lists,
)
from impactbench.reference.swarm_gas import SWEEPS, run, start
from impactbench.reference.swarm_grid import side_gap
from impactbench.scenarios.records import UPRIGHT, Body, Box, HalfSpace, Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import State

ROUND_OFF = 1e-12
"""Next to the scene's length: centres this close to a plane lie in it."""


def why_not(scene: Scene, law: Law, model: Model) -> str:
    """Empty where the light path models all that the scene needs, else what it lacks."""
    contacts = {scene.contact, *(contact for _, _, contact in scene.pairs)}
    if any(c.bounciness != 1 or (c.friction if law == "nc" else c.viscosity) for c in contacts):
        return "impacts that are not elastic, or friction"
    if any(scene.gravity[k] for k in model.axes):
        return "gravity"
    movable = [scene.bodies[i] for i in scene.movable]
    if not movable or not all(isinstance(body.shape, Sphere) for body in movable):
        return "movable bodies other than spheres"
    across = [k for k in range(3) if k not in model.axes]
    level = {k: movable[0].position[k] for k in across}
    flat = all(abs(b.position[k] - level[k]) <= ROUND_OFF * scene.length for b in movable for k in across)
    if not flat or not scene.collide or any(b.velocity[k] for b in movable for k in across):
        return "bodies that pass one another"
    radius = max(b.shape.radius for b in movable if isinstance(b.shape, Sphere))
    if not all(_in_plane(scene.bodies[i], model.axes, level, radius) for i in scene.statics):
        return "statics that stand askew to the axes of motion"
    return ""


def _in_plane(body: Body, axes: tuple[int, ...], level: Mapping[int, float], radius: float) -> bool:
    """Whether the static's cut through the bodies' plane has the distances that it has in space."""
    away = {k: level[k] - body.position[k] for k in level}
    match body.shape:
        case HalfSpace(normal):
            inside = any(normal[k] for k in axes)
            outside = any(normal[k] for k in level)
            clear = sum(normal[k] * away[k] for k in level) >= radius
            return not outside or (not inside and clear)
        case Sphere():
            return not any(away.values())
        case Box(half):
            return body.orientation == UPRIGHT and all(abs(away[k]) <= half[k] for k in level)
        case _:
            return False


class Gas:
    """Elastic spheres, by the light path."""

    def __init__(self, scene: Scene, model: Model, step: float) -> None:
        for body in scene.bodies:
            check(body)
        for contact in {scene.contact, *(contact for _, _, contact in scene.pairs)}:
            check_contact(scene.name, contact)
        movable = [scene.bodies[i] for i in scene.movable]
        self._start = np.array([b.position for b in movable], dtype=np.float64)
        self._axes = list(model.axes)
        self.swarm = prepared(build_swarm(scene, model.axes, float(step)))
        refuse_interlocked(scene, self.swarm)
        self.settings: Mapping[str, object] = {
            "order": "impacts, move, detect, project",
            "broad phase": "cells and neighbour lists, rebuilt after half a skin",
            "touching gap [m]": self.swarm.touch,
            "negligible speed [m/s]": self.swarm.still,
            "sweeps at most": SWEEPS,
        }

    def advance(self, steps: int) -> None:
        self.swarm = advanced(self.swarm, steps)

    def read(self) -> State:
        now, d = self.swarm.now, len(self.swarm.dim)
        x, v = self._start.copy(), np.zeros_like(self._start)
        x[now.label[:, None], self._axes] = now.place.reshape(-1, d + 1)[:, :d]
        v[now.label[:, None], self._axes] = now.velocity.reshape(-1, d + 1)[:, :d]
        return State(x, v)

    def figures(self) -> dict[str, float]:
        """What happened inside the steps, where nobody can look from outside: see `tally`."""
        return tally(self.swarm)


def prepared(swarm: Swarm) -> Swarm:
    """The swarm with its lists built."""
    while not start(swarm):
        swarm = with_room(swarm)
    return swarm


def advanced(swarm: Swarm, steps: int) -> Swarm:
    """The swarm `steps` later."""
    while True:
        done = run(swarm, steps)
        if done == steps:
            return swarm
        steps -= done
        swarm = with_room(swarm)


def with_room(swarm: Swarm) -> Swarm:
    """The swarm with lists half as long again as is known to be needed, and empty: the next step builds them."""
    pairs = max(len(swarm.lists.pairs) // 2, 64 + 3 * int(swarm.tally[PAIRS]) // 2)
    sides = max(len(swarm.lists.sides) // 2, 64 + 3 * int(swarm.tally[SIDES]) // 2)
    swarm.tally[[PAIRS, SIDES, NEAR, NEAR_SIDES, STIRRED]] = 0
    swarm.gauge[SKIN] = -1.0
    return swarm._replace(lists=make_lists(pairs, sides))


def refuse_interlocked(scene: Scene, swarm: Swarm) -> None:
    """Raise ValueError for a body whose centre starts within a static: no projection knows which way is out."""
    statics = swarm.statics
    for p in range(swarm.tally[NEAR_SIDES]):
        row, s = int(swarm.lists.near_sides[2 * p]), int(swarm.lists.near_sides[2 * p + 1])
        d = len(swarm.dim)
        radius = swarm.now.place[row * (d + 1) + d]
        if (
            side_gap(swarm.dim, swarm.now.place, statics.kind, statics.place, statics.size, row, s)[0]
            < -radius - swarm.touch
        ):
            body = scene.bodies[scene.movable[int(swarm.now.label[row])]]
            raise ValueError(f"body {body.name!r}: position {body.position} lies inside a static body")


def tally(swarm: Swarm) -> dict[str, float]:
    """Deepest overlap before projection [m], largest closing speed of a pair that overlapped [m/s], list builds,
    candidate pairs looked at, impacts, and bytes held.
    """
    arrays = [*swarm.now, *swarm.built, *swarm.grid, *swarm.lists]
    return {
        "deepest before projection": float(swarm.gauge[DEEPEST]),
        "largest closing speed": float(swarm.gauge[CLOSING]),
        "builds": float(swarm.tally[BUILDS]),
        "pairs looked at": float(swarm.tally[LOOKED]),
        "impacts": float(swarm.tally[IMPACTS]),
        "bytes": float(sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))),
    }
