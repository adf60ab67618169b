"""pymunk (Munk2D): planar, sequential impulses, x before v.

Pair coefficients: the engine multiplies the two surfaces' elasticity and friction, so `surface_factors` splits them.
Cannot express: motion along three axes; boxes that do not stand square to the plane; viscous friction unless all bodies
share c/m.
Bodies carry the inertia of their 3D shape about the axis across the plane: a disc here is the scene's ball.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from impactbench.adapters.frames import about, matrix, multiply
from impactbench.adapters.surfaces import (
    ROUND_OFF,
    can_meet,
    distinct_contacts,
    gravity_of,
    moving_axes,
    need,
    surface_factors,
    viscous_rates,
)
from impactbench.scenarios.engine import Unavailable, Unsupported
from impactbench.scenarios.records import FULL, Body, Box, Capsule, HalfSpace, Law, Model, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Floats, State

try:
    import pymunk
    import pymunk.batch as batch
except ImportError as error:
    raise Unavailable(f"pymunk cannot be imported: {error}") from error

FIELDS = (
    batch.BodyFields.POSITION | batch.BodyFields.ANGLE | batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
)

ITERATIONS = 500
"""Profile `iterations`: Space.iterations is what the manual offers for stacks and mass ratios."""
MOST_PARTS = 10_000


class Pymunk:
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        rates = viscous_rates(scene, law, profile)
        if model == FULL:  # as full as a plane allows: the scene's own axes, with rotation
            model = replace(FULL, axes=scene.model.axes)
        axes = moving_axes(scene, model)
        self._plane = _plane(axes)
        self._across = 3 - sum(self._plane)
        # x cross z is -y: the third axis of the plane (x, z) points backwards.
        self._sign = -1.0 if self._plane == (0, 2) else 1.0
        self._parts = _parts(scene, step) if profile == "substeps" else 1
        self._step, self._rotation = step / self._parts, model.rotation
        _check_planar(scene, self._across, model)
        pairs = can_meet(scene, axes)
        self._space = pymunk.Space()
        # Across the axes that move, what holds a body against gravity is not built either.
        gravity = gravity_of(scene, model)
        self._space.gravity = self._flat(np.array([g if k in axes else 0.0 for k, g in enumerate(gravity)]))
        self._settings: dict[str, object] = {"combination": "product of surfaces"}
        if profile in ("tuned", "iterations", "substeps"):
            self._tune(scene, need(scene, model, distinct_contacts(scene, pairs)) == "resting")
        if profile == "iterations":
            self._space.iterations = ITERATIONS
            self._settings["iterations"] = ITERATIONS
        if profile == "substeps":
            self._settings["substeps"] = self._parts
        if rates:
            self._damp(scene, rates)
        bounce = surface_factors(scene, pairs, lambda c: c.bounciness, 1.0)
        rough = surface_factors(scene, pairs, lambda c: c.friction if model.friction and not rates else 0.0)
        met = {i for pair in pairs for i in pair}
        for i in (*scene.movable, *scene.statics):  # movable first: the bulk read lists statics last
            self._add(scene, i, bounce[i], rough[i], i in met)
        movable = [scene.bodies[i] for i in scene.movable]
        self._start = np.array([b.position for b in movable], dtype=float).reshape(-1, 3)
        self._turned = np.array([b.orientation for b in movable], dtype=float).reshape(-1, 4)
        self._buffer = batch.Buffer()

    @property
    def settings(self) -> Mapping[str, object]:
        return self._settings

    def configure(self, settings: Mapping[str, object]) -> None:
        """Attributes of the space by their own names, on top of the profile's."""
        for name, value in settings.items():
            setattr(self._space, name, value)
        self._settings |= settings

    def advance(self, steps: int) -> None:
        step, h = self._space.step, self._step
        for _ in range(steps * self._parts):
            step(h)

    def read(self) -> State:
        self._buffer.clear()
        batch.get_space_bodies(self._space, FIELDS, self._buffer)
        n = len(self._start)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 6)[:n]
        x, v, plane = self._start.copy(), np.zeros((n, 3)), list(self._plane)
        x[:, plane], v[:, plane] = rows[:, :2], rows[:, 3:5]
        if not self._rotation:
            return State(x, v)
        w = np.zeros((n, 3))
        w[:, self._across] = self._sign * rows[:, 5]
        return State(x, v, multiply(about(self._across, self._sign * rows[:, 2]), self._turned), w)

    def close(self) -> None:
        del self._space

    def _flat(self, vector: Vector | Floats) -> tuple[float, float]:
        a, b = self._plane
        return (float(vector[a]), float(vector[b]))

    def _tune(self, scene: Scene, resting: bool) -> None:
        # The default slop of 0.1 is a length: a tenth of a metre of overlap is left alone.
        self._space.collision_slop = 1e-4 * scene.length
        self._space.iterations = 100 if resting else 30
        self._settings |= {"iterations": self._space.iterations, "collision_slop": self._space.collision_slop}

    def _damp(self, scene: Scene, rates: Mapping[int, float]) -> None:
        ratios = [rates.get(i, 0.0) / (scene.bodies[i].mass or math.inf) for i in scene.movable]
        if max(ratios) - min(ratios) > ROUND_OFF * max(ratios):
            raise Unsupported("pymunk damps the whole space at one rate; these bodies differ in c/m")
        if self._rotation and any(any(scene.bodies[i].spin) for i in scene.movable):
            raise Unsupported("pymunk's damping would slow spins too")
        self._space.damping = math.exp(-ratios[0])
        self._settings["damping"] = self._space.damping

    def _add(self, scene: Scene, i: int, bounce: float, rough: float, meets: bool) -> None:
        body = scene.bodies[i]
        flat = self._space.static_body if body.static else self._body(body)
        if body.static and not meets:
            return
        shape = self._shape(flat, body, _reach(scene))
        shape.elasticity, shape.friction = bounce, rough
        if not meets:
            shape.filter = pymunk.ShapeFilter(mask=0)
        self._space.add(shape) if body.static else self._space.add(flat, shape)

    def _body(self, body: Body) -> pymunk.Body:
        across = matrix(body.orientation)[self._across]
        moment = float(across**2 @ np.array(body.principal_inertia())) if self._rotation else math.inf
        flat = pymunk.Body(body.mass, moment)
        flat.position, flat.velocity = self._flat(body.position), self._flat(body.velocity)
        flat.angular_velocity = self._sign * body.spin[self._across] if self._rotation else 0.0
        return flat

    def _shape(self, flat: pymunk.Body, body: Body, reach: float) -> pymunk.Shape:
        """The body's cut through the plane, turned as at t = 0: angle 0 then means the orientation of the scene."""
        at = np.array(self._flat(body.position)) if body.static else np.zeros(2)
        own = matrix(body.orientation)
        match body.shape:
            case Sphere(radius):
                return pymunk.Circle(flat, radius, tuple(at))
            case HalfSpace(normal):
                n = np.array(self._flat(normal))
                n /= math.hypot(*n)
                along, deep = reach * np.array([-n[1], n[0]]), reach * n
                return pymunk.Poly(flat, [tuple(at + p) for p in (along, -along, -along - deep, along - deep)])
            case Box(half):
                sides = [k for k in range(3) if abs(own[self._across, k]) < 1e-9]
                if len(sides) != 2:
                    raise Unsupported("pymunk is planar: this box does not stand square to the plane")
                p, q = (half[k] * np.array(self._flat(own[:, k])) for k in sides)
                return pymunk.Poly(flat, [tuple(at + c) for c in (p + q, p - q, -p - q, q - p)])
            case Capsule(radius, half_length):
                if abs(own[self._across, 2]) > 1e-9:
                    raise Unsupported("pymunk is planar: this capsule's axis leaves the plane")
                end = half_length * np.array(self._flat(own[:, 2]))
                return pymunk.Segment(flat, tuple(at - end), tuple(at + end), radius)


def _plane(axes: tuple[int, ...]) -> tuple[int, int]:
    if len(axes) > 2:
        raise Unsupported("pymunk is planar, the scene moves along three axes")
    if len(axes) == 2:
        return (axes[0], axes[1])
    return (0, 2) if axes[0] == 0 else (axes[0] - 1, axes[0])


def _check_planar(scene: Scene, across: int, model: Model) -> None:
    movable = [scene.bodies[i] for i in scene.movable]
    levels = [b.position[across] for b in movable]
    if levels and max(levels) - min(levels) > ROUND_OFF * scene.length:
        raise Unsupported("pymunk is planar: the bodies' centres do not lie in one plane")
    turning = model.rotation and any(b.spin[k] for b in movable for k in range(3) if k != across)
    if turning or any(b.velocity[across] for b in movable):
        raise Unsupported("pymunk is planar: motion leaves the plane")


def _parts(scene: Scene, step: float) -> int:
    """Profile `substeps`: pymunk has no continuous detection and its manual advises smaller steps for fast bodies.

    In one part the fastest body travels no more than half the smallest body.
    """
    sizes = [_least(body) for body in scene.bodies if not isinstance(body.shape, HalfSpace)]
    fastest = max((math.hypot(*body.velocity) for body in scene.bodies), default=0.0)
    return min(max(1, math.ceil(fastest * step / (0.5 * min(sizes, default=1.0)))), MOST_PARTS)


def _least(body: Body) -> float:
    return min(body.shape.half_extents) if isinstance(body.shape, Box) else getattr(body.shape, "radius", math.inf)


def _reach(scene: Scene) -> float:
    """Half size [m] of the polygon that stands for a half-space: nothing gets past its edges in the scene's time."""
    g = max(map(abs, scene.gravity))
    spread = max((abs(x) for b in scene.bodies for x in b.position), default=0.0)
    fastest = max((math.hypot(*b.velocity) for b in scene.bodies), default=0.0) + scene.speed + g * scene.duration
    return 2 * (scene.length + spread + fastest * scene.duration)
