"""Boxes that lean, tip and overhang: statics with a margin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from impactbench.scenarios.flight import G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.hard_stacks import PLANAR, stack_scene
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import exponential
from impactbench.scenarios.records import ZERO, Body, Box, Contact, HalfSpace, Scene, Vector
from impactbench.scenarios.survival import (
    Criterion,
    HardFamily,
    Knob,
    at_end,
    at_rest,
    hard_family,
    invariant,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case


def cases(key: str, outcomes: dict[str, tuple[float, ...]]) -> list[Parameters]:
    """Parameters of the cases: values of `key`, by what is expected of them."""
    return [{key: value, "expect": expect} for expect, values in outcomes.items() for value in values]


def turned_by(trajectory: Trajectory) -> Floats:
    """Angle [rad] each body has turned since the start, shape [T, n]."""
    assert trajectory.orientations is not None
    cosine = np.abs((trajectory.orientations * trajectory.orientations[0]).sum(axis=2))
    return np.asarray(2 * np.arccos(np.clip(cosine, 0.0, 1.0)))


TIPPING = 0.1, 0.2  # half width and half height [m]
TIPS_AT = math.degrees(math.atan(TIPPING[0] / TIPPING[1]))


def tipping(angle: float, expect: str) -> Case:
    """A box on a plane that gravity leans by `angle` [deg]; friction .8 holds it, so that it tips from atan(w/h) on.

    Leaning gravity is the same as a tilted plane, and statics never move.
    """
    half_width, half_height = TIPPING
    lean = math.radians(angle)
    parameters: Parameters = {"angle": angle, "expect": expect}
    box = Body("box", Box((half_width, half_width, half_height)), 1.0, (0.0, 0.0, half_height))
    scene = Scene(
        name=case_name("tipping", parameters),
        bodies=(FLOOR, box),
        duration=3.0,
        model=PLANAR,
        length=2 * half_height,
        speed=math.sqrt(2 * G * half_height),
        energy=G * half_height,
        gravity=(G * math.sin(lean), 0.0, -G * math.cos(lean)),
        contact=Contact(0.0, 0.8),
        laws=("nc",),
        phase_free=False,
        parameters=parameters,
    )
    truth = {"nc": at_rest(scene)} if expect == "stand" else invariant(scene)
    return Case(scene, {law: truth[law] for law in scene.laws})


def tipping_criteria(scene: Scene) -> tuple[Criterion, ...]:
    lean = math.radians(float(scene.parameters["angle"]))
    corner = math.atan(TIPPING[0] / TIPPING[1])

    def tilt(_: Scene, trajectory: Trajectory) -> Floats:
        return np.asarray(turned_by(trajectory)[:, 0] / max(corner - lean, math.radians(1)))

    def upright(_: Scene, trajectory: Trajectory) -> Floats:
        return at_end(trajectory, math.radians(45) / max(float(turned_by(trajectory)[-1, 0]), 1e-6))

    if scene.parameters["expect"] == "stand":
        why = (
            "statics: the box falls back until it has turned by atan(w/h) less the lean (at least 1 degree is granted)"
        )
        return (Criterion("stands", "the box does not tip", 1.0, why, tilt),)
    why = "gravity points past the edge: I a = m g d sin(excess) turns it by far more than 45 degrees within the run"
    return (Criterion("tips", "the box tips over", 1.0, why, upright),)


BOOK = (0.5, 0.25, 0.05)  # half extents [m]


def overhang(count: int, fraction: float, expect: str) -> Case:
    """Books, each shifted over the one below by `fraction` of L/(2 k), k counted from the top.

    The centre of mass of the top k then lies at `fraction` of the way to the edge of the next: it stands below 1, where
    the whole overhang is L/2 sum 1/k, and falls above.
    """
    parameters: Parameters = {"count": count, "fraction": fraction, "expect": expect}
    x, bodies = 0.0, []
    for i in range(count):
        bodies.append(Body(f"book {i}", Box(BOOK), 1.0, (x, 0.0, BOOK[2] * (2 * i + 1))))
        x += fraction * BOOK[0] / (count - 1 - i) if i < count - 1 else 0.0
    scene = stack_scene("overhang", parameters, bodies, PLANAR, 4.0)
    truth = {"nc": at_rest(scene)} if expect == "stand" else invariant(scene)
    return Case(scene, {law: truth[law] for law in scene.laws})


def sunk(_: Scene, trajectory: Trajectory) -> Floats:
    """Largest loss of height since the start, in thicknesses of a book."""
    heights = trajectory.positions[:, :, 2]
    return np.asarray((heights[0] - heights).max(axis=1) / (2 * BOOK[2]))


def still_up(scene: Scene, trajectory: Trajectory) -> Floats:
    return at_end(trajectory, 1 / max(float(sunk(scene, trajectory)[-1]), 1e-6))


def overhang_criteria(scene: Scene) -> tuple[Criterion, ...]:
    if scene.parameters["expect"] == "stand":
        why = "every centre of mass lies over its support: nothing falls, not even by the thickness of a book"
        return (Criterion("stands", "the stack stands", 1.0, why, sunk),)
    why = "every centre of mass lies past its edge: books fall by more than their thickness"
    return (Criterion("falls", "the stack falls", 1.0, why, still_up),)


def pyramid(rows: int) -> Case:
    """Unit boxes, each on two, 2 cm between neighbours: stands by weight alone, without friction."""
    half, gap = 0.5, 0.02
    parameters: Parameters = {"rows": rows}
    bodies = [
        Body(
            f"box {row}.{k}",
            Box((half, half, half)),
            1.0,
            ((k - (rows - row - 1) / 2) * (2 * half + gap), 0.0, half * (2 * row + 1)),
        )
        for row in range(rows)
        for k in range(rows - row)
    ]
    scene = stack_scene("pyramid", parameters, bodies, PLANAR, 5.0)
    return Case(scene, {"nc": at_rest(scene)})


def strayed(scene: Scene, trajectory: Trajectory) -> Floats:
    """Largest distance of a body from its place, in half boxes."""
    away = np.linalg.norm(trajectory.positions - trajectory.positions[0], axis=2).max(axis=1)
    return np.asarray(away / (scene.length / 2))


BEAM = (0.5, 0.1, 0.02)  # half extents [m]: along the beam, across the plane, thickness
LEAN = math.radians(60)
HOLDS_AT = 1 / (2 * math.tan(LEAN)) - BEAM[2] / (2 * BEAM[0])


def arch(friction: float, expect: str) -> Case:
    """Half of an arch of two leaning beams; its plane of symmetry is a smooth wall.

    Beam of length L and thickness t at angle a: foot and head are the ends of its lower face. The floor carries the
    weight W, the wall the thrust H. Moments about the foot: H L sin a = W (L/2 cos a - t/2 sin a), and it stands iff
    friction >= H/W = cot(a)/2 - t/(2 L).
    """
    long, _, thick = BEAM
    parameters: Parameters = {"friction": friction, "expect": expect}
    along = np.array([math.cos(LEAN), 0.0, math.sin(LEAN)])
    across = np.array([-math.sin(LEAN), 0.0, math.cos(LEAN)])
    foot = -long * along - thick * across
    head = long * along - thick * across
    centre: Vector = (float(-head[0]), 0.0, float(-foot[2]))
    w, x, y, z = (float(q) for q in exponential(np.array([0.0, -LEAN, 0.0])))  # x to along
    beam = Body("beam", Box(BEAM), 1.0, centre, orientation=(w, x, y, z))
    wall = Body("wall", HalfSpace((-1.0, 0.0, 0.0)), None, ZERO)
    scene = stack_scene("arch", parameters, [beam], PLANAR, 2.0, friction)
    scene = replace(scene, bodies=(*scene.bodies, wall), pairs=(("wall", "beam", Contact(0.0, 0.0)),))
    truth = {"nc": at_rest(scene)} if expect == "stand" else invariant(scene)
    return Case(scene, {law: truth[law] for law in scene.laws})


def lowered(_: Scene, trajectory: Trajectory) -> Floats:
    """Loss of height since the start, in halves of the height at the start."""
    height = trajectory.positions[:, 0, 2]
    return np.asarray((height[0] - height) / (height[0] / 2))


def arch_criteria(scene: Scene) -> tuple[Criterion, ...]:
    if scene.parameters["expect"] == "stand":
        why = "friction carries the thrust: the beam keeps its height, of which losing half is lying down"
        return (Criterion("stands", "the arch stands", 1.0, why, lowered),)

    def standing(scene: Scene, trajectory: Trajectory) -> Floats:
        return at_end(trajectory, 1 / max(float(lowered(scene, trajectory)[-1]), 1e-6))

    why = "friction does not carry the thrust: the foot slides until the beam lies"
    return (Criterion("falls", "the arch falls", 1.0, why, standing),)


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "tipping",
        "Does a box tip where its weight passes its edge, and not before?",
        "2 dimensions with rotation, friction, lasting contact",
        tipping,
        tipping_criteria,
        cases("angle", {"stand": (20.0, 25.0, 26.0), "tip": (27.5, 30.0, 35.0)}),
        knob=Knob("angle", 5.0, 45.0, "linear", fixed={"expect": "stand"}, truth=TIPS_AT),
    ),
    hard_family(
        "overhang",
        "How far may a stack of books lean over?",
        "2 dimensions with rotation, friction, lasting contact",
        overhang,
        overhang_criteria,
        [
            {"count": 4, "fraction": 0.9, "expect": "stand"},
            {"count": 4, "fraction": 0.98, "expect": "stand"},
            {"count": 4, "fraction": 1.1, "expect": "fall"},
            {"count": 8, "fraction": 0.9, "expect": "stand"},
        ],
        full=({"count": 20, "fraction": 0.9, "expect": "stand"},),
        knob=Knob("fraction", 0.5, 1.5, "linear", fixed={"count": 4, "expect": "stand"}, truth=1.0),
        seconds=30.0,
    ),
    hard_family(
        "pyramid",
        "Does a pyramid of boxes stand?",
        "2 dimensions with rotation, friction, lasting contact",
        pyramid,
        lambda _: (
            Criterion(
                "stands",
                "every box stays in its place",
                1.0,
                "every box rests with its weight between two supports; half a box away it has left one of them",
                strayed,
            ),
        ),
        [{"rows": rows} for rows in (3, 5, 7)],
        full=({"rows": 15},),
        knob=Knob("rows", 2, 20, "int"),
        policies=("mujoco/cushion",),
        seconds=120.0,
    ),
    hard_family(
        "arch",
        "Does half an arch stand where friction carries its thrust, and only there?",
        "2 dimensions with rotation, friction, two lasting contacts",
        arch,
        arch_criteria,
        cases("friction", {"stand": (0.54, 0.32, 0.28), "fall": (0.255, 0.21, 0.13)}),
        knob=Knob("friction", 0.05, 1.0, "linear", breaks="below", fixed={"expect": "stand"}, truth=HOLDS_AT),
    ),
)
