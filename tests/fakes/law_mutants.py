"""Seeded faults of laws and adapters: a contestant that passes, with one thing wrong in each class.

The laws' mutants wrap the stepped reference, which they feed a wrong scene, push after each step or read wrongly;
those of spin wrap pymunk. `expected` names the checks that are there to notice; `fault` is what the table prints.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from impactbench.adapters.pymunk_adapter import Pymunk
from impactbench.reference.contestant import Stepped
from impactbench.scenarios.records import Contact, Law, Model, Scene
from impactbench.scenarios.trajectory import Floats, State


class Reference:
    """Without a fault: the stepped reference under Newton-Coulomb."""

    fault = "none: the stepped reference"
    expected: tuple[str, ...] = ()
    pace = 1.0  # of the step the engine is told

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        self.scene, self.step, self.gravity = scene, step, np.array(scene.gravity if model.gravity else (0.0, 0.0, 0.0))
        self.engine: Any = self.build(self.told(scene), law, model, step * self.pace)
        self.settings = dict(self.engine.settings)
        self.first = self.last = self.engine.read()
        self.taken = 0

    def build(self, scene: Scene, law: Law, model: Model, step: float) -> Any:
        return Stepped(scene, law, "stepped", model, step)

    def told(self, scene: Scene) -> Scene:
        """The scene as the engine gets it."""
        return scene

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.last = self.engine.read()
            self.engine.advance(1)
            self.taken += 1
            state = self.engine.read()
            change = state.velocities - self.last.velocities - self.step * self.gravity
            hit = np.linalg.norm(change, axis=1) > 1e-3 * self.scene.speed
            self.after(state.velocities.copy(), change, hit)

    def after(self, velocities: Floats, change: Floats, hit: Floats) -> None:
        """Called after every step; `hit` are the rows whose velocity jumped, `change` by how much."""

    def push(self, velocities: Floats, positions: Floats | None = None) -> None:
        """Put velocities (and positions) into the engine."""
        rows = list(self.scene.movable)
        self.engine._runner._bodies.velocity[rows] = velocities
        if positions is not None:
            self.engine._runner._bodies.position[rows] = positions

    def read(self) -> State:
        return self.seen(self.engine.read())

    def seen(self, state: State) -> State:
        """The state as it is reported."""
        return state

    def close(self) -> None:
        self.engine.close()


class Planar(Reference):
    """Without a fault: pymunk with its tuned profile, for what turns."""

    fault = "none: pymunk, tuned"

    def build(self, scene: Scene, law: Law, model: Model, step: float) -> Any:
        return Pymunk(scene, law, "tuned", model, step)


MUTANTS: list[type[Reference]] = []


def mutant(fault: str, *expected: str) -> Callable[[type[Reference]], type[Reference]]:
    def listed(kind: type[Reference]) -> type[Reference]:
        kind.fault, kind.expected = fault, expected
        MUTANTS.append(kind)
        return kind

    return listed


def contacts(scene: Scene, change: Callable[[Contact], Contact]) -> Scene:
    pairs = tuple((a, b, change(contact)) for a, b, contact in scene.pairs)
    return replace(scene, contact=change(scene.contact), pairs=pairs)


def masses(scene: Scene, change: Callable[[list[float]], list[float]]) -> Scene:
    new = iter(change([scene.bodies[i].mass or 0.0 for i in scene.movable]))
    return replace(scene, bodies=tuple(b if b.static else replace(b, mass=next(new)) for b in scene.bodies))


# --- impacts ---


@mutant("0.1 % of the energy lost in each impact", "impact", "restitution", "energy-loss")
class EnergyLeak(Reference):
    def after(self, v, change, hit):
        self.push(np.where(hit[:, None], v * math.sqrt(0.999), v))


@mutant("0.1 % of energy won in each impact", "impact", "restitution", "energy-gain")
class EnergySource(Reference):
    def after(self, v, change, hit):
        self.push(np.where(hit[:, None], v * math.sqrt(1.001), v))


@mutant("1e-6 of a body's momentum lost in each impact", "momentum")
class MomentumLeak(Reference):
    def after(self, v, change, hit):
        if hit.any():
            v[np.argmax(hit)] *= 1 - 1e-6
            self.push(v)


@mutant("restitution 1 % too small", "restitution")
class SmallerE(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, bounciness=0.99 * c.bounciness))


@mutant("restitution 1 % too large", "restitution")
class LargerE(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, bounciness=min(1.0, 1.01 * c.bounciness)))


@mutant("restitution as a product of surfaces: e^2", "restitution")
class SquaredE(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, bounciness=c.bounciness**2))


@mutant("no restitution below 1 m/s", "impact")
class Threshold(Reference):
    def after(self, v, change, hit):
        if len(v) == 1 and hit[0] and np.linalg.norm(change[0]) > 0 and np.linalg.norm(self.last.velocities[0]) < 1:
            n = change[0] / np.linalg.norm(change[0])
            self.push(v - (v @ n)[:, None] * n)


@mutant("a wall that holds on to what hits it", "restitution", "impact")
class StickyWall(Reference):
    def after(self, v, change, hit):
        if self.scene.statics and hit.any():
            self.push(np.where(hit[:, None], 0.0, v))


@mutant("impulse 0.1 % too large", "impact", "restitution")
class WrongReducedMass(Reference):
    def after(self, v, change, hit):
        self.push(v + 1e-3 * change * hit[:, None])


@mutant("impulse along a stale normal, 1e-3 rad off", "impact", "angular-momentum")
class StaleNormal(Reference):
    def after(self, v, change, hit):
        x, z = [*self.scene.model.axes, 0, 1][:2]
        turned = np.zeros_like(change)
        turned[:, x], turned[:, z] = -1e-3 * change[:, z], 1e-3 * change[:, x]
        self.push(v + turned * hit[:, None])


@mutant("impulse on one body of a pair only", "momentum")
class OneSided(Reference):
    def after(self, v, change, hit):
        if hit.sum() > 1:
            v[np.argmax(hit)] -= change[np.argmax(hit)]
            self.push(v)


@mutant("tangential velocity turned round by a wall", "impact")
class TangentSign(Reference):
    def after(self, v, change, hit):
        for row in np.flatnonzero(hit):
            n = change[row] / np.linalg.norm(change[row])
            v[row] = 2 * (v[row] @ n) * n - v[row]
        self.push(v)


@mutant("sign of the restitution: bodies go on through", "restitution", "penetration")
class ImpulseSign(Reference):
    def after(self, v, change, hit):
        self.push(np.where(hit[:, None], self.last.velocities, v))


@mutant("contact acts one step late", "penetration", "impact-time", "position")
class LateContact(Reference):
    owed: Floats | None = None

    def after(self, v, change, hit):
        x = self.engine.read().positions
        if self.owed is not None:
            v, self.owed = v + self.owed, None
        elif hit.any():
            self.owed = change * hit[:, None]
            v, x = v - self.owed, self.last.positions + self.step * (v - self.owed)
        self.push(v, x)


@mutant("contacts looked for at every tenth step only", "penetration", "impact-time")
class RareContacts(Reference):
    pace = 10.0

    def advance(self, steps):
        for _ in range(steps):
            if self.taken % 10 == 0:
                self.last = self.engine.read()
                self.engine.advance(1)
            self.taken += 1

    def seen(self, state):
        part = (self.taken - 1) % 10 + 1 if self.taken else 0
        if part in (0, 10):
            return state
        x, v = self.last.positions, self.last.velocities
        t = part * self.step
        return State(x + t * v + t * t / 2 * self.gravity, v + t * self.gravity)


@mutant("the last static is missing", "penetration")
class MissingStatic(Reference):
    def told(self, scene):
        if not scene.statics:
            return scene
        return replace(scene, bodies=tuple(b for i, b in enumerate(scene.bodies) if i != scene.statics[-1]))


@mutant("nothing collides", "penetration", "restitution")
class NoContact(Reference):
    def told(self, scene):
        return replace(scene, collide=False)


@mutant("two masses swapped", "momentum", "impact")
class SwappedMasses(Reference):
    def told(self, scene):
        return masses(scene, lambda found: found[::-1])


@mutant("all masses taken as equal", "momentum", "impact")
class EqualMasses(Reference):
    def told(self, scene):
        return masses(scene, lambda found: [found[0]] * len(found))


@mutant("bodies 5 % too large", "position", "impact-time")
class Larger(Reference):
    def told(self, scene):
        grown = [
            replace(b, shape=replace(b.shape, radius=1.05 * b.shape.radius)) if hasattr(b.shape, "radius") else b
            for b in scene.bodies
        ]
        return replace(scene, bodies=tuple(grown))


@mutant("the wall 1 cm out of place", "impact-time", "penetration", "position")
class MovedWall(Reference):
    def told(self, scene):
        moved = [
            replace(b, position=tuple(x - 0.01 * n for x, n in zip(b.position, b.shape.normal, strict=True)))
            if hasattr(b.shape, "normal")
            else b
            for b in scene.bodies
        ]
        return replace(scene, bodies=tuple(moved))


# --- friction, gravity, rest ---


@mutant("friction 2 % too large", "friction")
class MoreFriction(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, friction=1.02 * c.friction))


@mutant("friction 2 % too small", "friction")
class LessFriction(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, friction=0.98 * c.friction))


@mutant("no friction", "friction")
class NoFriction(Reference):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, friction=0.0))


@mutant("friction by a pyramid: larger between the axes", "friction")
class Pyramid(Reference):
    def told(self, scene):
        v = np.abs(np.array(scene.bodies[scene.movable[0]].velocity))
        stretched = v.sum() / np.linalg.norm(v) if v.any() else 1.0
        return contacts(scene, lambda c: replace(c, friction=stretched * c.friction))


@mutant("gravity 1e-3 too large", "momentum")
class Heavier(Reference):
    def told(self, scene):
        return replace(scene, gravity=tuple(1.001 * g for g in scene.gravity))


@mutant("gravity upwards", "momentum", "position")
class Upwards(Reference):
    def told(self, scene):
        return replace(scene, gravity=tuple(-g for g in scene.gravity))


@mutant("damping of 0.04 / s, an engine's default", "momentum", "energy-loss")
class Damped(Reference):
    def after(self, v, change, hit):
        self.push(v * (1 - 0.04 * self.step))


@mutant("speeds limited to 2.9 m/s", "momentum")
class Limited(Reference):
    def after(self, v, change, hit):
        speed = np.linalg.norm(v, axis=1, keepdims=True)
        self.push(v * np.minimum(1.0, 2.9 / np.where(speed > 0, speed, 1.0)))


@mutant("what is slower than 0.1 m/s is put to sleep", "momentum", "position", "energy-loss")
class Sleeping(Reference):
    def after(self, v, change, hit):
        slow = np.linalg.norm(v, axis=1) < 0.1
        self.push(
            np.where(slow[:, None], 0.0, v), np.where(slow[:, None], self.last.positions, self.engine.read().positions)
        )


@mutant("energy put into a body at rest: jitter of 5 mm/s", "energy-gain", "rest-heights")
class Jitter(Reference):
    def seen(self, state):
        still = np.linalg.norm(state.velocities, axis=1) < 1e-9
        return replace(state, velocities=state.velocities + 5e-3 * (-1) ** self.taken * still[:, None])


@mutant("a stack left 1 mm deep in one another", "rest-heights")
class Slop(Reference):
    def seen(self, state):
        still = np.linalg.norm(state.velocities, axis=1) < 1e-9
        sunk = 1e-3 * np.arange(1, len(still) + 1)[:, None] * still[:, None]
        down = self.gravity / (np.linalg.norm(self.gravity) or 1.0)
        return replace(state, positions=state.positions + sunk * down)


@mutant("what sticks creeps at 2 mm/s", "friction")
class Creep(Reference):
    def seen(self, state):
        still = (np.linalg.norm(state.velocities, axis=1) < 1e-9) & (self.taken > 0)
        return replace(state, positions=state.positions + [2e-3 * self.taken * self.step, 0, 0] * still[:, None])


# --- adapters ---


@mutant("the state of the step before", "momentum", "impact-time")
class StaleRead(Reference):
    def seen(self, state):
        return self.last


@mutant("velocities of the step before, positions of now", "momentum", "impact-time")
class StaleVelocity(Reference):
    def seen(self, state):
        return replace(state, velocities=self.last.velocities)


@mutant("positions of the step before, velocities of now", "position", "impact-time", "impact")
class StalePosition(Reference):
    def seen(self, state):
        return replace(state, positions=self.last.positions)


@mutant("positions half a step ahead of velocities", "position", "energy-gain", "energy-loss", "penetration")
class HalfAStepAhead(Reference):
    def seen(self, state):
        return replace(state, positions=state.positions + self.step / 2 * state.velocities)


@mutant("one step short", "momentum", "impact-time")
class OneShort(Reference):
    def advance(self, steps):
        super().advance(steps if self.taken else steps - 1)
        self.taken += 1


@mutant("a step 0.1 % too long", "momentum", "impact-time")
class LongStep(Reference):
    pace = 1.001


@mutant("the step in milliseconds", "momentum", "restitution")
class Milliseconds(Reference):
    pace = 1e-3


@mutant("lengths in centimetres", "position", "penetration")
class Centimetres(Reference):
    def seen(self, state):
        return State(100 * state.positions, 100 * state.velocities)


@mutant("bodies in reverse order", "position", "momentum")
class Reversed(Reference):
    def seen(self, state):
        return State(state.positions[::-1], state.velocities[::-1])


@mutant("bodies change names when they hit", "position", "momentum", "restitution")
class Renamed(Reference):
    met = False

    def after(self, v, change, hit):
        self.met = self.met or hit.sum() > 1

    def seen(self, state):
        return State(state.positions[::-1], state.velocities[::-1]) if self.met else state


@mutant("the last body frozen", "momentum", "position")
class Frozen(Reference):
    def seen(self, state):
        x, v = state.positions.copy(), state.velocities.copy()
        x[-1], v[-1] = self.first.positions[-1], self.first.velocities[-1]
        return State(x, v)


@mutant("the last body left out", "run")
class Dropped(Reference):
    def seen(self, state):
        return State(state.positions[:-1], state.velocities[:-1])


@mutant("left-handed axes: x mirrored", "position")
class Mirrored(Reference):
    def seen(self, state):
        return State(state.positions * [-1, 1, 1], state.velocities * [-1, 1, 1])


@mutant("single precision", "momentum")
class Single(Reference):
    def seen(self, state):
        return State(*(a.astype(np.float32).astype(float) for a in (state.positions, state.velocities)))


@mutant("not a number once", "finite")
class NotANumber(Reference):
    def seen(self, state):
        return replace(state, velocities=state.velocities * (np.nan if self.taken == 3 else 1.0))


# --- spin, on pymunk ---


@mutant("moment of inertia 10 % too large", "spin", "friction", "energy-loss")
class WrongInertia(Planar):
    def told(self, scene):
        bodies = [
            b if b.static else replace(b, inertia=tuple(1.1 * k for k in b.principal_inertia())) for b in scene.bodies
        ]
        return replace(scene, bodies=tuple(bodies))


@mutant("spin not reported", "spin", "angular-momentum")
class SpinLost(Planar):
    def seen(self, state):
        return state if state.spins is None else replace(state, spins=0 * state.spins)


@mutant("spin of the wrong sign", "spin", "angular-momentum")
class SpinSign(Planar):
    def seen(self, state):
        return state if state.spins is None else replace(state, spins=-state.spins)


@mutant("spin in degrees", "spin", "energy-gain")
class SpinDegrees(Planar):
    def seen(self, state):
        return state if state.spins is None else replace(state, spins=np.degrees(state.spins))


@mutant("spin 0.1 % too small", "spin", "angular-momentum", "energy-loss")
class SpinLeak(Planar):
    def seen(self, state):
        return state if state.spins is None else replace(state, spins=0.999 * state.spins)


@mutant("friction 2 % too large for what rolls", "spin", "friction", "position")
class MoreRollingFriction(Planar):
    def told(self, scene):
        return contacts(scene, lambda c: replace(c, friction=1.02 * c.friction))


# --- at the edge of what a check of first-order budgets can see: kept, and explained where they survive ---


@mutant("restitution of a speed that already holds the step's gravity", "energy-gain", "impact")
class GravityFirst(Reference):
    def after(self, v, change, hit):
        if self.scene.statics and hit.any() and self.gravity.any():
            g = np.linalg.norm(self.gravity)
            e = self.scene.contact.bounciness
            self.push(v - np.where(hit[:, None], self.gravity / g * e * g * self.step, 0.0))


@mutant("bodies 0.1 % too large: slop", "position", "impact-time")
class Slightly(Reference):
    def told(self, scene):
        grown = [
            replace(b, shape=replace(b.shape, radius=1.001 * b.shape.radius)) if hasattr(b.shape, "radius") else b
            for b in scene.bodies
        ]
        return replace(scene, bodies=tuple(grown))
