"""What a scene file need not say: the laws, the smallest model and the scales, worked out from bodies and contacts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, product

import numpy as np
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Law, Model, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Floats

ROUND_OFF = 1e-12
LONGEST_STEP = 1 / 30
"""[s] No start is shifted by more than a step of the default ladder."""
MOST_BODIES = 10_000
FEW = 500
"""Touching at t = 0 is looked for pair by pair up to this many bodies; more count as touching."""


@dataclass(frozen=True)
class Content:
    """What a scene file always says."""

    bodies: tuple[Body, ...]
    gravity: Vector
    duration: float
    contacts: tuple[Contact, ...]

    @property
    def movable(self) -> list[Body]:
        return [body for body in self.bodies if not body.static]

    @property
    def statics(self) -> list[Body]:
        return [body for body in self.bodies if body.static]


def laws(contacts: Iterable[Contact]) -> tuple[Law, ...]:
    """Viscous friction has a meaning under the documents' law only, Coulomb's under Newton-Coulomb only."""
    all_contacts = list(contacts)
    viscous, rough = any(c.viscosity > 0 for c in all_contacts), any(c.friction > 0 for c in all_contacts)
    if viscous and rough:
        raise ValueError("viscosity is the law doc's alone and friction nc's alone: no law holds both")
    return ("doc",) if viscous else ("nc",) if rough else ("doc", "nc")


def model(content: Content, axes: tuple[int, ...] | None, rotation: bool | None) -> Model:
    """The smallest model that is sure to show the motion; `axes` and `rotation` win where they are given."""
    chosen = axes or motion_axes(content)
    rough = any(c.friction > 0 for c in content.contacts)
    turning = rotation
    if turning is None:
        spinning = any(any(body.spin) for body in content.movable)
        offset = len(chosen) > 1 and (rough or not all(isinstance(b.shape, Sphere) for b in content.movable))
        turning = spinning or offset
    if axes is None and turning and not _turns_in_plane(content, chosen):
        chosen = (0, 1, 2)
    return Model(chosen, rotation=turning, gravity=any(content.gravity), friction=rough)


def motion_axes(content: Content) -> tuple[int, ...]:
    """Axes along which velocities, gravity, normals of planes or the line between two centres point; else all three."""
    centres = np.array([b.position for b in content.bodies if not isinstance(b.shape, HalfSpace)])
    vectors = [content.gravity, *(b.velocity for b in content.movable)]
    vectors += [b.shape.normal for b in content.statics if isinstance(b.shape, HalfSpace)]
    spread = np.ptp(centres, axis=0) > ROUND_OFF * max(float(np.abs(centres).max()), 1e-300)
    pointed = np.abs(vectors).max(axis=0) > 0
    found = tuple(int(k) for k in np.flatnonzero(spread | pointed))
    if not found or any(_tilted(body, found) for body in content.bodies):
        return (0, 1, 2)
    return found


def _tilted(body: Body, axes: tuple[int, ...]) -> bool:
    """Whether the body is turned out of these axes, so that a contact may push along the others too."""
    if isinstance(body.shape, (Sphere, HalfSpace)):
        return False
    allowed = {k + 1 for k in range(3) if len(axes) == 2 and k not in axes}
    return any(abs(body.orientation[k]) > ROUND_OFF for k in (1, 2, 3) if k not in allowed)


def _turns_in_plane(content: Content, axes: tuple[int, ...]) -> bool:
    return len(axes) == 3 or (len(axes) == 2 and not any(b.spin[k] for b in content.movable for k in axes))


def scales(content: Content) -> tuple[float, float, float]:
    """Length [m], speed [m/s] and energy [J]: the largest extent of the bodies, their fastest start or fall, and their
    kinetic energy at that speed.
    """
    low, high = _extents(content.bodies)
    length = float((high - low).max())
    fastest = max(math.hypot(*body.velocity) for body in content.movable)
    spinning = max(math.hypot(*body.spin) * _reach(body) for body in content.movable)
    g = math.hypot(*content.gravity)
    fall = _drop(content) if content.statics else g * content.duration**2 / 2
    speed = max(fastest, spinning, math.sqrt(2 * g * fall))
    speed = speed or length / content.duration
    return length, speed, sum(body.mass or 0.0 for body in content.movable) * speed**2 / 2


def _drop(content: Content) -> float:
    """Largest height [m] of a movable body above the lowest point of the scene, along gravity."""
    g = math.hypot(*content.gravity)
    if g == 0:
        return 0.0
    up = -np.array(content.gravity) / g
    heights = [float(up @ np.array(body.position)) for body in content.bodies]
    tops = [h for h, body in zip(heights, content.bodies, strict=True) if not body.static]
    return max(max(tops) - min(heights), 2 * min(_reach(body) for body in content.movable))


def _extents(bodies: Sequence[Body]) -> tuple[Floats, Floats]:
    """Corners of the box around all bodies; of a plane, its point below the first body counts."""
    bounded = [body for body in bodies if not isinstance(body.shape, HalfSpace)]
    centres, reaches = np.array([b.position for b in bounded]), np.array([[_reach(b)] for b in bounded])
    low, high = (centres - reaches).min(axis=0), (centres + reaches).max(axis=0)
    for body in bodies:
        if isinstance(body.shape, HalfSpace):
            normal = np.array(body.shape.normal)
            distances = (centres - np.array(body.position)) @ normal
            foot = centres[0] - distances[0] * normal
            low, high = np.minimum(low, foot), np.maximum(high, foot)
    return low, high


def _reach(body: Body) -> float:
    """Radius [m] of the ball around the centre that holds the body."""
    match body.shape:
        case Sphere(radius):
            return radius
        case Box(half):
            return math.hypot(*half)
        case Capsule(radius, half_length):
            return radius + half_length
        case HalfSpace():
            return 0.0


def apart_at_start(bodies: Sequence[Body]) -> bool:
    """Whether nothing touches at t = 0 or did so within a step before, judged by the balls around the bodies."""
    if len(bodies) > FEW:
        return False
    movable = [body for body in bodies if not body.static]
    rest = [body for body in bodies if body.static]
    return all(_room(a, b) > 0 for a, b in chain(combinations(movable, 2), product(movable, rest)))


def _room(a: Body, b: Body) -> float:
    """Gap [m] between the balls around a and b, less what they may have parted by within a step."""
    between, velocity = np.subtract(b.position, a.position), np.subtract(b.velocity, a.velocity)
    if isinstance(b.shape, HalfSpace):
        normal, gap = -np.array(b.shape.normal), -float(between @ b.shape.normal) - _reach(a)
    else:
        distance = float(np.linalg.norm(between))
        normal, gap = between / distance if distance > 0 else between, distance - _reach(a) - _reach(b)
    return gap - max(0.0, float(velocity @ normal)) * LONGEST_STEP - ROUND_OFF * float(np.abs(between).max())


def complete(name: str, content: Content, contact: Contact, pairs: tuple[tuple[str, str, Contact], ...] = ()) -> Scene:
    """The scene, with everything not given worked out."""
    length, speed, energy = scales(content)
    return Scene(
        name=name,
        bodies=content.bodies,
        duration=content.duration,
        model=model(content, None, None),
        length=length,
        speed=speed,
        energy=energy,
        gravity=content.gravity,
        contact=contact,
        pairs=pairs,
        laws=laws(content.contacts),
        phase_free=apart_at_start(content.bodies),
    )
