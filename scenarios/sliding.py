"""Blocks that slide on the floor, an incline or a slab: viscous friction (R5, law `doc`) or Coulomb's (law `nc`)."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import ZERO, Body, Box, Contact, Law, Model, Scene, Vector
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case, Family, Truth

SPEED, MASS, FRICTION, VISCOSITY = 3.0, 1.0, 0.3, 2.0
FLAT = Box((0.2, 0.2, 0.05))  # too low to tip over, where an engine models rotation after all
ANGLES = (10, 15, 18, 25, 40)  # deg; the critical angle atan(mu) is 16.70


def _slide(family: str, parameters: Parameters, velocity: Vector, gravity: Vector, contact: Contact, law: Law) -> Scene:
    """One block on the floor, touching at t = 0. Scales: what it would do in the time without friction."""
    duration = 1.5
    speed = float(np.linalg.norm(velocity)) or gravity[0] * duration
    return Scene(
        name=case_name(family, parameters),
        bodies=(FLOOR, Body("block", FLAT, MASS, (0.0, 0.0, FLAT.half_extents[2]), velocity)),
        duration=duration,
        model=Model((0, 1, 2) if velocity[1] else (0, 2), gravity=True, friction=True),
        length=speed * duration if velocity != ZERO else speed * duration / 2,
        speed=speed,
        energy=MASS * speed**2 / 2,
        gravity=gravity,
        contact=contact,
        laws=(law,),
        phase_free=False,
        parameters=parameters,
    )


def viscous_slide(viscosity: float) -> Case:
    """m dv/dt = -c v (R5): v = v0 exp(-c t/m), distance (m v0/c)(1 - exp(-c t/m)). It never quite stops."""
    scene = _slide(
        "viscous_slide", {"viscosity": viscosity}, (SPEED, 0.0, 0.0), DOWN, Contact(0.0, 0.0, viscosity), "doc"
    )
    start, rate = opening(scene), viscosity / MASS

    def state(time: float) -> State:
        distance = start.velocities * (-math.expm1(-rate * time) / rate)
        return State(start.positions + distance, start.velocities * math.exp(-rate * time))

    return Case(scene, {"doc": Truth("trajectory", state)})


def coulomb_slide(heading: float) -> Case:
    """dv/dt = -mu g against the motion, whatever its `heading` [deg]: at rest after v0/(mu g) and v0^2/(2 mu g)."""
    angle = math.radians(heading)
    velocity = (SPEED * math.cos(angle), SPEED * math.sin(angle), 0.0)
    scene = _slide("coulomb_slide", {"heading": heading}, velocity, DOWN, Contact(0.0, FRICTION), "nc")
    deceleration = -FRICTION * G / SPEED * np.array([velocity])
    stop, still = SPEED / (FRICTION * G), np.zeros((1, 3))
    moving = opening(scene).then(0.0, accelerations=deceleration)
    resting = moving.then(stop, velocities=still, accelerations=still)
    return Case(scene, {"nc": Truth("trajectory", motion([moving, resting]))})


def incline(angle: int) -> Case:
    """From rest under gravity tilted by th = `angle` [deg], the plane staying level.

    Sticks if and only if tan th <= mu, else slides at a = g (sin th - mu cos th).
    """
    along, across = G * math.sin(math.radians(angle)), G * math.cos(math.radians(angle))
    scene = _slide("incline", {"angle": angle}, ZERO, (along, 0.0, -across), Contact(0.0, FRICTION), "nc")
    acceleration = np.array([[max(along - FRICTION * across, 0.0), 0.0, 0.0]])
    return Case(scene, {"nc": Truth("trajectory", motion([opening(scene).then(0.0, accelerations=acceleration)]))})


def sliding_on_slab(friction: str) -> Case:
    """A block m slides on a slab M, the slab on a frictionless floor: both end at m v0/(m + M), by momentum.

    `coulomb`: the slip u = v_m - v_M decays at mu g (1 + m/M), over u0^2/(2 mu g (1 + m/M)).
    `viscous`: exponentially, at the rate c/mu_r (R5).
    """
    law: Law = "nc" if friction == "coulomb" else "doc"
    slab_mass, speed, duration = 2.0, 2.0, 1.5
    rubbing = Contact(0.0, FRICTION) if law == "nc" else Contact(0.0, 0.0, VISCOSITY)
    scene = Scene(
        name=case_name("sliding_on_slab", {"friction": friction}),
        bodies=(
            FLOOR,
            Body("slab", Box((1.0, 0.3, 0.05)), slab_mass, (0.0, 0.0, 0.05)),
            Body("block", Box((0.1, 0.1, 0.05)), MASS, (-0.3, 0.0, 0.15), (speed, 0.0, 0.0)),
        ),
        duration=duration,
        model=Model((0, 2), gravity=True, friction=True),
        length=speed * duration,  # what the block would travel without friction
        speed=speed,
        energy=MASS * speed**2 / 2,
        gravity=DOWN,
        contact=Contact(0.0),
        pairs=(("slab", "block", rubbing),),
        laws=(law,),
        phase_free=False,
        parameters={"friction": friction},
    )
    return Case(scene, {law: _coulomb_slab(scene) if law == "nc" else _viscous_slab(scene)})


def _coulomb_slab(scene: Scene) -> Truth:
    slab, block = (scene.bodies[i].mass or math.inf for i in scene.movable)
    start = opening(scene)
    stop = start.velocities[1, 0] / (FRICTION * G * (1 + block / slab))
    pull = FRICTION * G * np.array([[block / slab, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    together: Floats = np.tile(block / (slab + block) * start.velocities[1], (2, 1))
    moving = start.then(0.0, accelerations=pull)
    joined = moving.then(float(stop), velocities=together, accelerations=np.zeros((2, 3)))
    return Truth("trajectory", motion([moving, joined]))


def _viscous_slab(scene: Scene) -> Truth:
    slab, block = (scene.bodies[i].mass or math.inf for i in scene.movable)
    start, total = opening(scene), slab + block
    slip = start.velocities[1]
    rate = VISCOSITY * total / (slab * block)
    shares = np.array([[-block / total], [slab / total]])  # of the slip, about the common centre of mass

    def state(time: float) -> State:
        centre = block / total * slip
        slipped = slip * (-math.expm1(-rate * time) / rate)
        velocities = centre + shares * slip * math.exp(-rate * time)
        return State(start.positions + centre * time + shares * slipped, velocities)

    return Truth("trajectory", state)


FAMILIES = (
    Family(
        "viscous_slide",
        "Does viscous friction decay exponentially, without overshoot?",
        "1 dimension and a floor, viscous friction",
        lambda: [viscous_slide(c) for c in (0.5, 2.0, 10.0)],
    ),
    Family(
        "coulomb_slide",
        "Does a block stop where Coulomb says, whatever its heading?",
        "2 or 3 dimensions, Coulomb friction",
        lambda: [coulomb_slide(heading) for heading in (0.0, 22.5, 45.0)],
    ),
    Family(
        "incline",
        "Does a block stick up to the critical angle and slide at the right rate beyond it?",
        "2 dimensions, Coulomb friction",
        lambda: [incline(angle) for angle in ANGLES],
    ),
    Family(
        "sliding_on_slab",
        "Does friction between two movable bodies keep momentum and find the common speed?",
        "2 dimensions, two-way friction",
        lambda: [sliding_on_slab("coulomb"), sliding_on_slab("viscous")],
    ),
)
