"""The catalogue's truths of rotating impacts against the laws, which see only the scene and the contact point."""

from __future__ import annotations

import numpy as np
import pytest
from impactbench.reference import rigid_impact, rigid_newton
from impactbench.reference.rigid_body import Motions, Rigid, approaching, rotation, static, world_inertia
from impactbench.scenarios import rigid, rolling
from impactbench.scenarios.records import Body, Sphere
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case

CASES = [
    pytest.param(case, law, id=f"{case.scene.name}-{law}")
    for family in (*rigid.FAMILIES, *rolling.FAMILIES)
    if family.name in {"rigid_offset_hit", "rod_drop", "oblique_friction_impact"}
    for case in family.cases()
    for law in case.truths
]


def foremost(body: Body, position: Floats, orientation: Floats, direction: Floats) -> Floats:
    """The point of a ball or capsule that lies farthest along a direction."""
    tip = position + body.shape.radius * direction
    if isinstance(body.shape, Sphere):
        return tip
    axis = rotation(tuple(orientation))[:, 2]
    return tip + np.sign(axis @ direction) * body.shape.half_length * axis


def at_contact(case: Case, state: State) -> tuple[Rigid, Rigid, Floats]:
    """A, B and n: the first movable body meets the floor below it, or the box before it."""
    scene = case.scene
    moving = [scene.bodies[i] for i in scene.movable]
    n = np.array([0.0, 0.0, 1.0]) if scene.statics else np.array([1.0, 0.0, 0.0])
    point = foremost(moving[0], state.positions[0], state.orientations[0], -n if scene.statics else n)
    rigids = [
        Rigid(body.mass, world_inertia(body.principal_inertia(), tuple(q)), v, w, point - x)
        for body, x, v, q, w in zip(
            moving, state.positions, state.velocities, state.orientations, state.spins, strict=True
        )
    ]
    a, b = (static(np.zeros(3)), *rigids) if scene.statics else rigids
    return a, b, n


def respond(case: Case, law: str, a: Rigid, b: Rigid, n: Floats) -> Motions:
    contact = case.scene.contact
    if law == "doc":
        return rigid_impact.bounce(a, b, n, contact.bounciness)
    return rigid_newton.restitution(a, b, n, contact.bounciness, contact.friction)


@pytest.mark.parametrize(("case", "law"), CASES)
def test_the_truth_after_the_impact_is_the_law(case, law):
    truth = case.truths[law]
    (time,) = truth.impact_times
    a, b, n = at_contact(case, truth.state(time - 1e-12))
    assert approaching(a, b, n)
    state = truth.state(time)
    expected = [m for x, m in zip((a, b), respond(case, law, a, b, n), strict=True) if not x.static]
    found = np.stack((state.velocities, state.spins), axis=1)
    # The state before is taken 1e-12 s early, so that arms differ by some 1e-12 m; spins are of the order of 100 rad/s.
    assert found == pytest.approx(np.array(expected), abs=1e-10)
    assert not approaching(*at_contact(case, state))
