"""What the exact runner accepts: spheres among flat walls, without friction. Everything else is declared with why."""

from __future__ import annotations

import itertools

import numpy as np
from impactbench.reference.particles import check, check_contact
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import UPRIGHT, Body, Box, Contact, HalfSpace, Law, Model, Scene, Sphere

OVERLAP = 1e-10
"""Overlap at t = 0, next to the scene's length, that counts as round-off."""


def check_scene(scene: Scene, law: Law, model: Model) -> None:
    """ValueError for numbers that make no sense, `Unsupported` for what this runner does not do."""
    for body in scene.bodies:
        check(body)
        check_body(body, model)
    contacts = {scene.contact, *(contact for _, _, contact in scene.pairs)}
    for contact in contacts:
        check_contact(scene.name, contact)
    if scene.model.rotation:
        raise Unsupported("the exact runner moves particles; this scene needs rotation")
    if scene.collide:
        check_contacts(contacts, law, model)
        check_lines(scene, model)


def check_body(body: Body, model: Model) -> None:
    match body.shape:
        case Sphere():
            off = [axis for axis in range(3) if axis not in model.axes and body.velocity[axis] != 0]
            if off and not body.static:
                raise ValueError(f"body {body.name!r}: velocity {body.velocity} leaves the modelled axes {model.axes}")
        case HalfSpace(normal):
            across = [axis for axis in range(3) if axis not in model.axes and normal[axis] != 0]
            if across and any(normal[axis] for axis in model.axes):
                raise Unsupported(f"body {body.name!r}: normal {normal} pushes off the modelled axes {model.axes}")
        case Box() if not body.static:
            raise Unsupported(f"body {body.name!r}: the exact runner moves spheres only")
        case Box() if body.orientation != UPRIGHT:
            raise Unsupported(f"body {body.name!r}: the exact runner handles axis-aligned boxes only")
        case Box():
            pass
        case _:
            raise Unsupported(f"body {body.name!r}: the exact runner has no {type(body.shape).__name__.lower()}")


def check_contacts(contacts: set[Contact], law: Law, model: Model) -> None:
    """Friction and, in the full model, whatever would spin a ball."""
    if any((contact.friction if law == "nc" else contact.viscosity) > 0 for contact in contacts):
        raise Unsupported("the exact runner is frictionless: sliding friction bends the paths between events")
    if model.rotation and model.dimension > 1 and law == "doc" and any(c.bounciness < 1 for c in contacts):
        raise Unsupported("rule R14 would spin the balls of the full model; the exact runner moves particles")


def check_lines(scene: Scene, model: Model) -> None:
    """Spheres must start apart, and meet along the modelled axes only."""
    spheres = [body for body in scene.bodies if isinstance(body.shape, Sphere)]
    places = np.array([body.position for body in spheres]).reshape(-1, 3)
    radii = np.array([body.shape.radius for body in spheres if isinstance(body.shape, Sphere)])
    still = np.array([body.static for body in spheres])
    fixed = [axis for axis in range(3) if axis not in model.axes]
    if len(spheres) > 1 and np.ptp(places[:, fixed], axis=0).any():
        raise Unsupported(f"spheres side by side would push one another off the modelled axes {model.axes}")
    allowed = OVERLAP * scene.length
    for i in range(len(spheres) - 1):
        gaps = np.linalg.norm(places[i + 1 :] - places[i], axis=1) - radii[i + 1 :] - radii[i]
        for k in np.nonzero((gaps < -allowed) & ~(still[i + 1 :] & still[i]))[0]:
            _refuse(spheres[i], spheres[i + 1 + int(k)], -float(gaps[k]))
    if (radii == 0).sum() > 1:
        raise Unsupported("two points (radius 0) have no normal to collide along")
    for wall, ball in itertools.product((b for b in scene.bodies if b.static), (b for b in spheres if not b.static)):
        gap = _gap(wall, ball)
        if gap < -allowed:
            _refuse(wall, ball, -gap)


def _gap(wall: Body, ball: Body) -> float:
    assert isinstance(ball.shape, Sphere)
    away = np.array(ball.position) - np.array(wall.position)
    match wall.shape:
        case HalfSpace(normal):
            return float(away @ np.array(normal)) - ball.shape.radius
        case Box(half):
            beyond = np.maximum(np.abs(away) - np.array(half), 0)
            return float(np.linalg.norm(beyond)) - ball.shape.radius
        case _:
            return 0.0


def _refuse(one: Body, other: Body, depth: float) -> None:
    raise Unsupported(f"bodies {one.name!r} and {other.name!r} overlap by {depth:.3g} m at t = 0")
