"""What may be done to a scene without changing its physics: the same motion seen from elsewhere, or in other units.

A `Similarity` is a change of place, direction, frame and units; `reordered` and `restarted` change only how the scene
is told. Every one is undone exactly where its numbers are signs, permutations and powers of two, else to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import (
    UPRIGHT,
    ZERO,
    Body,
    Box,
    Capsule,
    Contact,
    HalfSpace,
    Model,
    Quaternion,
    Scene,
    Shape,
    Sphere,
    Vector,
)
from impactbench.scenarios.trajectory import Floats, State, Trajectory

EVEN = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True)
class Similarity:
    """x' = length * turn(S x) + shift + boost t', with t' = time * t and S x = signs * x[order].

    order, signs: a signed permutation of the axes, exact in floating point; one minus sign alone is a mirror.
    turn: a rotation after it, as a unit quaternion (w, x, y, z). length, time, mass: factors of the units.
    shift [new m], boost [new m/s]: of the new scene's origin.
    """

    order: tuple[int, int, int] = (0, 1, 2)
    signs: Vector = (1.0, 1.0, 1.0)
    turn: Quaternion = UPRIGHT
    shift: Vector = ZERO
    boost: Vector = ZERO
    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0

    @property
    def handedness(self) -> float:
        """1 for a rotation, -1 for a mirror image."""
        return math.prod(self.signs) * (1.0 if self.order in EVEN else -1.0)

    def direct(self, vectors: Floats) -> Floats:
        """Directions, shape [..., 3], as the new scene has them."""
        swapped = np.asarray(vectors, dtype=np.float64)[..., list(self.order)] * np.array(self.signs)
        return swapped if self.turn == UPRIGHT else _rotate(self.turn, swapped)

    def redirect(self, vectors: Floats) -> Floats:
        """The inverse of `direct`."""
        w, x, y, z = self.turn
        turned = vectors if self.turn == UPRIGHT else _rotate((w, -x, -y, -z), vectors)
        back = np.empty_like(turned)
        back[..., list(self.order)] = turned * np.array(self.signs)
        return back


def transformed(scene: Scene, to: Similarity) -> Scene:
    """The scene as `to` has it. Its step must be scaled by `to.time` as well.

    Raises Unsupported where the new scene cannot be told: a boost with statics, a capsule whose axis would be swapped.
    """
    if any(to.boost) and scene.statics:
        raise Unsupported("statics do not take part in a common velocity")
    pace = to.length / to.time
    return replace(
        scene,
        bodies=tuple(_body(body, to) for body in scene.bodies),
        gravity=_vector(to.direct(np.array(scene.gravity)) * (pace / to.time)),
        duration=scene.duration * to.time,
        length=scene.length * to.length,
        speed=scene.speed * pace,
        energy=scene.energy * to.mass * pace**2,
        contact=_contact(scene.contact, to),
        pairs=tuple((a, b, _contact(contact, to)) for a, b, contact in scene.pairs),
        model=replace(scene.model, axes=_axes(scene.model, to)),
    )


def _body(body: Body, to: Similarity) -> Body:
    velocity, spin, inertia = np.array(body.velocity), np.array(body.spin), body.inertia
    boost = ZERO if body.static else to.boost
    plane = isinstance(body.shape, HalfSpace)  # its normal says all
    return replace(
        body,
        shape=_shape(body.shape, to),
        mass=None if body.mass is None else body.mass * to.mass,
        position=_vector(to.length * to.direct(np.array(body.position)) + np.array(to.shift)),
        velocity=_vector(to.length / to.time * to.direct(velocity) + np.array(boost)),
        orientation=body.orientation if plane else _quaternion(_oriented(np.array(body.orientation), to)),
        spin=_vector(to.handedness / to.time * to.direct(spin)),
        inertia=None if inertia is None else _vector(to.mass * to.length**2 * np.array(inertia)[list(to.order)]),
    )


def _shape(shape: Shape, to: Similarity) -> Shape:
    match shape:
        case Sphere(radius):
            return Sphere(radius * to.length)
        case Box(half):
            return Box(_vector(np.array(half)[list(to.order)] * to.length))
        case Capsule(radius, half_length):
            if to.order[2] != 2:
                raise Unsupported("a capsule lies along its own z")
            return Capsule(radius * to.length, half_length * to.length)
        case HalfSpace(normal):
            return HalfSpace(_vector(to.direct(np.array(normal))))


def _contact(contact: Contact, to: Similarity) -> Contact:
    return replace(contact, viscosity=contact.viscosity * to.mass / to.time)


def _axes(model: Model, to: Similarity) -> tuple[int, ...]:
    """The axes along which the new scene moves: those that an old one has a part along."""
    units = np.abs(to.direct(np.eye(3)[list(model.axes)]))
    return tuple(int(k) for k in np.flatnonzero(units.max(axis=0) > 1e-9))


def _oriented(orientations: Floats, to: Similarity) -> Floats:
    """Orientations, shape [..., 4]. S turns body and world axes alike, so that Q' = S Q S^T: its axis is a
    pseudovector. `turn` acts on the world alone.
    """
    swapped = orientations[..., 1:][..., list(to.order)] * np.array(to.signs) * to.handedness
    both = np.concatenate([orientations[..., :1], swapped], axis=-1)
    return both if to.turn == UPRIGHT else _product(np.array(to.turn), both)


def returned(trajectory: Trajectory, to: Similarity) -> Trajectory:
    """The outcome of the transformed scene, told as that of the original one."""
    times = trajectory.times / to.time
    shift = np.array(to.shift) + trajectory.times[:, None, None] * np.array(to.boost)
    orientations, spins = trajectory.orientations, trajectory.spins
    if orientations is not None:
        w, x, y, z = to.turn
        orientations = orientations if to.turn == UPRIGHT else _product(np.array((w, -x, -y, -z)), orientations)
        axes = np.empty_like(orientations[..., 1:])
        axes[..., list(to.order)] = orientations[..., 1:] * np.array(to.signs) * to.handedness
        orientations = np.concatenate([orientations[..., :1], axes], axis=-1)
    return Trajectory(
        times,
        to.redirect(trajectory.positions - shift) / to.length,
        to.redirect(trajectory.velocities - np.array(to.boost)) / (to.length / to.time),
        orientations,
        None if spins is None else to.redirect(spins) * (to.handedness * to.time),
    )


def reordered(scene: Scene, order: Sequence[int]) -> Scene:
    """The scene with body number order[i] at place i."""
    return replace(scene, bodies=tuple(scene.bodies[i] for i in order))


def original_rows(scene: Scene, order: Sequence[int]) -> list[int]:
    """For each movable body of the scene, its row in a trajectory of `reordered(scene, order)`."""
    movable = [i for i in order if not scene.bodies[i].static]
    return [movable.index(i) for i in scene.movable]


def picked(trajectory: Trajectory, rows: Sequence[int]) -> Trajectory:
    """The trajectory with its bodies in the order of `rows`."""
    some = list(rows)
    return Trajectory(
        trajectory.times,
        trajectory.positions[:, some],
        trajectory.velocities[:, some],
        None if trajectory.orientations is None else trajectory.orientations[:, some],
        None if trajectory.spins is None else trajectory.spins[:, some],
    )


def restarted(scene: Scene, state: State) -> Scene:
    """The scene that begins where `state` is."""
    bodies = list(scene.bodies)
    for row, i in enumerate(scene.movable):
        bodies[i] = replace(bodies[i], position=_vector(state.positions[row]), velocity=_vector(state.velocities[row]))
        if state.orientations is not None and state.spins is not None:
            turned, spin = _quaternion(state.orientations[row]), _vector(state.spins[row])
            bodies[i] = replace(bodies[i], orientation=turned, spin=spin)
    return replace(scene, bodies=tuple(bodies))


def backwards(state: State) -> State:
    """The same places, every motion the other way."""
    spins = None if state.spins is None else -state.spins
    return State(state.positions, -state.velocities, state.orientations, spins)


def _rotate(q: Quaternion, vectors: Floats) -> Floats:
    axis = np.array(q[1:])
    twice = 2 * np.cross(axis, vectors)
    return np.asarray(vectors + q[0] * twice + np.cross(axis, twice))


def _product(p: Floats, q: Floats) -> Floats:
    """Turn by q, then by p: quaternions of shape [4] and [..., 4]."""
    scalar = p[0] * q[..., :1] - (p[1:] * q[..., 1:]).sum(-1, keepdims=True)
    return np.concatenate([scalar, p[0] * q[..., 1:] + q[..., :1] * p[1:] + np.cross(p[1:], q[..., 1:])], axis=-1)


def _vector(values: Floats) -> Vector:
    # Adding 0.0 turns -0.0 into 0.0: a mirrored nought is nought, and engines are handed one text for it.
    x, y, z = (float(value) + 0.0 for value in values)
    return (x, y, z)


def _quaternion(values: Floats) -> Quaternion:
    w, x, y, z = (float(value) + 0.0 for value in values)
    return (w, x, y, z)
