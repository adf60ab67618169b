"""The stepped runner for a few rigid bodies that turn (documents, rules R3, R4, R5 and R14, or Newton-Coulomb).

The order is that of the particles' runner (`stepped`): detect, impacts, gravity, lasting contacts and friction, move,
project. What is finer here, as the bodies are few:
- The instant of an impact is looked for within the step, so a body that flies into contact does not overlap.
- Between impacts positions move by the mean of the velocities before and after the forces, and orientations by the
  mean angular momentum: free flight and free rotation are exact but for `rigid_spin`'s substeps.
- Overlap that is left (bodies that turn while they rest) is projected in the metric of kinetic energy, turns included:
  R4's rule for bodies with inertia. Each lift off a static body is owed by the body and taken from its next approach.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping

import numpy as np
from impactbench.reference.pairs import handled_pairs
from impactbench.reference.rigid_checks import check_rigid
from impactbench.reference.rigid_contact_solve import Key, Touch, hold, strike
from impactbench.reference.rigid_contacts import Pose, Solid, features
from impactbench.reference.rigid_spin import spin_of, turn
from impactbench.reference.triples import apply, cross, dot, exponential, length, plus, product, scale
from impactbench.scenarios.records import ZERO, Law, Model, Scene, Vector
from impactbench.scenarios.trajectory import State

TOUCH, KEEP, STILL = 1e-10, 1e-6, 1e-13
"""Gap that counts as touching, gap across which a lasting contact is kept (both next to the scene's length), and speed
that counts as none, next to the scene's speed."""
SWEEPS, IMPACT_SWEEPS, PROJECTIONS = 500, 200, 100
IMPACTS = 100
"""Instants of impact in one step; what falls into a step beyond these is left to projection."""
SEARCH = 80


class RigidBodies:
    """A scene whose bodies turn: spheres, capsules and boxes, in a plane or in space."""

    def __init__(self, scene: Scene, law: Law, model: Model, step: float) -> None:
        check_rigid(scene, model)
        self._scene, self._law, self._step = scene, law, step
        self._axes = model.axes
        self._plane = None if model.dimension == 3 else next(k for k in range(3) if k not in model.axes)
        self._solids = [Solid(body, self._plane) for body in scene.bodies]
        self._movable = [self._solids[i] for i in scene.movable]
        handled = list(handled_pairs(scene.statics, scene.movable)) if scene.collide else []
        self._pairs = [(self._solids[a], self._solids[b], scene.contact_of(a, b)) for a, b in handled]
        self._gravity = self._carried(scene.gravity)
        for solid in self._movable:
            solid.velocity, solid.spin = self._carried(solid.velocity), self._turning(solid.spin)
        self._touch, self._keep, self._still = TOUCH * scene.length, KEEP * scene.length, STILL * scene.speed
        # Push and rub of the lasting contacts [N]: the next step's first guess.
        self._force: dict[Key, tuple[float, Vector]] = {}
        self._touched = {touch.key for touch in self._touches() if touch.gap <= self._touch}
        self._done = 0
        self.settings: Mapping[str, object] = {
            "order": "detect, impacts, gravity, lasting contacts and friction, move, project",
            "bodies": "rigid (R14)",
            "impacts": "located within the step",
            "touching gap [m]": self._touch,
            "lasting contacts kept up to [m]": self._keep,
            "negligible speed [m/s]": self._still,
            "sweeps at most": SWEEPS,
        }

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self._one_step()
            self._done += 1

    def read(self) -> State:
        movable = self._movable
        return State(
            np.array([solid.position for solid in movable]),
            np.array([solid.velocity for solid in movable]),
            np.array([solid.orientation for solid in movable]),
            np.array([solid.spin for solid in movable]),
        )

    def _carried(self, vector: Vector) -> Vector:
        x, y, z = (value if axis in self._axes else 0.0 for axis, value in enumerate(vector))
        return (x, y, z)

    def _turning(self, spin: Vector) -> Vector:
        if self._plane is None:
            return spin
        x, y, z = (value if axis == self._plane else 0.0 for axis, value in enumerate(spin))
        return (x, y, z)

    def _touches(self) -> list[Touch]:
        """Every feature of every pair, near or far."""
        return [
            Touch((number, feature.number), a, b, feature, contact)
            for number, (a, b, contact) in enumerate(self._pairs)
            for feature in features(a, b)
        ]

    def _one_step(self) -> None:
        """Until the step is over: impacts of this instant, then on to the next one or to the end."""
        left = self._step
        for _ in range(IMPACTS):
            left = self._until_impact(left)
            if left <= 0:
                return
        self._until_impact(left, looking=False)

    def _until_impact(self, left: float, looking: bool = True) -> float:
        """Advance by at most `left` [s]; returns what then is left of the step."""
        near = [t for t in self._touches() if t.gap <= (self._keep if t.key in self._touched else self._touch)]
        slow = {t.key: self._slow(t) for t in near}
        self._touched = {t.key for t in near if t.key in self._touched or t.parting() >= -slow[t.key]}
        self._resolve_impacts(near, slow)
        hold(near, [max(0.0, t.gap) / left for t in near], False, self._still, SWEEPS)
        start = [solid.state() for solid in self._movable]
        known = {t.key for t in near}
        self._move(near, left)
        if looking and (time := self._instant(near, start, known, left)) < left:
            self._touched |= known
            return left - time
        self._touched = known
        self._project()
        return 0.0

    def _slow(self, touch: Touch) -> float:
        """Approach [m/s] that gravity along the normal alone explains, 2 h |g . n| (rule R3)."""
        return max(self._still, 2 * self._step * abs(dot(self._gravity, touch.normal)))

    def _resolve_impacts(self, near: list[Touch], slow: dict[Key, float]) -> None:
        """Pair after pair until none approaches faster than gravity explains; what lasts and closes stays lasting."""
        closing = {t.key for t in near if t.key in self._touched and t.parting() < -slow[t.key]}
        pairs = [list(group) for _, group in itertools.groupby(near, key=lambda t: t.key[0])]
        for _ in range(IMPACT_SWEEPS):
            struck = False
            for pair in pairs:
                meeting = [t for t in pair if t.key not in closing and t.parting() < -slow[t.key]]
                if meeting:
                    strike(meeting, self._law)
                    struck = True
            if not struck:
                return

    def _move(self, near: list[Touch], time: float) -> None:
        """Gravity, lasting contacts with friction, and the way of `time` [s]."""
        before = [(solid.velocity, solid.spin) for solid in self._movable]
        parting = [touch.parting() for touch in near]
        for touch in near:
            push, rub = self._force.get(touch.key, (0.0, ZERO))
            touch.push, touch.rub = push * time, scale(time, plus(rub, -dot(rub, touch.normal), touch.normal))
        for solid in self._movable:
            solid.velocity = plus(solid.velocity, time, self._gravity)
        nc = self._law == "nc"
        if not nc:
            for touch, speed in zip(near, parting, strict=True):
                if touch.contact.viscosity > 0 and speed <= 1e3 * self._still:
                    touch.damp(time)
        # No overlap at the end of the way: a contact in flight may come back as fast as it left, and no push gains.
        closing = [max(0.0, 2 * max(0.0, t.gap) / time + speed) for t, speed in zip(near, parting, strict=True)]
        rest = hold(near, closing, nc, self._still, SWEEPS)
        if rest > max(self._still, 2 * self._step * length(self._gravity)):
            where = f"{self._scene.name}: t = {self._done * self._step:.6g} s"
            raise RuntimeError(f"{where}: contacts did not settle within {SWEEPS} sweeps")
        self._force = {t.key: (t.push / time, scale(1 / time, t.rub)) for t in near}
        for solid, (velocity, spin) in zip(self._movable, before, strict=True):
            solid.velocity = self._carried(solid.velocity)
            solid.spin = self._turning(solid.spin)
            mean = scale(0.5, plus(velocity, 1.0, solid.velocity))
            solid.position = plus(solid.position, time, mean)
            self._turn(solid, spin, time)
            solid.refresh()

    def _turn(self, solid: Solid, before: Vector, time: float) -> None:
        if self._plane is not None:
            solid.orientation = product(exponential(scale(time / 2, plus(before, 1.0, solid.spin))), solid.orientation)
            return
        first, last = _momentum(solid, before), _momentum(solid, solid.spin)
        mean = scale(0.5, plus(first, 1.0, last))
        if mean != ZERO:
            solid.orientation = turn(solid.principal, solid.orientation, mean, time)
        if last != ZERO:
            solid.spin = spin_of(solid.principal, solid.orientation, last)

    def _instant(self, near: list[Touch], start: list[Pose], known: set[Key], left: float) -> float:
        """The first time in (0, left] at which a feature that did not touch does; leaves the bodies there.

        `left` if there is none. Samples are close enough that no body passes another in between; then regula falsi.
        """
        if not self._pairs:
            return left
        end, samples = [solid.state() for solid in self._movable], self._samples(left)
        force = self._force

        def gap_at(time: float) -> float:
            for solid, state in zip(self._movable, start, strict=True):
                solid.put(state)
            self._force = dict(force)
            self._move(near, time)
            return self._least_gap(known)

        before, above = 0.0, math.inf
        for sample in range(1, samples + 1):
            time = left * sample / samples
            gap = self._least_gap(known) if sample == samples and samples == 1 else gap_at(time)
            if gap < -self._touch / 2:
                if above is math.inf:
                    above = max(self._gap_of_start(start, known), self._touch)
                return self._root(gap_at, before, above, time, gap)
            before, above = time, gap
        for solid, state in zip(self._movable, end, strict=True):
            solid.put(state)
        self._force = force
        return left

    def _gap_of_start(self, start: list[Pose], known: set[Key]) -> float:
        for solid, state in zip(self._movable, start, strict=True):
            solid.put(state)
        return self._least_gap(known)

    def _root(self, gap_at: Callable[[float], float], low: float, above: float, high: float, below: float) -> float:
        """Time at which the least gap is within a touch of 0, by Illinois' false position."""
        last, time = 0.0, high
        for _ in range(SEARCH):
            time = high - below * (high - low) / (below - above)
            if not low < time < high:
                time = (low + high) / 2
            gap = gap_at(time)
            if abs(gap) <= self._touch / 2 or not low < time < high:
                break
            again = gap * last > 0
            if gap < 0:
                high, below, above = time, gap, above / 2 if again else above
            else:
                low, above, below = time, gap, below / 2 if again else below
            last = gap
        return time

    def _least_gap(self, known: set[Key]) -> float:
        """Of all features that did not touch before."""
        least = math.inf
        for number, (a, b, _) in enumerate(self._pairs):
            for feature in features(a, b):
                if feature.gap < least and (number, feature.number) not in known:
                    least = feature.gap
        return least

    def _samples(self, left: float) -> int:
        """So many that between two no body moves by more than half the smallest half width of a pair."""
        fastest = 0.0
        for solid in self._movable:
            fastest = max(fastest, length(solid.velocity))
        width = min(solid.reach() for solid in self._solids)
        return max(1, min(1000, math.ceil(2 * fastest * left / width))) if width > 0 else 1

    def _project(self) -> None:
        """Take overlaps away, with the least displacement in the metric of kinetic energy (documents, rule R4)."""
        for _ in range(PROJECTIONS):
            clear = True
            for touch in self._touches():
                if touch.gap < -self._touch / 2:
                    _lift(touch, self._gravity)
                    clear = False
            if clear:
                return


def _momentum(solid: Solid, spin: Vector) -> Vector:
    """I w [kg m^2/s], in world axes."""
    i, j, k = solid.principal
    axes = solid.axes
    own = tuple(sum(axes[row][column] * spin[row] for row in range(3)) for column in range(3))
    return apply(axes, (i * own[0], j * own[1], k * own[2]))


def _lift(touch: Touch, gravity: Vector) -> None:
    """Move and turn both bodies by what an impulse that parts them by the overlap would; their approach pays for it.

    What the approach cannot pay stays as the body's debt until the next lift.
    """
    impulse = scale(-touch.gap * touch.mass, touch.normal)
    cost = 0.0
    for solid, arm, sign in ((touch.a, touch.arm_a, -1.0), (touch.b, touch.arm_b, 1.0)):
        if not solid.static:
            cost += solid.debt - sign * dot(gravity, impulse)
            solid.debt = 0.0
            solid.position = plus(solid.position, sign * solid.lightness, impulse)
            rotation = scale(sign, apply(solid.ease, cross(arm, impulse)))
            solid.orientation = product(exponential(rotation), solid.orientation)
            solid.refresh()
    approach = max(0.0, -touch.parting())
    if cost > 0:
        touched = math.sqrt(max(0.0, approach**2 - 2 * cost / touch.mass))
        touch.give(scale(touch.mass * (approach - touched), touch.normal))
        payer = touch.a if touch.b.static else touch.b
        payer.debt = max(0.0, cost - touch.mass * (approach**2 - touched**2) / 2)
