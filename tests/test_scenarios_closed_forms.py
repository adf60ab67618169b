"""Each family's truth against the textbook law it claims, derived line by line apart from the code."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from impactbench.scenarios import flight, gravity_drops, lines, pairs, rigid, rolling, sliding, walls
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.laws import impact, mass_shares
from impactbench.scenarios.records import Law
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case

G = 9.81
# Round-off of the few operations behind one number below 10, with room for a hundred of them: 100 * 10 * 2.2e-16.
EXACT = 2.2e-13


def at(case: Case, time: float, law: Law = "nc") -> State:
    state = case.truths[law].state(time)
    assert state is not None
    return state


def end(case: Case, law: Law = "nc") -> State:
    return at(case, case.scene.duration, law)


def close(actual: object, expected: object, tolerance: float = EXACT) -> None:
    np.testing.assert_allclose(np.asarray(actual), np.asarray(expected), rtol=0, atol=tolerance)


# Free flight


def test_free_flight_is_the_parabola() -> None:
    case = flight.free_flight(3)
    for t in (-0.1, 0.0, 0.4, 1.0):
        close(at(case, t).positions[0], [3 * t, -2 * t, 5 + 5 * t - G * t**2 / 2])
        close(at(case, t).velocities[0], [3, -2, 5 - G * t])


@pytest.mark.parametrize("velocity_first", [True, False])
def test_discrete_flight_is_what_euler_leaves(velocity_first: bool) -> None:
    scene, step, steps = flight.free_flight(2).scene, 1 / 60, 60
    x, v, g = (np.array(vector) for vector in (scene.bodies[0].position, scene.bodies[0].velocity, scene.gravity))
    for _ in range(steps):
        if velocity_first:
            v = v + step * g
            x = x + step * v
        else:
            x = x + step * v
            v = v + step * g
    state = flight.discrete_flight(scene, step, steps, velocity_first)
    close(state.positions[0], x)
    close(state.velocities[0], v)


# Pairs and walls


def r9(masses: tuple[float, float], before: Floats, normal: Floats, b: float) -> Floats:
    """R9 as the documents give it: R7 and R8 apart, then interpolated."""
    m_a, m_b = masses
    push = (
        2 * m_a * m_b / (m_a + m_b) * (before[1] @ normal - before[0] @ normal) * normal
    )  # R7: i_A = 2 mu_r (s_B - s_A) n
    elastic = np.array([before[0] + push / m_a, before[1] - push / m_b])
    joint = (m_a * before[0] + m_b * before[1]) / (m_a + m_b)  # R8
    mixed: Floats = b * elastic + (1 - b) * np.array([joint, joint])
    return mixed


def test_the_impact_law_is_r7_to_r9_and_newton_for_any_pair() -> None:
    random = np.random.default_rng(7)
    for _ in range(100):
        masses = (float(random.uniform(0.1, 10)), float(random.uniform(0.1, 10)))
        before, normal = random.normal(size=(2, 3)), random.normal(size=3)
        normal /= np.linalg.norm(normal)
        b = float(random.uniform())
        close(impact("doc", masses, (before[0], before[1]), normal, b), r9(masses, before, normal, b))
        after = np.array(impact("nc", masses, (before[0], before[1]), normal, b))
        u0, u1 = before[1] - before[0], after[1] - after[0]
        close(u1 @ normal, -b * (u0 @ normal))  # Newton
        close(np.cross(u1, normal), np.cross(u0, normal))  # no friction
        close(np.array(masses) @ after, np.array(masses) @ before)  # R6


def test_two_static_bodies_have_no_impact() -> None:
    with pytest.raises(ValueError, match="R2"):
        mass_shares(math.inf, math.inf)


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_equal_masses_swap_share_or_split(law: Law) -> None:
    for b in pairs.BOUNCINESS:
        close(end(pairs.equal_masses(b), law).velocities[:, 0], [(1 - b) * 3 / 2, (1 + b) * 3 / 2])  # R12
    moving = pairs.equal_masses(0.5, frame=-2.0)
    close(end(moving, law).velocities[:, 0], [0.75 - 2, 2.25 - 2])
    close(moving.truths[law].impact_times, pairs.equal_masses(0.5).truths[law].impact_times)


def test_unequal_masses_follow_r7_to_r9_up_to_a_million() -> None:
    for r in pairs.MASS_RATIOS:
        for b in (1.0, 0.5):
            velocities = end(pairs.unequal_masses(r, b)).velocities[:, 0]
            close(velocities, [(r - b) / (r + 1) * 3, (1 + b) * r / (r + 1) * 3])


def test_an_oblique_pair_meets_where_the_offset_says_and_follows_each_law() -> None:
    for offset, b in itertools.product(pairs.OFFSETS, (1.0, 0.5, 0.0)):
        case = pairs.oblique_pair(offset, b)
        normal = np.array([math.sqrt(1 - offset**2), offset, 0.0])  # sin of the angle to x = offset
        close(case.truths["doc"].impact_times[0], (1.03 - 0.2 * normal[0]) / 3)
        before = np.array([[3.0, 0, 0], [0, 0, 0]])
        close(end(case, "doc").velocities, r9((1.0, 2.0), before, normal, b))
        push = 2 / 3 * (1 + b) * 3 * normal[0] * normal  # mu_r (1 + e) u_n
        close(end(case, "nc").velocities, [before[0] - push, push / 2])


def test_a_wall_sends_back_b_times_the_speed() -> None:
    for b in walls.BOUNCINESS:
        case = walls.static_wall(b)
        close(case.truths["nc"].impact_times[0], 0.76 / 3)
        close(end(case).velocities[0, 2], 3 * b)  # R13


def test_an_oblique_bounce_scales_the_tangent_under_doc_only() -> None:
    for case in select(["oblique_wall"]):
        angle, b = math.radians(float(case.scene.parameters["angle"])), case.scene.contact.bounciness
        normal = np.array([0, 0, 1.0]) if case.scene.parameters["dimension"] == 2 else np.array([1, 2, 2]) / 3
        for law, kept in (("doc", b), ("nc", 1.0)):
            velocity = end(case, law).velocities[0]  # type: ignore[arg-type]
            close(velocity @ normal, b * 3 * math.cos(angle))
            close(np.linalg.norm(np.cross(velocity, normal)), kept * 3 * math.sin(angle))


def test_unfolding_is_reflection_one_wall_after_the_other() -> None:
    for case in select(["box_of_walls"]):
        ball = case.scene.bodies[0]
        room = np.max([np.abs(body.position) for body in case.scene.bodies[1:]], axis=0) - 0.1
        x, v, left = np.array(ball.position), np.array(ball.velocity), case.scene.duration
        while True:
            waits = [(math.copysign(room[k], v[k]) - x[k]) / v[k] if v[k] else math.inf for k in range(3)]
            wait = min(waits)
            if wait > left:
                break
            x, left = x + v * wait, left - wait
            v = np.where(np.abs(np.array(waits) - wait) < 1e-12, -v, v)
        close(end(case).positions[0], x + v * left, 1e-12)
        close(end(case).velocities[0], v)
    corner = walls.box_of_walls(2, "corner").truths["nc"]
    close(
        at(walls.box_of_walls(2, "corner"), corner.impact_times[0] + 1e-6).velocities[0, [0, 2]],
        [-3 / math.sqrt(2)] * 2,
    )


# Gravity


def test_a_bouncing_ball_loses_e_squared_of_its_height_and_rests_at_the_zeno_time() -> None:
    for e in gravity_drops.BOUNCINESS:
        case = gravity_drops.bouncing_ball(e)
        times, first = case.truths["nc"].impact_times, math.sqrt(2 / G)
        close(times[0], first)
        for n, (start, stop) in enumerate(itertools.pairwise(times), 1):
            if n < 10:
                close(at(case, (start + stop) / 2).positions[0, 2], 0.1 + e ** (2 * n))
        zeno = first * (1 + e) / (1 - e) if e < 1 else math.inf
        if zeno < case.scene.duration:
            assert zeno - times[-1] < 2e-9 or e == 0
            close(at(case, zeno + 1e-9).positions[0, 2], 0.1)
            assert not end(case).velocities.any()


def test_a_column_rests_at_exact_heights_once_the_top_has_arrived() -> None:
    for case in select(["stacked_drop"]):
        count, truth = int(case.scene.parameters["count"]), case.truths["nc"]
        settled = math.sqrt(2 * 0.05 * count / G)  # the top falls through all gaps
        assert truth.state(settled - 1e-9) is None
        close(at(case, settled + 1e-9).positions[:, 2], [0.1 + 0.2 * i for i in range(count)])


def test_the_cannon_gives_the_textbook_speed_less_the_fall_through_the_gap() -> None:
    """At the floor v = sqrt(2 g h); the gap closes at 2 v, in d = gap/2v, while all gain -g d.

    In the frame that falls along, the pair has speeds v and -v: the top leaves at (3 M - m)/(M + m) v.
    """
    case = gravity_drops.galilean_cannon(2)
    v = math.sqrt(2 * G * 0.3)
    delay = 0.01 / (2 * v)
    close(case.truths["nc"].impact_times[:2], [v / G, v / G + delay])
    later = delay + 1e-6
    close(at(case, v / G + later).velocities[1, 2], (3 * 10 - 1) / (10 + 1) * v - G * later)


def test_the_third_ball_of_the_cannon_is_hit_by_the_second_alone() -> None:
    case = gravity_drops.galilean_cannon(3)
    v = math.sqrt(2 * G * 0.3)
    second = (3 * 100 - 10) / (100 + 10) * v  # in the frame that falls along
    delay = 0.01 / (2 * v) + 0.01 / (second + v)
    close(case.truths["nc"].impact_times[2], v / G + delay)
    third = (2 * 10 * second + (1 - 10) * -v) / (10 + 1)  # R7: (2 M V + (m - M) w)/(M + m), with w = -v
    later = delay + 1e-6
    close(at(case, v / G + later).velocities[2, 2], third - G * later)


# Rows


def test_only_the_last_ball_of_a_cradle_leaves() -> None:
    for count in (3, 5):
        case = lines.newtons_cradle(count, 0.01)
        close(end(case).velocities[:, 0], [0] * (count - 1) + [3])
        close(case.truths["nc"].impact_times, [(0.536 + 0.01 * i) / 3 for i in range(count - 1)])
    assert lines.newtons_cradle(5, 0.0).truths["nc"].kind == "invariant"


def test_a_chain_hands_on_two_m_over_the_sum() -> None:
    for count, ratio in ((5, 0.5), (4, 2.0)):
        final = end(lines.mass_chain(count, ratio)).velocities[-1, 0]
        close(final, 3 * (2 / (1 + ratio)) ** (count - 1))


# Sliding


def test_viscous_friction_decays_exponentially() -> None:
    for c in (0.5, 2.0, 10.0):
        case = sliding.viscous_slide(c)
        for t in (0.3, 1.5):
            state = at(case, t, "doc")
            close(state.velocities[0, 0], 3 * math.exp(-c * t))
            close(3 - state.velocities[0, 0], c * state.positions[0, 0])  # m (v0 - v) = c x, from m dv = -c dx


def test_coulomb_friction_stops_where_the_work_is_done_at_any_heading() -> None:
    for heading in (0.0, 22.5, 45.0):
        case = sliding.coulomb_slide(heading)
        final = end(case).positions[0]
        close(0.3 * G * math.hypot(final[0], final[1]), 9 / 2)  # mu g s = v0^2/2
        close(math.degrees(math.atan2(final[1], final[0])), heading, 1e-12)
        assert at(case, 3 / (0.3 * G) - 1e-6).velocities.any()
        assert not at(case, 3 / (0.3 * G) + 1e-6).velocities.any()


def test_an_incline_holds_up_to_the_critical_angle() -> None:
    for angle in sliding.ANGLES:
        th = math.radians(angle)
        moved, t = end(sliding.incline(angle)).positions[0, 0], 1.5
        if math.tan(th) <= 0.3:
            assert moved == 0
        else:
            close(moved, G * (math.sin(th) - 0.3 * math.cos(th)) * t**2 / 2)


@pytest.mark.parametrize(("friction", "law"), [("coulomb", "nc"), ("viscous", "doc")])
def test_block_and_slab_keep_momentum_and_slip_as_far_as_the_law_says(friction: str, law: Law) -> None:
    case = sliding.sliding_on_slab(friction)
    for t in np.linspace(0, 1.5, 31):
        close(np.array([2.0, 1.0]) @ at(case, float(t), law).velocities[:, 0], 2.0)
    final = end(case, law)
    slip = (final.positions[1, 0] + 0.3) - final.positions[0, 0]
    if friction == "coulomb":
        close(final.velocities[:, 0], [2 / 3, 2 / 3])
        close(slip, 2**2 / (2 * 0.3 * G * (1 + 1 / 2)))
    else:
        rate = 2.0 / (2 / 3)  # c/mu_r
        close(final.velocities[1, 0] - final.velocities[0, 0], 2 * math.exp(-rate * 1.5))
        close(slip, 2 / rate * (1 - math.exp(-rate * 1.5)))


# Rolling. A sphere has I = 2/5 m R^2, here m = 1, R = .1; about the contact point the angular momentum is m R v + I w.


def about_contact(state: State) -> float:
    assert state.spins is not None
    return float(0.1 * state.velocities[0, 0] + 0.4 * 0.1**2 * state.spins[0, 1])


def slip(state: State) -> float:
    assert state.spins is not None
    return float(state.velocities[0, 0] - 0.1 * state.spins[0, 1])


def test_friction_cannot_change_the_angular_momentum_about_the_contact_point() -> None:
    for mu in (0.1, 0.3):
        case, onset = rolling.rolling_onset(mu), 2 * 3 / (7 * mu * G)
        for t in np.linspace(0, 1, 31):
            close(about_contact(at(case, float(t))), 0.1 * 3)
        close(slip(at(case, onset * (1 - 1e-9))), 3e-9, 1e-12)
        close(slip(end(case)), 0)
        close(end(case).velocities[0, 0], 5 / 7 * 3)


def test_rolling_down_keeps_energy_and_slipping_obeys_coulomb() -> None:
    for angle, mu in ((10, 0.5), (30, 0.5), (60, 0.3)):
        case, th = rolling.rolling_incline(angle, mu), math.radians(angle)
        final = end(case)
        assert final.spins is not None
        v, w, x = final.velocities[0, 0], final.spins[0, 1], final.positions[0, 0]
        close(about_contact(final), 0.1 * G * math.sin(th))  # weight's moment times 1 s
        if mu >= 2 / 7 * math.tan(th):
            close(slip(final), 0)
            close(v**2 / 2 + 0.4 * 0.01 * w**2 / 2, G * math.sin(th) * x)
        else:
            assert slip(final) > 0
            close(v, G * (math.sin(th) - mu * math.cos(th)))


def test_an_oblique_bounce_with_friction_sticks_or_slides() -> None:
    for angle, e in itertools.product((30, 60), (1.0, 0.5)):
        case, th = rolling.oblique_friction_impact(angle, e), math.radians(angle)
        v_t, v_n, after = 3 * math.sin(th), 3 * math.cos(th), end(case)
        close(after.velocities[0, 2], e * v_n)
        close(about_contact(after), 0.1 * v_t)
        tangential, normal = v_t - after.velocities[0, 0], (1 + e) * v_n  # impulses per mass
        if v_t >= 7 / 2 * 0.2 * (1 + e) * v_n:
            close(tangential, 0.2 * normal)
            assert slip(after) >= 0
        else:
            close(slip(after), 0)
            assert tangential < 0.2 * normal


# Rigid bodies


def test_an_offset_hit_keeps_momentum_angular_momentum_and_restitution() -> None:
    inertia = {"ball": 0.4 * 0.01, "box": 4.0 * (0.1**2 + 0.5**2) / 3}
    for case, law in itertools.product(select(["rigid_offset_hit"]), ("doc", "nc")):
        offset, e = float(case.scene.parameters["offset"]), case.scene.contact.bounciness
        after = at(case, case.truths["nc"].impact_times[0], law)  # type: ignore[arg-type]
        assert after.spins is not None
        masses, v, x, w = np.array([1.0, 4.0]), after.velocities, after.positions, after.spins[:, 2]
        close(masses @ v, [3, 0, 0])
        orbital = masses @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
        close(orbital + inertia["ball"] * w[0] + inertia["box"] * w[1], -offset * 3)
        # Contact point at (-R_box, offset): normal velocity v_x - w * arm_y; the ball's arm is along the normal.
        approach = (v[1, 0] - w[1] * offset) - v[0, 0]
        close(approach, e * 3)


def test_a_rod_turns_about_its_end_as_the_impulse_says() -> None:
    for case in select(["rod_drop"]):
        th, e = math.radians(float(case.scene.parameters["angle"])), case.scene.contact.bounciness
        time, arm = case.truths["nc"].impact_times[0], math.cos(th) / 2
        after, doc = at(case, time), at(case, time, "doc")
        assert after.spins is not None
        assert doc.spins is not None
        v, w = after.velocities[0, 2], after.spins[0, 1]
        close(v + w * arm, e * 0.5)  # Newton at the contact point: the end lies at -arm, w x r = + w arm
        close(-v * arm + w / 12, 0.5 * arm)  # no moment about the contact point: L before and after
        elastic = at(rigid.rod_drop(int(case.scene.parameters["angle"]), 1.0), time)
        assert elastic.spins is not None
        close(doc.velocities, e * elastic.velocities)
        close(doc.spins, e * elastic.spins)


def test_free_rotation_keeps_angular_momentum_and_satisfies_euler() -> None:
    case = rigid.torque_free_spin("prism")
    moments = np.array(case.scene.bodies[0].principal_inertia())

    def own(time: float) -> tuple[Floats, Floats]:
        state = at(case, time)
        assert state.spins is not None
        assert state.orientations is not None
        w, v = state.orientations[0, 0], state.orientations[0, 1:]
        cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        axes = np.eye(3) + 2 * w * cross + 2 * cross @ cross
        spin = axes.T @ state.spins[0]
        return spin, axes @ (moments * spin)

    for t in np.linspace(0, 2, 21):
        spin, momentum = own(float(t))
        close(momentum, moments * [1.0, 0.0, 5.0])
        close(spin[2], 5.0)
        rate = (own(float(t) + 1e-5)[0] - own(float(t) - 1e-5)[0]) / 2e-5
        close(moments * rate, np.cross(moments * spin, spin), 1e-9)  # d^2 w'''/6 < 1e-10 * 64/6, times I, and round-off
    assert rigid.torque_free_spin("brick").truths["nc"].kind == "invariant"
