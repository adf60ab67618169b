"""What the rigid runner accepts; everything else is declared with why."""

from __future__ import annotations

import math

from impactbench.reference.pairs import handled_pairs
from impactbench.reference.particles import check, check_contact
from impactbench.reference.rigid_contacts import check_pair
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Body, Model, Scene

MOST = 500
"""Movable bodies: all their pairs are kept, and looked through whenever a body has moved by some part of its size."""


def check_rigid(scene: Scene, model: Model, plane: int) -> None:
    """ValueError for numbers that make no sense, `Unsupported` for what this runner does not do."""
    for body in scene.bodies:
        check(body)
        if not body.static:
            check_inertia(body)
    for contact in {scene.contact, *(contact for _, _, contact in scene.pairs)}:
        check_contact(scene.name, contact)
    if model.dimension < 2:
        raise Unsupported("the rigid runner turns bodies in a plane or in space; this scene has one axis")
    if len(scene.movable) > MOST:
        raise Unsupported(f"the rigid runner takes up to {MOST} movable bodies; this scene has {len(scene.movable)}")
    if scene.collide:
        for first, second in handled_pairs(scene.statics, scene.movable):
            check_pair(scene.bodies[first], scene.bodies[second], plane)


def check_inertia(body: Body) -> None:
    """Principal moments must be positive, and no one greater than the sum of the others."""
    moments = body.principal_inertia()
    good = all(math.isfinite(moment) and moment > 0 for moment in moments)
    if not good or 2 * max(moments) > (1 + 1e-9) * sum(moments):
        raise ValueError(f"body {body.name!r}: inertia {moments} must be positive, no moment above the others' sum")
