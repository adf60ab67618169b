"""A whole engine in one page: balls without spin that bounce off fixed planes, v before x."""

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import HalfSpace, Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import State


class Example:
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if law != "nc":
            raise Unsupported("only Newton's restitution is known here")
        if model.rotation or model.friction:
            raise Unsupported("balls neither turn nor rub here")
        if profile != "default":
            raise Unsupported(f"there is no profile {profile} here")
        balls = [scene.bodies[i] for i in scene.movable]
        planes = [scene.bodies[i] for i in scene.statics]
        if not all(isinstance(ball.shape, Sphere) for ball in balls):
            raise Unsupported("only balls move here")
        if not all(isinstance(plane.shape, HalfSpace) for plane in planes):
            raise Unsupported("only half-spaces stand still here")
        if scene.collide and len(balls) > 1:
            raise Unsupported("balls do not meet one another here")
        # What was set beside the scene itself, for the report: names and plain values.
        self.settings = {"integrator": "semi-implicit Euler", "impact": "v -> -e v at the first overlap"}
        self._step = step
        self._gravity = np.array(scene.gravity) if model.gravity else np.zeros(3)
        self._x = np.array([ball.position for ball in balls])
        self._v = np.array([ball.velocity for ball in balls])
        self._radii = np.array([ball.shape.radius for ball in balls])
        # Coefficients belong to pairs: every ball has its own restitution with every plane.
        self._planes = [
            (
                np.array(scene.bodies[wall].shape.normal),
                np.array(scene.bodies[wall].position),
                np.array([scene.contact_of(ball, wall).bounciness for ball in scene.movable]),
            )
            for wall in (scene.statics if scene.collide else ())
        ]

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self._v += self._step * self._gravity
            for normal, point, bounciness in self._planes:
                gap = (self._x - point) @ normal - self._radii
                speed = self._v @ normal
                hit = (gap <= 0) & (speed < 0)
                self._v -= np.outer(np.where(hit, (1 + bounciness) * speed, 0.0), normal)
            self._x += self._step * self._v

    def read(self) -> State:
        return State(self._x.copy(), self._v.copy())  # copies: the caller keeps them while the engine goes on

    def close(self) -> None:
        """Nothing is held outside Python's memory."""
