"""Where two rigid bodies touch: features with gap [m], unit normal from A to B and point, in world axes.

A feature is what can touch by itself: a ball, an end of a capsule, a corner of a box. Its number lasts, so that a
contact is known again in the next step (documents, rule R3). A negative gap is an overlap.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

from impactbench.reference.triples import (
    ZEROS,
    Matrix,
    apply,
    back,
    dot,
    length,
    matrix,
    plus,
    scale,
    subtract,
    turned,
)
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import ZERO, Body, Box, Capsule, HalfSpace, Quaternion, Sphere, Vector

Pose = tuple[Vector, Vector, Quaternion, Vector]
"""Position [m], velocity [m/s], orientation, spin [rad/s]."""


class Feature(NamedTuple):
    """One place where a pair may touch."""

    number: int
    gap: float
    normal: Vector
    point: Vector


class Solid:
    """A body as the rigid runner moves it. `plane` is the axis a planar scene turns about, None in space."""

    def __init__(self, body: Body, plane: int | None) -> None:
        self.name, self.shape, self.static = body.name, body.shape, body.static
        self.mass = math.inf if body.mass is None else body.mass
        self.lightness = 0.0 if body.mass is None else 1 / body.mass
        self.principal = body.principal_inertia()
        self.plane = plane
        self.position, self.orientation = body.position, body.orientation
        self.velocity, self.spin = (ZERO, ZERO) if body.static else (body.velocity, body.spin)
        self.axes: Matrix = matrix(body.orientation)
        self.ease: Matrix = ZEROS
        """I^-1 in world axes [1/(kg m^2)]; of a planar scene, its axis' part alone."""
        self.debt = 0.0
        """Energy [J] that lifts added and no approach has paid back yet."""
        self.corners = _corners(self)
        self.refresh()

    def refresh(self) -> None:
        """Bring axes and inertia up to date after a turn."""
        self.axes = matrix(self.orientation)
        if self.static:
            return
        i, j, k = self.principal
        if self.plane is None:
            self.ease = turned(self.axes, (1 / i, 1 / j, 1 / k))
        else:
            about = 1 / turned(self.axes, self.principal)[self.plane][self.plane]
            rows = [tuple(about if m == n == self.plane else 0.0 for n in range(3)) for m in range(3)]
            self.ease = (rows[0], rows[1], rows[2])  # type: ignore[assignment]

    def state(self) -> Pose:
        return self.position, self.velocity, self.orientation, self.spin

    def put(self, state: Pose) -> None:
        self.position, self.velocity, self.orientation, self.spin = state
        self.refresh()

    def reach(self) -> float:
        """Smallest half width [m]: a body that moves less cannot pass another unseen."""
        match self.shape:
            case Sphere(radius) | Capsule(radius, _):
                return radius
            case Box(half):
                return min(half)
            case HalfSpace():
                return math.inf


def _corners(solid: Solid) -> tuple[Vector, ...]:
    """Points of the body, in its own axes, whose depth below a plane is its own: corners, or a capsule's two ends.

    In a planar scene the corners before and behind the plane are one, in it.
    """
    match solid.shape:
        case Capsule(_, half):
            return ((0.0, 0.0, -half), (0.0, 0.0, half))
        case Box(half_extents):
            corners = [
                (sign[0] * half_extents[0], sign[1] * half_extents[1], sign[2] * half_extents[2])
                for sign in itertools.product((-1, 1), repeat=3)
            ]
            if solid.plane is None:
                return tuple(corners)
            across = solid.axes[solid.plane]  # the plane's normal in own axes
            flat = [plus(corner, -dot(across, corner), across) for corner in corners]
            kept: list[Vector] = []
            for corner in flat:
                if all(length(subtract(corner, other)) > 1e-9 * length(half_extents) for other in kept):
                    kept.append(corner)
            return tuple(kept)
        case _:
            return (ZERO,)


def features(a: Solid, b: Solid) -> list[Feature]:
    """All features of a pair; the pair must be one of `MEET`."""
    return _finder(a, b)(a, b)


def check_pair(a: Body, b: Body) -> None:
    """Raise `Unsupported` for a pair of shapes that has no contact here."""
    if (type(a.shape), type(b.shape)) not in MEET and (type(b.shape), type(a.shape)) not in MEET:
        kinds = " on ".join(type(body.shape).__name__.lower() for body in (a, b))
        raise Unsupported(f"bodies {a.name!r} and {b.name!r}: the rigid runner has no contact of {kinds}")


def _finder(a: Solid, b: Solid) -> Finder:
    kinds = type(a.shape), type(b.shape)
    return MEET.get(kinds, _flipped)


def _flipped(a: Solid, b: Solid) -> list[Feature]:
    found = MEET[type(b.shape), type(a.shape)](b, a)
    return [Feature(f.number, f.gap, scale(-1.0, f.normal), f.point) for f in found]


def _on_plane(a: Solid, b: Solid) -> list[Feature]:
    """Half-space A: the body's corners, each lowered by its radius."""
    assert isinstance(a.shape, HalfSpace)
    normal = a.shape.normal
    radius = b.shape.radius if isinstance(b.shape, (Sphere, Capsule)) else 0.0
    found = []
    for number, corner in enumerate(b.corners):
        centre = plus(b.position, 1.0, apply(b.axes, corner))
        height = dot(subtract(centre, a.position), normal)
        found.append(Feature(number, height - radius, normal, plus(centre, -radius, normal)))
    return found


def _rounds(a: Solid, b: Solid) -> list[Feature]:
    """Spheres and capsules: the nearest points of their cores, the centre or the line within."""
    assert isinstance(a.shape, (Sphere, Capsule))
    assert isinstance(b.shape, (Sphere, Capsule))
    p, q = _nearest(a, b)
    between = subtract(q, p)
    distance = length(between)
    normal = scale(1 / distance, between) if distance > 0 else (1.0, 0.0, 0.0)
    gap = distance - a.shape.radius - b.shape.radius
    return [Feature(0, gap, normal, plus(p, a.shape.radius + gap / 2, normal))]


def _nearest(a: Solid, b: Solid) -> tuple[Vector, Vector]:
    """Nearest points of two segments, or of a segment and a point (Ericson, Real-Time Collision Detection, 5.1.9)."""
    (p, along_a), (q, along_b) = _segment(a), _segment(b)
    between = subtract(p, q)
    aa, bb, ab = dot(along_a, along_a), dot(along_b, along_b), dot(along_a, along_b)
    ar, br = dot(along_a, between), dot(along_b, between)
    area = aa * bb - ab * ab
    s = _within((ab * br - ar * bb) / area) if area > 1e-12 * aa * bb else 0.5
    t = _within((ab * s + br) / bb) if bb > 0 else 0.0
    s = _within((ab * t - ar) / aa) if aa > 0 else 0.0
    return plus(p, s, along_a), plus(q, t, along_b)


def _segment(solid: Solid) -> tuple[Vector, Vector]:
    """One end, and the way to the other."""
    if not isinstance(solid.shape, Capsule):
        return solid.position, ZERO
    start = apply(solid.axes, solid.corners[0])
    return plus(solid.position, 1.0, start), scale(-2.0, start)


def _within(s: float) -> float:
    return min(1.0, max(0.0, s))


def _ball_on_box(a: Solid, b: Solid) -> list[Feature]:
    """Box A, sphere B: from the box's nearest point; for a centre inside, its nearest face."""
    assert isinstance(a.shape, Box)
    assert isinstance(b.shape, Sphere)
    half, radius = a.shape.half_extents, b.shape.radius
    own = back(a.axes, subtract(b.position, a.position))
    nearest = tuple(max(-h, min(h, x)) for h, x in zip(half, own, strict=True))
    out = (own[0] - nearest[0], own[1] - nearest[1], own[2] - nearest[2])
    distance = length(out)
    if distance == 0:
        face = min(range(3), key=lambda k: half[k] - abs(own[k]))
        sign = math.copysign(1.0, own[face])
        out = (sign if face == 0 else 0.0, sign if face == 1 else 0.0, sign if face == 2 else 0.0)
        distance = 1.0
        gap = abs(own[face]) - half[face] - radius
    else:
        gap = distance - radius
    normal = apply(a.axes, scale(1 / distance, out))
    return [Feature(0, gap, normal, plus(b.position, -radius - gap / 2, normal))]


Finder = Callable[[Solid, Solid], list[Feature]]
MEET: dict[tuple[type, type], Finder] = {
    (HalfSpace, Sphere): _on_plane,
    (HalfSpace, Capsule): _on_plane,
    (HalfSpace, Box): _on_plane,
    (Sphere, Sphere): _rounds,
    (Sphere, Capsule): _rounds,
    (Capsule, Capsule): _rounds,
    (Box, Sphere): _ball_on_box,
}
"""Pairs of shapes and how their features are found; either order. Boxes on boxes and capsules on boxes are not here."""
