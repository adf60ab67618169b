"""A scene as the exact runner's flat arrays: spheres with times of their own, and walls. Checked once at the door."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.events_cells import Cells, build_cells
from impactbench.reference.events_queue import Queue, build_queue
from impactbench.reference.exact_walls import Walls, build_walls
from impactbench.reference.particles import Flags, Indices
from impactbench.scenarios.records import Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import Floats

REST, STILL, TOUCH, INSTANT, CLOSED, RISE = 1e-10, 1e-13, 1e-10, 1e-13, 1e-13, 1e-14
"""Next to the scene's scales: speed off a wall below which a pressed body rests, speed that counts as none, gap that
counts as touching at t = 0, span of time that counts as one instant, gap that counts as closed in it, and height of an
elastic bounce that counts as rest."""


SPEED, TIME, RADIUS = 3, 6, 7
"""Columns of `Spheres.motion`; velocity begins at SPEED, position at 0."""


class Spheres(NamedTuple):
    """Movable spheres first, in scene order, then static ones with inverse mass 0. SI units, shapes [n] and [n, 3].

    motion [n, 8]: position, velocity, time and radius, in one line of the processor's cache; `SPEED`, `TIME` and
    `RADIUS` are its columns. Position and velocity are those at the body's own time [s]; from there on it flies at
    constant acceleration. rests [n, walls]: walls the body rests on. events: number of changes of its motion, which
    outdates predictions made before. contact [s], kind, partner, partner_events: its next contact; leaves: whether
    it leaves its cell before that, on exit_side.
    """

    motion: Floats
    acceleration: Floats
    inverse_mass: Floats
    group: Indices
    rests: Flags
    events: Indices
    contact: Floats
    second: Floats
    """Time [s] of the contact that comes after it, as far as it was looked for."""
    kind: Indices
    partner: Indices
    partner_events: Indices
    leaves: Flags
    exit_side: Indices
    struck: Floats
    """Time [s] of its last impact."""
    crowd: Indices
    """How many events in a row fell on one instant."""


class Rules(NamedTuple):
    """bounciness: table by group of bodies. rest, still [m/s], touch, closed, rise [m], instant [s]: see
    `REST`."""

    gravity: Floats
    pulled: bool
    doc: bool
    collide: bool
    movable: int
    bounciness: Floats
    rest: float
    still: float
    touch: float
    instant: float
    closed: float
    rise: float


class World(NamedTuple):
    spheres: Spheres
    walls: Walls
    rules: Rules
    queue: Queue
    cells: Cells
    tally: Indices
    """Impacts so far: between two spheres, with a wall."""


def build_world(scene: Scene, law: Law, model: Model) -> World:
    """Arrays of a scene that `exact_checks.check_scene` has passed."""
    order = [*scene.movable, *(i for i in scene.statics if isinstance(scene.bodies[i].shape, Sphere))]
    groups, table = bounciness_table(scene)
    carried = np.array([1.0 if axis in model.axes else 0.0 for axis in range(3)])
    gravity = np.array(scene.gravity) * carried
    walls = build_walls(scene, model, groups)
    spheres = build_spheres(scene, order, gravity, groups, len(walls.level))
    return World(
        spheres=spheres,
        walls=walls,
        rules=Rules(
            gravity=gravity,
            pulled=bool(gravity.any()),
            doc=law == "doc",
            collide=scene.collide,
            movable=len(scene.movable),
            bounciness=table,
            rest=REST * scene.speed,
            still=STILL * scene.speed,
            touch=TOUCH * scene.length,
            instant=INSTANT * scene.length / scene.speed,
            closed=CLOSED * scene.length,
            rise=RISE * scene.length,
        ),
        queue=build_queue(len(scene.movable)),
        cells=build_cells(spheres.motion[:, :3], spheres.motion[:, RADIUS], model.axes),
        tally=np.zeros(2, dtype=np.int64),
    )


def build_spheres(scene: Scene, order: list[int], gravity: Floats, groups: list[int], walls: int) -> Spheres:
    bodies, count = [scene.bodies[i] for i in order], len(order)
    still = np.array([body.static for body in bodies])
    motion = np.zeros((count, 8))
    motion[:, :3] = np.array([b.position for b in bodies]).reshape(-1, 3)
    motion[:, SPEED : SPEED + 3] = np.where(still[:, None], 0.0, np.array([b.velocity for b in bodies]).reshape(-1, 3))
    motion[:, RADIUS] = [b.shape.radius for b in bodies if isinstance(b.shape, Sphere)]
    return Spheres(
        motion=motion,
        acceleration=np.where(still[:, None], 0.0, gravity),
        inverse_mass=np.array([0.0 if b.mass is None else 1 / b.mass for b in bodies], dtype=np.float64),
        group=np.array([groups[i] for i in order], dtype=np.int64),
        rests=np.zeros((count, walls), dtype=np.bool_),
        events=np.zeros(count, dtype=np.int64),
        contact=np.full(count, np.inf),
        second=np.full(count, np.inf),
        kind=np.zeros(count, dtype=np.int64),
        partner=np.zeros(count, dtype=np.int64),
        partner_events=np.zeros(count, dtype=np.int64),
        leaves=np.zeros(count, dtype=np.bool_),
        exit_side=np.zeros(count, dtype=np.int64),
        struck=np.zeros(count),
        crowd=np.zeros(count, dtype=np.int64),
    )


def bounciness_table(scene: Scene) -> tuple[list[int], Floats]:
    """Group of every body, and bounciness by two groups. Bodies no pair names share group 0."""
    named = sorted({name for left, right, _ in scene.pairs for name in (left, right)})
    groups = [named.index(body.name) + 1 if body.name in named else 0 for body in scene.bodies]
    table = np.full((len(named) + 1, len(named) + 1), scene.contact.bounciness)
    for left, right, contact in reversed(scene.pairs):  # the first that names a pair holds
        a, b = named.index(left) + 1, named.index(right) + 1
        table[a, b] = table[b, a] = contact.bounciness
    return groups, table
