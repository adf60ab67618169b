"""A scene of particles as flat arrays: what the stepped runner's kernels work on, checked once at the door."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import UPRIGHT, Body, Box, Capsule, Contact, HalfSpace, Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import Floats
from numpy.typing import NDArray

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]

SPHERE, BOX, HALF_SPACE = 0, 1, 2


class Bodies(NamedTuple):
    """All bodies of a scene, static ones included with inverse mass 0. SI units, shapes [n] and [n, 3]."""

    position: Floats
    velocity: Floats
    inverse_mass: Floats
    shape: Indices
    size: Floats
    """Radius in the first column, half extents, or the half-space's normal."""
    debt: Floats
    """Energy [J] that lifts added and no approach has paid back yet."""
    seen: Floats
    """Positions at the last look, from which travel is counted."""


class Pairs(NamedTuple):
    """Handled pairs (documents, rule R2) that may touch soon, with their coefficients and the memory of their contacts.
    Shapes [p] and [p, 3].
    """

    first: Indices
    second: Indices
    bounciness: Floats
    friction: Floats
    viscosity: Floats
    gap: Floats
    """Distance [m] of the surfaces, negative where they overlap; `normal` points from first to second."""
    normal: Floats
    touching: Flags
    touched: Flags
    """Whether the pair touched in the previous step: from then on it is a lasting contact."""
    reach: Floats
    """Gap [m] a reverted pair was put back to and at which it still counts as touching."""
    slow: Floats
    """Approach speed [m/s] that gravity along the normal alone explains, of the pairs that touch."""
    push: Floats
    """Normal impulse [N s] of the last step, the first guess of the next."""
    rub: Floats
    parted: Floats
    """How far [m] the last projection pushed the pair apart."""
    clear: Floats
    """Reading of the odometer up to which the pair surely is apart: two bodies close in by their own travel at most."""
    odometer: Floats
    """Twice the largest travel [m] of any body, summed from look to look; one number."""


def build_bodies(scene: Scene) -> Bodies:
    """Arrays of the scene's bodies, or one ValueError that names the body and the field that make no sense."""
    for body in scene.bodies:
        check(body)
    bodies = scene.bodies
    return Bodies(
        position=np.array([b.position for b in bodies], dtype=np.float64).reshape(-1, 3),
        velocity=np.array([(0.0, 0.0, 0.0) if b.static else b.velocity for b in bodies], dtype=np.float64).reshape(
            -1, 3
        ),
        inverse_mass=np.array([0.0 if b.mass is None else 1 / b.mass for b in bodies], dtype=np.float64),
        shape=np.array([_shape(b)[0] for b in bodies], dtype=np.int64),
        size=np.array([_shape(b)[1] for b in bodies], dtype=np.float64).reshape(-1, 3),
        debt=np.zeros(len(bodies)),
        seen=np.array([b.position for b in bodies], dtype=np.float64).reshape(-1, 3),
    )


def check(body: Body) -> None:
    """Refuse numbers that no body can have."""
    if body.mass is not None and not (math.isfinite(body.mass) and body.mass > 0):
        raise ValueError(f"body {body.name!r}: mass {body.mass} must be positive and finite")
    for field in ("position", "velocity", "orientation", "spin"):
        values = getattr(body, field)
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"body {body.name!r}: {field} {values} must be finite")
    if not abs(math.hypot(*body.orientation) - 1) < 1e-9:
        raise ValueError(f"body {body.name!r}: orientation {body.orientation} must have length 1")
    match body.shape:
        case Sphere(radius) | Capsule(radius, _) if not (math.isfinite(radius) and radius >= 0):
            raise ValueError(f"body {body.name!r}: radius {radius} must be finite and not negative")
        case Capsule(_, half) if not (math.isfinite(half) and half >= 0):
            raise ValueError(f"body {body.name!r}: half_length {half} must be finite and not negative")
        case Box(half) if not all(math.isfinite(value) and value >= 0 for value in half):
            raise ValueError(f"body {body.name!r}: half_extents {half} must be finite and not negative")
        case HalfSpace(normal) if not abs(math.hypot(*normal) - 1) < 1e-9:
            raise ValueError(f"body {body.name!r}: normal {normal} must have length 1")
        case HalfSpace() if not body.static:
            raise ValueError(f"body {body.name!r}: mass {body.mass} given, but a half-space is static")


def check_contact(scene: str, contact: Contact) -> None:
    """Refuse coefficients outside their range."""
    if not 0 <= contact.bounciness <= 1:
        raise ValueError(f"{scene}: bounciness {contact.bounciness} must lie in [0, 1]")
    for field in ("friction", "viscosity"):
        value = getattr(contact, field)
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{scene}: {field} {value} must be finite and not negative")


def check_supported(scene: Scene, law: Law, model: Model) -> None:
    """Raise `Unsupported` where the effect needs spin, which particles do not have."""
    if scene.model.rotation:
        raise Unsupported("the stepped runner moves particles; this scene needs rotation")
    # Central frictionless impacts cannot spin a ball: the full model then differs from the particle one in nothing.
    if model.rotation and scene.model.dimension > 1 and any(isinstance(b.shape, Sphere) for b in scene.bodies):
        contacts = [scene.contact, *(contact for _, _, contact in scene.pairs)]
        if law == "nc" and any(c.friction > 0 for c in contacts):
            raise Unsupported("friction would spin the balls of the full model; the stepped runner moves particles")
        if law == "doc" and any(c.bounciness < 1 or c.viscosity > 0 for c in contacts):
            raise Unsupported("rule R14 would spin the balls of the full model; the stepped runner moves particles")


def _shape(body: Body) -> tuple[int, tuple[float, float, float]]:
    match body.shape:
        case Sphere(radius):
            return SPHERE, (radius, 0.0, 0.0)
        case HalfSpace(normal):
            return HALF_SPACE, normal
        case Box(half) if body.orientation == UPRIGHT:
            return BOX, half
        case Box():
            raise Unsupported(f"body {body.name!r}: the stepped runner handles axis-aligned boxes only")
        case _:
            raise Unsupported(f"body {body.name!r}: the stepped runner has no {type(body.shape).__name__.lower()}")
