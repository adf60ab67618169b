"""pybullet (Bullet 2.8x, double precision): v before x, 3D always.

Pair coefficients: the engine multiplies the two surfaces' restitution and friction, so `surface_factors` splits them.
Cannot express: locked axes (a planar scene stays planar by its symmetry); locked rotation in maximal coordinates (there
rotation is left free and simply not read); viscous friction unless the whole velocity of a body may be damped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from impactbench.adapters.surfaces import (
    can_meet,
    distinct_contacts,
    gravity_of,
    need,
    surface_factors,
    viscous_rates,
)
from impactbench.scenarios.engine import Unavailable
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Law, Model, Scene, Shape, Sphere
from impactbench.scenarios.trajectory import State

try:
    import pybullet as pb
except ImportError as error:
    raise Unavailable(f"pybullet cannot be imported: {error}") from error

_clients: list[int] = []
"""One client per process: each costs some 30 ms and 28 MB; a reset costs 0.6 ms."""

EXACT = {
    "restitutionVelocityThreshold": 0.0,
    "contactSlop": 0.0,
    "solverResidualThreshold": 0.0,
}
# Push overlaps apart without adding velocity: split impulses exist in maximal coordinates only, else no push at all.
MAXIMAL = EXACT | {"useSplitImpulse": 1, "splitImpulsePenetrationThreshold": 0.0}
REDUCED = EXACT | {"contactERP": 0.0, "erp": 0.0}
# Profiles of published benchmarks, for `reproduce` only: the coordinates by name, and overlaps are left alone.
PUBLISHED = {"maximal": True, "multibody": False}
UNPUSHED = {"erp": 0.0, "contactERP": 0.0, "frictionERP": 0.0}
LEFT_ALONE = {
    "contactProcessingThreshold": "not set: contacts act before bodies touch, at the cost of bounce off a static",
    "contactERP": "not set (0.08): pushes overlaps out with velocity, which adds to the bounce of two balls",
    "linearDamping, angularDamping": "not set (0.04): slows free motion",
    "useMaximalCoordinates": "not set (reduced coordinates)",
}
"""The vendor's defaults that cause what the default profile shows."""
ITERATIONS = {"numSolverIterations": 200}
"""Profile `iterations`: the default with this one change (50 else), which PyBullet's Quickstart Guide names as what
trades speed for accuracy (setPhysicsEngineParameter)."""
SWEPT = 0.8
"""Profile `swept`: radii of the ball that is swept along a fast body's path (changeDynamics, ccdSweptSphereRadius; the
manual's remedy against tunnelling). It works in maximal coordinates only."""
SURFACE = {"linearDamping": 0.0, "angularDamping": 0.0, "contactProcessingThreshold": 0.0}


def _client() -> int:
    if not _clients or not pb.isConnected(_clients[0]):
        _clients[:] = [pb.connect(pb.DIRECT)]
    return _clients[0]


class Bullet:
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        self._rates = viscous_rates(scene, law, profile)
        pairs = can_meet(scene, (0, 1, 2))
        bounce = surface_factors(scene, pairs, lambda c: c.bounciness, 1.0)
        rough = surface_factors(scene, pairs, lambda c: c.friction if model.friction and not self._rates else 0.0)
        self._c = c = _client()
        self._rotation, self._spent = model.rotation, False
        self._published = PUBLISHED.get(profile)
        self._tuned = profile in ("tuned", "swept") or self._published is not None
        self._swept, self._iterations = profile == "swept", profile == "iterations"
        self._settings: dict[str, object] = {"combination": "product of surfaces"}
        self._maximal, self._locked = self._coordinates(scene, model, pairs) if self._tuned else (False, False)
        if self._swept:
            self._maximal, self._locked = True, False
        if not self._tuned:
            self._settings |= LEFT_ALONE
        pb.resetSimulation(c)
        pb.setTimeStep(step, c)
        pb.setGravity(*gravity_of(scene, model), c)
        if self._tuned:
            self._tune(scene, model, pairs)
        if self._iterations:
            pb.setPhysicsEngineParameter(**ITERATIONS, physicsClientId=c)
            self._settings |= ITERATIONS
        if self._swept:
            pb.setPhysicsEngineParameter(allowedCcdPenetration=0.0, physicsClientId=c)
            self._settings |= {"ccdSweptSphereRadius": f"{SWEPT} radii", "allowedCcdPenetration": 0.0}
        self._shapes: dict[Shape, int] = {}
        handles = [
            self._add(body, bounce[i], rough[i], scene.collide, self._rates.get(i))
            for i, body in enumerate(scene.bodies)
        ]
        self._movable = [handles[i] for i in scene.movable]

    @property
    def settings(self) -> Mapping[str, object]:
        return self._settings

    def configure(self, settings: Mapping[str, object]) -> None:
        """Parameters of the solver by their own names, on top of the profile's."""
        pb.setPhysicsEngineParameter(**settings, physicsClientId=self._c)
        self._settings |= settings
        self._spent = True

    def advance(self, steps: int) -> None:
        step, client = pb.stepSimulation, self._c
        for _ in range(steps):
            step(client)

    def read(self) -> State:
        c = self._c
        poses = [pb.getBasePositionAndOrientation(b, c) for b in self._movable]
        motions = [pb.getBaseVelocity(b, c) for b in self._movable]
        x, v = (np.array([p[0] for p in both], dtype=float).reshape(-1, 3) for both in (poses, motions))
        if not self._rotation:
            return State(x, v)
        q = np.array([p[1] for p in poses], dtype=float).reshape(-1, 4)[:, [3, 0, 1, 2]]
        return State(x, v, q, np.array([m[1] for m in motions], dtype=float).reshape(-1, 3))

    def close(self) -> None:
        if self._spent:  # a reset keeps numSubSteps: the next world would inherit it
            pb.disconnect(self._c)
        elif pb.isConnected(self._c):
            pb.resetSimulation(self._c)

    def _coordinates(self, scene: Scene, model: Model, pairs: list[tuple[int, int]]) -> tuple[bool, bool]:
        """(maximal, rotation locked): only reduced coordinates can lock rotation, only maximal ones split impulses."""
        if self._published is not None:
            return self._published, False
        if self._rates:
            return True, False  # the damping of reduced coordinates is quadratic in speed
        wanted = need(scene, model, distinct_contacts(scene, pairs))
        balls = all(isinstance(scene.bodies[i].shape, Sphere) for i in scene.movable)
        if wanted == "sliding":
            return (model.rotation and balls), not model.rotation
        # Boxes that do not turn: bouncing ones under gravity gain energy in reduced coordinates, so those stay maximal.
        if not balls and wanted == "resting":
            return False, not model.rotation
        locked = not model.rotation and not balls and not any(gravity_of(scene, model))
        return not locked, locked

    def _tune(self, scene: Scene, model: Model, pairs: list[tuple[int, int]]) -> None:
        chosen: dict[str, float | int] = dict(MAXIMAL if self._maximal else REDUCED)
        resting = self._published is None and need(scene, model, distinct_contacts(scene, pairs)) == "resting"
        if not self._maximal and (resting or not self._locked):
            chosen = dict(EXACT)  # piles, and boxes free to tip, need overlaps pushed out: else they sink
        if self._rates:
            # A box in maximal coordinates rocks on its floor; pushes that add velocity hold it up best (measured).
            chosen = EXACT | {"useSplitImpulse": 0}
        if self._published is not None:
            chosen = dict(UNPUSHED)
        if resting:
            chosen["numSolverIterations"] = 200
        pb.setPhysicsEngineParameter(**chosen, physicsClientId=self._c)
        self._settings |= chosen | SURFACE | {"useMaximalCoordinates": self._maximal}
        if self._locked:
            self._settings["localInertiaDiagonal"] = (0, 0, 0)
        if self._rates:
            self._settings["linearDamping"] = "1 - exp(-c/m) per body"

    def _add(self, body: Body, bounce: float, rough: float, collide: bool, rate: float | None) -> int:
        c = self._c
        w, x, y, z = body.orientation
        handle: int = pb.createMultiBody(
            body.mass or 0.0,
            self._shape(body.shape),
            -1,
            body.position,
            (x, y, z, w),
            useMaximalCoordinates=self._maximal,
            physicsClientId=c,
        )
        surface: dict[str, object] = {"restitution": bounce, "lateralFriction": rough}
        if self._tuned:
            surface |= SURFACE
        if body.mass is not None:
            # Mass goes along, or maximal coordinates set it to 0; the engine's own capsule has the inertia of a box.
            inertia = (0, 0, 0) if self._locked else body.principal_inertia()
            surface |= {"mass": body.mass, "localInertiaDiagonal": inertia}
            if rate is not None:
                surface["linearDamping"] = -math.expm1(-rate / body.mass)
        if self._swept and isinstance(body.shape, Sphere):
            surface["ccdSweptSphereRadius"] = SWEPT * body.shape.radius
        if self._tuned and not self._maximal and body.mass is not None:
            surface["maxJointVelocity"] = 1e9  # else every velocity component is clamped to 100 silently
        pb.changeDynamics(handle, -1, **surface, physicsClientId=c)
        # Movable bodies meet all, statics meet movable bodies only.
        group, mask = (2, 1) if body.static else (1, 3)
        pb.setCollisionFilterGroupMask(handle, -1, group, mask if collide else 0, physicsClientId=c)
        if body.mass is not None:
            pb.resetBaseVelocity(handle, body.velocity, body.spin if self._rotation else (0, 0, 0), physicsClientId=c)
        return handle

    def _shape(self, shape: Shape) -> int:
        if shape not in self._shapes:
            self._shapes[shape] = pb.createCollisionShape(**_arguments(shape), physicsClientId=self._c)
        return self._shapes[shape]


def _arguments(shape: Shape) -> dict[str, object]:
    match shape:
        case Sphere(radius):
            return {"shapeType": pb.GEOM_SPHERE, "radius": radius}
        case Box(half):
            return {"shapeType": pb.GEOM_BOX, "halfExtents": half}
        case Capsule(radius, half):
            return {"shapeType": pb.GEOM_CAPSULE, "radius": radius, "height": 2 * half}
        case HalfSpace(normal):
            return {"shapeType": pb.GEOM_PLANE, "planeNormal": normal}
