"""What a scene is: bodies, shapes, coefficients of pairs and the smallest model that can show the effect.

Records are plain immutable data in SI units (m, kg, s, rad). They know nothing of engines.
Vectors are tuples of three floats, so that scenes compare, hash and serialise exactly; engines turn them into arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Law = Literal["doc", "nc"]
"""`doc`: the documents' law (R5 viscous friction, R9 impacts).
`nc`: Newton restitution e on the normal, Coulomb friction mu."""

ZERO: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Sphere:
    """Ball of `radius` [m]. A planar engine runs it as a disc that carries the ball's inertia."""

    radius: float


@dataclass(frozen=True)
class Box:
    """Cuboid with `half_extents` [m] along its own axes."""

    half_extents: Vector


@dataclass(frozen=True)
class Capsule:
    """Cylinder of half length `half_length` [m] along its own z, closed by two half balls of `radius` [m]."""

    radius: float
    half_length: float


@dataclass(frozen=True)
class HalfSpace:
    """Everything behind the plane through the body's position: points x with (x - position) . normal <= 0.
    Static only."""

    normal: Vector


Shape = Sphere | Box | Capsule | HalfSpace


@dataclass(frozen=True)
class Body:
    """One rigid body at time 0.

    position [m] of the centre of mass (a point of the plane, for a half-space), velocity [m/s], orientation as a unit
    quaternion (w, x, y, z), spin [rad/s] in world axes. A static body (R1) has `mass` None and never moves.
    `inertia` [kg m^2] holds the principal moments along the body's own axes;
    None means the shape's own, uniform density.
    """

    name: str
    shape: Shape
    mass: float | None
    position: Vector
    velocity: Vector = ZERO
    orientation: Quaternion = UPRIGHT
    spin: Vector = ZERO
    inertia: Vector | None = None

    @property
    def static(self) -> bool:
        return self.mass is None

    def principal_inertia(self) -> Vector:
        """Principal moments [kg m^2] along the body's own axes."""
        if self.inertia is not None:
            return self.inertia
        if self.mass is None:
            return (math.inf, math.inf, math.inf)
        return uniform_inertia(self.shape, self.mass)


def uniform_inertia(shape: Shape, mass: float) -> Vector:
    """Principal moments [kg m^2] of a solid of uniform density."""
    match shape:
        case Sphere(radius):
            moment = 0.4 * mass * radius**2
            return (moment, moment, moment)
        case Box((a, b, c)):
            return (mass * (b * b + c * c) / 3, mass * (a * a + c * c) / 3, mass * (a * a + b * b) / 3)
        case Capsule(r, half):
            ball_volume, tube_volume = 4 / 3 * math.pi * r**3, 2 * math.pi * r**2 * half
            ball = mass * ball_volume / (ball_volume + tube_volume)
            tube = mass - ball
            axial = 0.4 * ball * r * r + 0.5 * tube * r * r
            # Half balls: own centre lies 3r/8 beyond the tube's end.
            across = ball * (0.4 * r * r + half * half + 0.75 * half * r) + tube * (0.25 * r * r + half * half / 3)
            return (across, across, axial)
        case HalfSpace():
            raise ValueError("a half-space has no inertia: it is static only")


@dataclass(frozen=True)
class Contact:
    """How a pair of bodies responds.

    bounciness: b of the documents (R9) and e of Newton's law, in [0, 1].
    friction:   mu of Coulomb's law [-], used under the law `nc`.
    viscosity:  c of the documents' friction (R5) [kg/s], used under the law `doc`.
    """

    bounciness: float = 1.0
    friction: float = 0.0
    viscosity: float = 0.0


@dataclass(frozen=True)
class Model:
    """What is modelled. Only these axes can carry motion; a rotating planar scene turns about the remaining axis.

    axes: those of 0, 1, 2 (x, y, z) along which anything can move, ascending; their number is the dimension.
    """

    axes: tuple[int, ...]
    rotation: bool = False
    gravity: bool = False
    friction: bool = False

    @property
    def dimension(self) -> int:
        return len(self.axes)


FULL = Model(axes=(0, 1, 2), rotation=True, gravity=True, friction=True)


@dataclass(frozen=True)
class Scene:
    """A case: bodies, gravity, coefficients and duration, with the smallest model that can show the effect.

    name: `family[parameter=value,...]`, unique in the catalogue.
    laws: the laws the scene has a meaning under. A scene with viscous friction is `doc` only, one with Coulomb friction
    `nc` only.
    contact: coefficients of every pair not listed in `pairs`; `pairs` maps two body names to their own coefficients.
    length, speed, energy: scales [m], [m/s], [J] that make errors dimensionless.
    phase_free: the bodies fly freely at t = 0, so that the start may be shifted by a fraction of a step (see
    `shifted`).
    """

    name: str
    bodies: tuple[Body, ...]
    duration: float
    model: Model
    length: float
    speed: float
    energy: float
    gravity: Vector = ZERO
    contact: Contact = Contact()
    pairs: tuple[tuple[str, str, Contact], ...] = ()
    laws: tuple[Law, ...] = ("doc", "nc")
    phase_free: bool = True
    collide: bool = True
    parameters: dict[str, float | int | str] = field(default_factory=dict, hash=False)

    @property
    def family(self) -> str:
        return self.name.partition("[")[0]

    @property
    def movable(self) -> tuple[int, ...]:
        """Indices of the movable bodies, in scene order: the rows of every trajectory."""
        return tuple(i for i, body in enumerate(self.bodies) if not body.static)

    @property
    def statics(self) -> tuple[int, ...]:
        return tuple(i for i, body in enumerate(self.bodies) if body.static)

    def contact_of(self, a: int, b: int) -> Contact:
        """Coefficients of the pair of bodies number a and b."""
        names = {self.bodies[a].name, self.bodies[b].name}
        return next((c for left, right, c in self.pairs if {left, right} == names), self.contact)


def shifted(scene: Scene, delay: float) -> Scene:
    """The same scene, begun `delay` [s] earlier in free flight: its whole truth happens that much later.

    A sweep of delays from 0 to one step samples all impact phases of a stepped engine.
    """
    if not scene.phase_free:
        raise ValueError(f"{scene.name}: bodies touch at t = 0, the start cannot be shifted")

    def earlier(body: Body) -> Body:
        if body.static:
            return body
        x, v, g = body.position, body.velocity, scene.gravity
        return replace(
            body,
            position=_vector(x[i] - v[i] * delay + g[i] * delay**2 / 2 for i in range(3)),
            velocity=_vector(v[i] - g[i] * delay for i in range(3)),
        )

    return replace(scene, bodies=tuple(earlier(body) for body in scene.bodies))


def _vector(values: Iterable[float]) -> Vector:
    x, y, z = values
    return (float(x), float(y), float(z))
