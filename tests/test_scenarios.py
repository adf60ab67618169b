"""Every truth of the catalogue against invariants apart from its own derivation, and the selection of cases."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest
from impactbench.scenarios.catalogue import FAMILIES, UnknownCase, all_cases, select
from impactbench.scenarios.pieces import multiply
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Law, Scene, Sphere, shifted
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case, Truth

CASES = all_cases()
TRUTHS = [pytest.param(c, law, id=f"{c.scene.name}-{law}") for c in CASES for law in c.truths]
LONGEST_STEP = 1 / 30  # s; a start may be shifted by at most one
INSTANT = 1e-9  # s, either side of an impact
# Round-off: some 1e3 operations on numbers below 10 leave less than 1e3 * 10 * 2.2e-16 = 2.2e-12.
ROUND_OFF = 2.2e-12


def known(truth: Truth, times: list[float]) -> list[tuple[float, State]]:
    return [(t, state) for t in times if (state := truth.state(t)) is not None]


def span(scene: Scene, count: int = 301) -> list[float]:
    return [float(t) for t in np.linspace(0.0, scene.duration, count)]


# Names and selection


def test_names_are_unique_and_parse_into_family_and_parameters() -> None:
    names = [case.scene.name for case in CASES]
    assert len(set(names)) == len(names)
    for case in CASES:
        scene = case.scene
        match = re.fullmatch(r"(\w+)\[(.+)\]", scene.name)
        assert match, scene.name
        assert match[1] in FAMILIES
        pairs = dict(part.split("=") for part in match[2].split(","))
        assert pairs == {k: f"{v:g}" if isinstance(v, float) else str(v) for k, v in scene.parameters.items()}


def test_the_catalogue_has_all_core_families() -> None:
    assert len(FAMILIES) >= 22
    assert {case.scene.family for case in CASES} == set(FAMILIES)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.scene.name)
def test_every_name_selects_exactly_its_case(case: Case) -> None:
    assert select([case.scene.name]) == [case]


def test_selection_keeps_the_order_of_the_catalogue_without_duplicates() -> None:
    assert select() == select(["*"]) == CASES
    assert select(["static_wall", "equal_masses", "equal_masses[bounciness=0.5]"]) == select(
        ["equal_masses", "static_wall"]
    )
    assert {c.scene.family for c in select(["*_wall"])} == {"static_wall", "oblique_wall"}
    assert [c.scene.name for c in select(["equal_masses[bounciness=?]"])] == [
        "equal_masses[bounciness=0]",
        "equal_masses[bounciness=1]",
    ]


@pytest.mark.parametrize(
    ("pattern", "nearest"),
    [
        ("equal_mases", "equal_masses"),
        ("equal_masses[bounciness=0.6]", "equal_masses[bounciness=0.5]"),
        ("", "free_flight"),
    ],
)
def test_an_unknown_name_is_answered_in_one_line_with_the_nearest(pattern: str, nearest: str) -> None:
    with pytest.raises(UnknownCase) as caught:
        select(["free_flight", pattern])
    assert nearest in str(caught.value)
    assert "\n" not in str(caught.value)


# Scenes


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.scene.name)
def test_a_scene_is_well_formed(case: Case) -> None:
    scene = case.scene
    assert set(case.truths) == set(scene.laws)
    assert len({body.name for body in scene.bodies}) == len(scene.bodies)
    assert {name for a, b, _ in scene.pairs for name in (a, b)} <= {body.name for body in scene.bodies}
    assert min(scene.length, scene.speed, scene.energy, scene.duration) > 0
    frames = scene.duration * 30
    assert math.isclose(frames, round(frames), abs_tol=1e-9)
    assert scene.model.gravity == any(scene.gravity)
    still = [axis for axis in range(3) if axis not in scene.model.axes]
    for i in scene.movable:
        assert not any(scene.bodies[i].velocity[axis] or scene.gravity[axis] for axis in still)
    contacts = [scene.contact, *(contact for *_, contact in scene.pairs)]
    assert scene.model.friction == any(c.friction or c.viscosity for c in contacts)
    # One law of friction each: viscous under `doc`, Coulomb under `nc`.
    assert not any(c.viscosity for c in contacts) or scene.laws == ("doc",)
    assert not any(c.friction for c in contacts) or scene.laws == ("nc",)


# Truths


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_a_truth_begins_as_the_scene_does(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    if truth.kind != "trajectory":
        return
    start, bodies = truth.state(0.0), [case.scene.bodies[i] for i in case.scene.movable]
    assert start is not None
    assert np.array_equal(start.positions, [b.position for b in bodies])
    assert np.array_equal(start.velocities, [b.velocity for b in bodies])
    assert (start.spins is not None) == (start.orientations is not None) == scene.model.rotation
    if start.spins is not None and start.orientations is not None:
        np.testing.assert_allclose(start.spins, [b.spin for b in bodies], atol=ROUND_OFF)
        assert np.array_equal(start.orientations, [b.orientation for b in bodies])


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_a_shifted_start_lies_on_the_truth(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    if not scene.phase_free:
        with pytest.raises(ValueError, match="cannot be shifted"):
            shifted(scene, LONGEST_STEP)
    elif truth.kind == "trajectory":
        earlier, start = shifted(scene, LONGEST_STEP), truth.state(-LONGEST_STEP)
        assert start is not None
        bodies = [earlier.bodies[i] for i in earlier.movable]
        np.testing.assert_allclose(start.positions, [b.position for b in bodies], atol=ROUND_OFF)
        np.testing.assert_allclose(start.velocities, [b.velocity for b in bodies], atol=ROUND_OFF)


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_motion_stays_in_the_model_and_never_ends_at_an_impact(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    still = [axis for axis in range(3) if axis not in scene.model.axes]
    starts = np.array([scene.bodies[i].position for i in scene.movable])
    for _, state in known(truth, span(scene)):
        assert np.array_equal(state.positions[:, still], starts[:, still])
        assert not state.velocities[:, still].any()
    times = list(truth.impact_times)
    assert times == sorted(times)
    assert all(0 < t < scene.duration - LONGEST_STEP for t in times)
    assert (truth.kind == "invariant") == (truth.state(scene.duration) is None)


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_bodies_never_overlap(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    # A shifted start lies before 0; the truth must then be free of overlap too.
    before = [-LONGEST_STEP, -LONGEST_STEP / 2] if scene.phase_free and truth.kind == "trajectory" else []
    for time, state in known(truth, [*before, *span(scene), *truth.impact_times]):
        for pair, value in gaps(scene, state).items():
            assert value > -ROUND_OFF, f"{pair} overlap by {-value} m at {time} s"


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_some_pair_touches_at_every_impact(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    # Impact times of corner hits are rounded to 1e-12 s; at 20 m/s that is 2e-11 m.
    for time, state in known(truth, list(truth.impact_times)):
        assert min(gaps(scene, state).values()) < 2e-11, time


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_positions_are_continuous_at_impacts(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    for time in truth.impact_times:
        ends = known(truth, [time - INSTANT, time + INSTANT])
        if len(ends) == 2:
            (_, before), (_, after) = ends
            fastest = max(np.abs(before.velocities).max(), np.abs(after.velocities).max())
            assert np.abs(after.positions - before.positions).max() <= 2 * INSTANT * fastest + ROUND_OFF
            if before.orientations is not None and after.orientations is not None:
                # A quaternion turns at half the spin.
                spin = max(np.abs(s.spins).max() for s in (before, after) if s.spins is not None)
                assert np.abs(after.orientations - before.orientations).max() <= 2 * INSTANT * spin + ROUND_OFF
    assert scene.duration > 0


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_velocity_is_the_rate_of_position_and_spin_that_of_orientation(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    # Central differences over d are exact for parabolas; a kink of the velocity's rate adds rate * d (at most 30 m/s^2,
    # or 5/2 g/R = 245 rad/s^2 for spins), a third derivative j adds j d^2/6, round-off 10 eps/d = 2e-9.
    d, slope, spin_slope = 1e-6, 3e-5, 3e-4
    for time, now in known(truth, span(scene, 97)):
        ends = [truth.state(time - d), truth.state(time + d)]
        if any(abs(time - t) <= d for t in truth.impact_times) or ends[0] is None or ends[1] is None:
            continue
        rate = (ends[1].positions - ends[0].positions) / (2 * d)
        np.testing.assert_allclose(rate, now.velocities, atol=slope + 2e-9)
        if now.spins is None:
            continue
        assert now.orientations is not None
        np.testing.assert_allclose(np.linalg.norm(now.orientations, axis=1), 1, atol=ROUND_OFF)
        for row, spin in enumerate(now.spins):
            assert ends[0].orientations is not None
            assert ends[1].orientations is not None
            conjugate = ends[0].orientations[row] * np.array([1, -1, -1, -1])
            turned = multiply(ends[1].orientations[row], conjugate)
            np.testing.assert_allclose(2 * turned[1:] * np.sign(turned[0]) / (2 * d), spin, atol=spin_slope)


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_impacts_keep_momentum_and_scale_relative_energy(case: Case, law: Law) -> None:
    """Consequences 1 and 2: E' = E_cm + b^2 E_rel under `doc`; under `nc` the tangential part of E_rel stays whole."""
    scene, truth = case.scene, case.truths[law]
    if scene.model.rotation or truth.kind != "trajectory":
        return  # R14 has its own bookkeeping in the closed forms
    masses = [scene.bodies[i].mass or math.inf for i in scene.movable]
    for time in truth.impact_times:
        (_, before), (_, after) = known(truth, [time - INSTANT, time + INSTANT])
        change = after.velocities - before.velocities
        # Gravity adds 2 g INSTANT = 2e-8 m/s, far less than any impact here but the last ones of a Zeno sequence.
        hit = [row for row in range(len(masses)) if np.abs(change[row]).max() > 1e-6]
        if len(hit) == 1:
            (row,) = hit
            weight, u0, u1 = masses[row], before.velocities[row], after.velocities[row]
        elif len(hit) == 2:
            a, b = hit
            weight = masses[a] * masses[b] / (masses[a] + masses[b])
            total = sum(masses[r] * change[r] for r in hit)
            drift = (masses[a] + masses[b]) * 2 * np.array(scene.gravity) * INSTANT
            np.testing.assert_allclose(total, drift, atol=ROUND_OFF * (masses[a] + masses[b]))
            u0, u1 = before.velocities[b] - before.velocities[a], after.velocities[b] - after.velocities[a]
        else:
            assert not hit
            continue
        e = scene.contact.bounciness
        normal = (u1 - u0) / np.linalg.norm(u1 - u0)
        kept = (u0 @ u0 - (u0 @ normal) ** 2) if law == "nc" else 0.0
        expected = kept + e**2 * (u0 @ u0 - kept)
        # The velocities are INSTANT off the impact: relative energy is off by u g INSTANT at most.
        np.testing.assert_allclose(weight * (u1 @ u1), weight * expected, rtol=1e-7, atol=weight * 1e-7)


@pytest.mark.parametrize(("case", "law"), TRUTHS)
def test_energy_never_grows(case: Case, law: Law) -> None:
    scene, truth = case.scene, case.truths[law]
    energies = [energy(scene, state) for _, state in known(truth, span(scene))]
    heaviest = max(scene.bodies[i].mass or 0.0 for i in scene.movable)
    assert all(later <= earlier + heaviest * 100 * ROUND_OFF for earlier, later in itertools.pairwise(energies))
    contacts = [scene.contact, *(contact for *_, contact in scene.pairs)]
    if energies and all(c.bounciness == 1 and not c.friction for c in contacts):
        assert energies[-1] == pytest.approx(energies[0], rel=1e-12)


# Geometry and energy, from shapes and states alone


def energy(scene: Scene, state: State) -> float:
    """Kinetic and potential energy [J]; spins count with the moments about the body's own axes."""
    total = 0.0
    for row, index in enumerate(scene.movable):
        body = scene.bodies[index]
        assert body.mass is not None
        v = state.velocities[row]
        total += body.mass * (v @ v / 2 - np.array(scene.gravity) @ state.positions[row])
        if state.spins is not None and state.orientations is not None:
            own = rotation(state.orientations[row]).T @ state.spins[row]
            total += float(np.array(body.principal_inertia()) @ own**2) / 2
    return float(total)


def rotation(q: Floats) -> Floats:
    """Matrix of a unit quaternion, whose columns are the body's own axes."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix: Floats = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return matrix


def gaps(scene: Scene, state: State) -> dict[str, float]:
    """Distance [m] of every pair that can meet, negative where they overlap; no static-static pairs (R2)."""
    if not scene.collide:
        return {}
    rows = {index: row for row, index in enumerate(scene.movable)}
    values = {}
    for i, j in itertools.combinations(range(len(scene.bodies)), 2):
        a, b = scene.bodies[i], scene.bodies[j]
        if not (a.static and b.static):
            values[f"{a.name} and {b.name}"] = gap(a, placed(a, state, rows.get(i)), b, placed(b, state, rows.get(j)))
    return values


def placed(body: Body, state: State, row: int | None) -> tuple[Floats, Floats]:
    if row is None:
        return np.array(body.position), np.eye(3)
    turned = np.array(body.orientation) if state.orientations is None else state.orientations[row]
    return state.positions[row], rotation(turned)


def gap(a: Body, at: tuple[Floats, Floats], b: Body, bt: tuple[Floats, Floats]) -> float:
    match a.shape, b.shape:
        case (_, HalfSpace()) | (Box(), Sphere()):
            return gap(b, bt, a, at)
        case HalfSpace(normal), _:
            return float((bt[0] - at[0]) @ normal) - reach(b, bt[1], np.array(normal))
        case Sphere(r), Sphere(s):
            return float(np.linalg.norm(bt[0] - at[0])) - r - s
        case Sphere(r), Box(half):
            own = bt[1].T @ (at[0] - bt[0])
            return float(np.linalg.norm(own - np.clip(own, np.negative(half), half))) - r
        case Box(half), Box(other):  # level boxes only
            return float((np.abs(bt[0] - at[0]) - half - other).max())
    raise NotImplementedError(f"{a.shape} and {b.shape}")


def reach(body: Body, axes: Floats, normal: Floats) -> float:
    """How far the body extends against the normal from its centre [m]."""
    own = np.abs(axes.T @ normal)
    match body.shape:
        case Sphere(radius):
            return radius
        case Box(half):
            return float(own @ half)
        case Capsule(radius, half_length):
            return radius + half_length * float(own[2])
    raise NotImplementedError(str(body.shape))
