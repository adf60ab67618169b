"""How engines combine the coefficients of two surfaces, measured on their own calls, past the adapters.

Each probe returns, for two coefficients in both orders, what came out: restitution of two balls and of a ball and a
wall without gravity, friction of a block on a plane. None where the engine has no such coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

BOUNCE = (0.5, 0.8)
ROUGH = (0.2, 0.6)
STEP = 1 / 240
GRAVITY = 9.81
SPEED = 5.0
SLIDE_STEPS = 60
"""A quarter of a second: at the largest sum of the two frictions, 0.8, the block loses 2 of its 5 m/s."""
Measured = tuple[float, float] | None


def measure(engine: str) -> dict[str, Measured]:
    """What a probe finds, in both orders of the two surfaces; runs in a child process."""
    bounce, slide = PROBES[engine]
    walls: dict[str, Callable[..., float] | None] = {"balls": bounce, "wall": bounce}
    found: dict[str, Measured] = {
        name: None if call is None else (call(*BOUNCE, name == "wall"), call(*BOUNCE[::-1], name == "wall"))
        for name, call in walls.items()
    }
    return found | {"friction": (slide(*ROUGH), slide(*ROUGH[::-1]))}


def _bullet() -> Any:
    import pybullet as pb

    pb.connect(pb.DIRECT) if not pb.isConnected() else pb.resetSimulation()
    pb.setTimeStep(STEP)
    # Else overlaps are pushed apart with speed, which reads as restitution.
    pb.setPhysicsEngineParameter(
        restitutionVelocityThreshold=0.0, contactSlop=0.0, useSplitImpulse=1, splitImpulsePenetrationThreshold=0.0
    )
    return pb


def _bullet_bounce(first: float, second: float, wall: bool) -> float:
    pb = _bullet()
    ball = pb.createCollisionShape(pb.GEOM_SPHERE, radius=0.5)
    other = pb.createCollisionShape(pb.GEOM_PLANE, planeNormal=(1, 0, 0)) if wall else ball
    mover = pb.createMultiBody(1.0, ball, -1, (1.0, 0, 0), useMaximalCoordinates=True)
    target = pb.createMultiBody(0.0 if wall else 1.0, other, -1, (0.0 if wall else -1.0, 0, 0), useMaximalCoordinates=1)
    for body, coefficient in ((mover, first), (target, second)):
        pb.changeDynamics(
            body, -1, restitution=coefficient, linearDamping=0, angularDamping=0, contactProcessingThreshold=0
        )
    pb.resetBaseVelocity(mover, (-1.0, 0, 0))
    for _ in range(480):
        pb.stepSimulation()
    return float(pb.getBaseVelocity(mover)[0][0] - pb.getBaseVelocity(target)[0][0])


def _bullet_slide(block_friction: float, plane_friction: float) -> float:
    pb = _bullet()
    pb.setGravity(0, 0, -GRAVITY)
    plane = pb.createMultiBody(0.0, pb.createCollisionShape(pb.GEOM_PLANE))
    shape = pb.createCollisionShape(pb.GEOM_BOX, halfExtents=(0.5, 0.5, 0.25))
    block = pb.createMultiBody(1.0, shape, -1, (0, 0, 0.25))
    pb.changeDynamics(plane, -1, lateralFriction=plane_friction)
    pb.changeDynamics(block, -1, lateralFriction=block_friction, linearDamping=0, localInertiaDiagonal=(0, 0, 0))
    pb.resetBaseVelocity(block, (SPEED, 0, 0))
    for _ in range(SLIDE_STEPS):
        pb.stepSimulation()
    velocity = pb.getBaseVelocity(block)[0]
    return _friction(float(velocity[0]), float(velocity[2]))


def _munk_space(gravity: float) -> Any:
    import pymunk

    space = pymunk.Space()
    space.gravity, space.collision_slop = (0.0, -gravity), 1e-4
    return space


def _munk_bounce(first: float, second: float, wall: bool) -> float:
    import pymunk

    space = _munk_space(0.0)
    mover, target = pymunk.Body(1.0, 0.1), space.static_body if wall else pymunk.Body(1.0, 0.1)
    mover.position, mover.velocity = (1.0, 0.0), (-1.0, 0.0)
    shapes = [pymunk.Circle(mover, 0.5)]
    if wall:
        shapes.append(pymunk.Poly(target, [(0, -5), (0, 5), (-5, 5), (-5, -5)]))
    else:
        target.position = (-1.0, 0.0)
        shapes.append(pymunk.Circle(target, 0.5))
        space.add(target)
    for shape, coefficient in zip(shapes, (first, second), strict=True):
        shape.elasticity = coefficient
    space.add(mover, *shapes)
    for _ in range(480):
        space.step(STEP)
    return float(mover.velocity.x - target.velocity.x)


def _munk_slide(block_friction: float, plane_friction: float) -> float:
    import pymunk

    space = _munk_space(GRAVITY)
    block = pymunk.Body(1.0, math.inf)
    block.position, block.velocity = (0.0, 0.25), (SPEED, 0.0)
    box = pymunk.Poly.create_box(block, (1.0, 0.5))
    plane = pymunk.Poly(space.static_body, [(-50, -10), (50, -10), (50, 0), (-50, 0)])
    box.friction, plane.friction = block_friction, plane_friction
    space.add(block, box, plane)
    for _ in range(SLIDE_STEPS):
        space.step(STEP)
    return _friction(float(block.velocity.x), float(block.velocity.y))


def _mujoco_slide(block_friction: float, plane_friction: float) -> float:
    import mujoco as mj

    joints = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
    box = f'<geom type="box" size=".5 .5 .25" mass="1" friction="{block_friction}"/>'
    # The block starts at the depth where it rests, so that its weight is carried from the first step on.
    model = mj.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}" gravity="0 0 {-GRAVITY}" cone="elliptic"/><worldbody>'
        f'<geom type="plane" size="0 0 1" friction="{plane_friction}"/>'
        f'<body pos="0 0 .25">{joints}{box}</body></worldbody></mujoco>'
    )
    data = mj.MjData(model)
    mj.mj_step(model, data, 480)  # to rest, at the depth where the contact carries the weight
    data.qvel[0] = SPEED
    mj.mj_step(model, data, SLIDE_STEPS)
    return _friction(float(data.qvel[0]), float(data.qvel[1]))


def _friction(left: float, rising: float) -> float:
    """Tangential over normal impulse, from the velocities [m/s] left: a block that hops was pushed harder meanwhile."""
    return (SPEED - left) / (GRAVITY * SLIDE_STEPS * STEP + rising)


PROBES: dict[str, tuple[Callable[[float, float, bool], float] | None, Callable[[float, float], float]]] = {
    "pybullet": (_bullet_bounce, _bullet_slide),
    "mujoco": (None, _mujoco_slide),  # restitution has no coefficient there
    "pymunk": (_munk_bounce, _munk_slide),
}
