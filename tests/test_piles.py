"""Resting contact: tall columns, walls and unlike masses come to rest at exact heights, and the solver is that of the
complementarity problem.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference.contestant import Stepped
from impactbench.reference.pushes import Holds, hold_all
from impactbench.scenarios.crowds import column, wall

STEP = 1 / 240


def settled(scene, steps):
    """The state at the end, and the total energy [J] at the start and after each step."""
    run = Stepped(scene, "doc", "stepped", scene.model, STEP)
    mass = np.array([scene.bodies[i].mass for i in scene.movable])

    def energy():
        state = run.read()
        return float(mass @ ((state.velocities**2).sum(axis=1) / 2 - state.positions @ np.array(scene.gravity)))

    found = [energy()]
    for _ in range(steps):
        run.advance(1)
        found.append(energy())
    return run.read(), np.array(found)


@pytest.mark.parametrize(
    ("scene", "rows", "steps"),
    [
        (column(10), np.arange(10), 480),
        (column(100, 1e-4), np.arange(100), 480),
        (column(2, masses=[1.0, 1e4]), np.arange(2), 480),
        (column(2, masses=[1.0, 1e6]), np.arange(2), 480),
        (wall(10, 10), np.repeat(np.arange(10), 10), 480),
        (wall(2, 100), np.repeat(np.arange(100), 2), 480),
        (wall(10, 100, 1e-4), np.repeat(np.arange(100), 10), 60),
    ],
    ids=["column of 10", "column of 100", "1e4 on 1", "1e6 on 1", "wall 10 x 10", "wall 2 x 100", "wall 10 x 100"],
)
def test_piles_come_to_rest_at_exact_heights(scene, rows, steps):
    state, energy = settled(scene, steps)
    assert np.abs(state.positions[:, 2] - (rows + 0.5)).max() <= 1e-6
    assert np.abs(state.velocities).max() <= 1e-9
    # What the fall gave is gone, and no step added any: round-off of a sum of a thousand terms.
    assert np.diff(energy).max() <= 1e-13 * energy[0]
    assert energy[-1] < energy[0]


@given(st.integers(0, 10_000), st.integers(1, 30), st.floats(0, 2))
@settings(max_examples=40, deadline=None)
def test_pushes_solve_the_complementarity_problem(seed, bodies, spread):
    """No contact approaches, no push pulls, and what pushes does not part; momentum is kept, energy not gained."""
    rng = np.random.default_rng(seed)
    inverse = 10 ** rng.uniform(-spread / 2, spread / 2, bodies + 1)
    inverse[0] = 0.0
    # A tree of contacts, and as many again at random: some repeat one another.
    pairs = [(int(rng.integers(0, i)), i) for i in range(1, bodies + 1)]
    pairs += [tuple(sorted(rng.choice(bodies + 1, 2, replace=False).tolist())) for _ in range(bodies)]
    first, second = np.array(pairs, dtype=np.int64).T.copy()
    normal = rng.normal(size=(len(pairs), 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    velocity = rng.normal(size=(bodies + 1, 3))
    velocity[0] = 0.0
    before = velocity.copy()
    holds = Holds(
        first, second, normal, np.zeros(len(pairs)), 1 / (inverse[first] + inverse[second]), np.zeros(len(pairs))
    )
    assert hold_all(velocity, inverse, holds, 1e-13) <= 1e-13
    speed = ((velocity[second] - velocity[first]) * normal).sum(axis=1)
    assert holds.push.min() >= 0
    # A last sweep that changed nothing by more than 1e-13 was taken contact by contact: what comes later in it may
    # undo what came before by as much, for each of a body's contacts.
    assert speed.min() >= -1e-13 * len(pairs)
    assert np.abs(speed[holds.push > 0]).max(initial=0.0) <= 1e-13 * len(pairs)
    given_away = np.zeros_like(velocity)
    for c, (a, b) in enumerate(pairs):
        given_away[a] -= inverse[a] * holds.push[c] * normal[c]
        given_away[b] += inverse[b] * holds.push[c] * normal[c]
    assert np.abs(before + given_away - velocity).max() <= 1e-10
    mass = 1 / inverse[1:]
    assert (mass @ velocity[1:] ** 2).sum() <= (mass @ before[1:] ** 2).sum() * (1 + 1e-12)
