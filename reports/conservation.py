"""Momentum, angular momentum and energy of a trajectory: what is known to be conserved, and by how much it is not."""

from __future__ import annotations

import numpy as np
from impactbench.reports.geometry import rotation_matrices
from impactbench.reports.impacts import Impact, PairHistory, flight_fraction
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Floats, Trajectory
from numpy.typing import NDArray


def masses(scene: Scene) -> Floats:
    """Masses of the movable bodies [kg], shape [n]."""
    return np.array([scene.bodies[index].mass for index in scene.movable], dtype=np.float64)


def momentum_drift(scene: Scene, law: Law, trajectory: Trajectory, pairs: list[PairHistory]) -> float:
    """Largest of `momentum_drifts`."""
    return float(momentum_drifts(scene, law, trajectory, pairs).max())


def momentum_drifts(scene: Scene, law: Law, trajectory: Trajectory, pairs: list[PairHistory]) -> Floats:
    """Norm of the momentum that no contact could have given, relative to the run's largest sum of m |v|, shape [T].

    Without statics that is P - P0 - M g t. A static gives impulses along its normal while it is touched and, with
    Coulomb friction, up to mu times that along its plane; under the documents' law an impact with b < 1 or viscous
    friction may act in any direction (R5, R8, R9).
    """
    mass = masses(scene)
    momenta = np.einsum("n,tni->ti", mass, trajectory.velocities)
    scale = max(
        float(np.einsum("n,tn->t", mass, np.linalg.norm(trajectory.velocities, axis=2)).max()),
        float(mass.max()) * scene.speed,
    )
    steps = np.diff(trajectory.times)
    excess = np.diff(momenta, axis=0) - mass.sum() * np.outer(steps, scene.gravity)
    with_statics = [pair for pair in pairs if scene.bodies[pair.a].static]
    if with_statics:
        excess = _outside_contacts(scene, law, excess, steps, with_statics)
    drift = np.linalg.norm(np.cumsum(excess, axis=0), axis=1)
    return np.concatenate([[0.0], drift]) / scale


def _outside_contacts(scene: Scene, law: Law, excess: Floats, steps: Floats, pairs: list[PairHistory]) -> Floats:
    speeds = [np.linalg.norm(pair.relative, axis=1) for pair in pairs]
    touched = np.array(
        [
            np.minimum(pair.gap[:-1], pair.gap[1:]) <= 2 * np.maximum(v[:-1], v[1:]) * steps + 1e-3 * scene.length
            for pair, v in zip(pairs, speeds, strict=True)
        ]
    )
    left = excess.copy()
    # Steps in which the same statics are touched are treated together.
    for pattern in np.unique(touched, axis=1).T:
        if pattern.any():
            steps_alike = np.flatnonzero((touched == pattern[:, None]).all(axis=0))
            contacts = [pair for pair, near in zip(pairs, pattern, strict=True) if near]
            left[steps_alike] = _impossible_part(scene, law, excess[steps_alike], contacts, steps_alike)
    return left


def _impossible_part(
    scene: Scene, law: Law, impulses: Floats, contacts: list[PairHistory], steps: NDArray[np.intp]
) -> Floats:
    coefficients = [scene.contact_of(pair.a, pair.b) for pair in contacts]
    if law == "doc" and any(c.bounciness < 1 or c.viscosity > 0 for c in coefficients):
        return np.zeros_like(impulses)
    normals: Floats = np.stack([pair.normal[steps] for pair in contacts], axis=2)
    along: Floats = (normals @ np.linalg.pinv(normals) @ impulses[:, :, None])[:, :, 0]
    beyond = impulses - along
    size = np.linalg.norm(beyond, axis=1)
    friction = max(c.friction for c in coefficients) if law == "nc" else 0.0
    over = np.maximum(size - friction * np.linalg.norm(along, axis=1), 0.0)
    return np.asarray(beyond * (over / np.where(size > 0, size, 1.0))[:, None])


def angular_momentum_drift(scene: Scene, law: Law, trajectory: Trajectory, impacts: list[Impact]) -> float | None:
    """Largest of `angular_momentum_drifts`; None where the law does not conserve it."""
    drifts = angular_momentum_drifts(scene, law, trajectory, impacts)
    return None if drifts is None else float(drifts.max())


def angular_momentum_drifts(scene: Scene, law: Law, trajectory: Trajectory, impacts: list[Impact]) -> Floats | None:
    """Change of the angular momentum about the common centre of mass, over the largest sum of m |r| |v| and spin,
    shape [T].

    None where the law does not conserve it: with statics, or with friction between bodies whose rotation is not
    modelled. Under the documents' law particle spheres change it by exactly -(1 - b) mu_r (R_A + R_B) n x u_p in
    each impact (RULES, consequence 1).
    """
    contacts = [scene.contact, *(contact for _, _, contact in scene.pairs)]
    rubbing = any(c.friction > 0 if law == "nc" else c.viscosity > 0 for c in contacts)
    if scene.statics or (rubbing and not scene.model.rotation):
        return None
    mass = masses(scene)
    centre = np.einsum("n,tni->ti", mass, trajectory.positions) / mass.sum()
    drift_velocity = np.einsum("n,tni->ti", mass, trajectory.velocities) / mass.sum()
    arms, speeds = trajectory.positions - centre[:, None], trajectory.velocities - drift_velocity[:, None]
    total = np.einsum("n,tni->ti", mass, np.cross(arms, speeds))
    scale = np.einsum("n,tn,tn->t", mass, np.linalg.norm(arms, axis=2), np.linalg.norm(speeds, axis=2))
    if trajectory.spins is not None:
        spin = spin_momenta(scene, trajectory)
        total, scale = total + spin.sum(axis=1), scale + np.linalg.norm(spin, axis=2).sum(axis=1)
    expected = np.zeros_like(total)
    if law == "doc" and not scene.model.rotation:
        for impact in impacts:
            expected[impact.last_step + 1 :] += _shared_sliding(scene, impact)
    largest = float(scale.max())
    return np.asarray(np.linalg.norm(total - total[0] - expected, axis=1) / (largest if largest > 0 else 1.0))


def _shared_sliding(scene: Scene, impact: Impact) -> Floats:
    a, b = scene.bodies[impact.a], scene.bodies[impact.b]
    assert a.mass is not None
    assert b.mass is not None
    reduced = a.mass * b.mass / (a.mass + b.mass)
    tangential = impact.before - (impact.before @ impact.normal) * impact.normal
    reach = getattr(a.shape, "radius", 0.0) + getattr(b.shape, "radius", 0.0)
    bounciness = scene.contact_of(impact.a, impact.b).bounciness
    return np.asarray(-(1 - bounciness) * reduced * reach * np.cross(impact.normal, tangential))


def spin_momenta(scene: Scene, trajectory: Trajectory) -> Floats:
    """Spin angular momenta about the bodies' own centres [kg m^2/s], world axes, shape [T, n, 3]; locked axes carry
    none.
    """
    assert trajectory.spins is not None
    assert trajectory.orientations is not None
    inertia = np.array([scene.bodies[index].principal_inertia() for index in scene.movable])
    inertia = np.where(np.isfinite(inertia), inertia, 0.0)
    axes = rotation_matrices(trajectory.orientations)
    own = np.einsum("tnij,tni->tnj", axes, trajectory.spins) * inertia
    momenta: Floats = np.einsum("tnij,tnj->tni", axes, own)
    return momenta


def energies(scene: Scene, trajectory: Trajectory) -> Floats:
    """Kinetic, spin and potential energy [J], shape [T]; potential is 0 at the origin."""
    mass = masses(scene)
    energy: Floats = 0.5 * np.einsum("n,tni,tni->t", mass, trajectory.velocities, trajectory.velocities)
    energy -= np.einsum("n,tni,i->t", mass, trajectory.positions, np.array(scene.gravity))
    if trajectory.spins is not None:
        energy += 0.5 * np.einsum("tni,tni->t", trajectory.spins, spin_momenta(scene, trajectory))
    return energy


def matched_offset(scene: Scene, trajectory: Trajectory) -> Floats:
    """What to add to `energies` so that positions and velocities belong to one instant [J], shape [T]; 0 at the start.

    A scheme that spends the fraction f of a step with the old velocity keeps E + (1/2 - f) h m g . v in free flight.
    """
    steps = np.diff(trajectory.times)
    step = np.concatenate([steps[:1], steps])
    power = np.einsum("n,tni,i->t", masses(scene), trajectory.velocities, np.array(scene.gravity))
    offset = (0.5 - flight_fraction(scene, trajectory)) * step * power
    return np.asarray(offset - offset[0])
