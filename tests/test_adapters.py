"""Engines realise what their adapters claim. Scenes are built here; expected numbers are derived beside the checks."""

from __future__ import annotations

import importlib
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.adapters.frames import matrix
from impactbench.adapters.surfaces import can_meet, solve_products, surface_factors
from impactbench.scenarios.engine import Unavailable, Unsupported
from impactbench.scenarios.records import FULL, Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere

EPS = np.finfo(float).eps
DOWN = (0.0, 0.0, -9.81)
G = 9.81
STEPS = (1 / 60, 1 / 240, 1 / 1000, 1 / 10000)
ENGINES = {"Bullet": "pybullet_adapter", "MuJoCo": "mujoco_adapter", "Pymunk": "pymunk_adapter"}
every_engine = pytest.mark.parametrize("name", ENGINES)


def engine(name):
    try:
        return getattr(importlib.import_module(f"impactbench.adapters.{ENGINES[name]}"), name)
    except Unavailable as reason:
        pytest.skip(str(reason))


ELASTIC = Contact(1.0)


def scene(bodies, axes, *, contact=ELASTIC, gravity=(0.0, 0.0, 0.0), rotation=False, **more):
    model = Model(axes, rotation, gravity=any(gravity), friction=contact.friction > 0)
    fields = {"duration": 4.0, "length": 1.0, "speed": 1.0, "energy": 1.0} | more
    return Scene("test", tuple(bodies), model=model, gravity=gravity, contact=contact, **fields)


def ball(x, v=(0.0, 0.0, 0.0), name="a", **more):
    return Body(name, Sphere(0.5), 1.0, x, v, **more)


def plane(normal=(0.0, 0.0, 1.0), position=(0.0, 0.0, 0.0), name="plane"):
    return Body(name, HalfSpace(normal), None, position)


def run(name, case, step, steps, *, law="nc", profile="tuned", model=None):
    world = engine(name)(case, law, profile, model or case.model, step)
    world.advance(steps)
    state = world.read()
    world.close()
    return state


def head_on(e):
    return scene([ball((-0.6, 0, 0), (1, 0, 0)), ball((0.6, 0, 0), (-1, 0, 0), "b")], (0,), contact=Contact(e))


def at_wall(e, speed=1.0):
    return scene([plane((1, 0, 0)), ball((0.6, 0, 0), (-speed, 0, 0))], (0,), contact=Contact(e))


@every_engine
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("e", [0, 0.25, 0.5, 0.8, 0.9, 1])
def test_tuned_restitution_is_exact(name, step, e):
    """One-step impulses: only MuJoCo's tiny stiffness (1e-12) and solver tolerance (1e-15) keep e from being exact.

    MuJoCo's Newton solver leaves some 1e-12 of momentum at small steps; the others conserve it to round-off.
    """
    steps = round(0.2 / step)
    v = run(name, head_on(e), step, steps).velocities
    assert (v[1, 0] - v[0, 0]) / 2 == pytest.approx(e, abs=1e-6)
    assert abs(v.sum(axis=0)).max() <= 1e-11
    assert run(name, at_wall(e), step, steps).velocities[0, 0] == pytest.approx(e, abs=1e-6)


@every_engine
@pytest.mark.parametrize("full", [False, True])
def test_free_flight_is_the_discrete_parabola(name, full):
    """v-first engines fall g n(n+1)/2 h^2 in n steps, pymunk (x first) g n(n-1)/2 h^2.

    Each step rounds x and v once or twice at most at their largest size.
    """
    n, h, v0, z0 = 240, 1 / 240, (2.0, 0.0, 3.0), 1.0
    case = scene([ball((0.0, 0.0, z0), v0)], (0, 2), gravity=DOWN)
    state = run(name, case, h, n, model=FULL if full else None)
    terms = n * (n - 1) / 2 if name == "Pymunk" else n * (n + 1) / 2
    expected = (v0[0] * n * h, 0.0, z0 + v0[2] * n * h - G * h * h * terms)
    time = n * h
    bound = 2 * n * EPS * (math.hypot(*v0) * time + G * time**2 + z0)
    assert state.positions[0] == pytest.approx(expected, abs=bound)
    assert state.velocities[0] == pytest.approx((v0[0], 0.0, v0[2] - G * time), abs=bound)


def test_default_profiles_are_the_vendors():
    """Bullet's predictive contacts stop a ball at a static; MuJoCo's critically damped contact has e = exp(-2)."""
    assert abs(run("Bullet", at_wall(1.0), 1 / 1000, 300, profile="default").velocities[0, 0]) < 0.02
    rebound = run("MuJoCo", at_wall(1.0), 1 / 10000, 4000, profile="default").velocities[0, 0]
    # Sampling of a contact that lasts some 200 steps: a few steps' worth of its e-folding time.
    assert rebound == pytest.approx(math.exp(-2), abs=0.01)
    assert run("Pymunk", at_wall(1.0), 1 / 240, 60, profile="default").velocities[0, 0] == 1.0


def slide(heading, mu=0.3, v0=5.0):
    u = (math.cos(heading), math.sin(heading), 0.0)
    block = Body("block", Box((0.5, 0.5, 0.25)), 1.0, (0.0, 0.0, 0.25), tuple(v0 * x for x in u))
    axes = (0,) if heading == 0 else (0, 1)
    return scene([plane(), block], axes, contact=Contact(0, mu), gravity=DOWN, speed=v0, phase_free=False), np.array(u)


@pytest.mark.parametrize(
    ("name", "degrees"),
    [("Bullet", 0), ("Bullet", 22.5), ("Bullet", 45), ("MuJoCo", 0), ("MuJoCo", 22.5), ("MuJoCo", 45), ("Pymunk", 0)],
)
@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 1000])
def test_coulomb_slide_stops_where_it_should(name, degrees, step):
    """Distance v0^2/(2 mu g); the first order term of one-step updates is mu g h/v0 of it, minus v first, plus x first.

    Bullet and pymunk are their recurrence: the bound leaves second order only, (mu g h/v0)^2 and the partial last step.
    MuJoCo's grip adds a term of the same first order and the other sign: between the two.
    """
    mu, v0 = 0.3, 5.0
    case, u = slide(math.radians(degrees), mu, v0)
    state = run(name, case, step, round(2.5 / step))
    order = mu * G * step / v0
    excess = state.positions[0] @ u / (v0**2 / (2 * mu * G)) - 1
    sign = {"Bullet": -1, "Pymunk": 1}.get(name)
    assert abs(excess - sign * order) <= order**2 if sign else abs(excess) <= order
    sideways = np.array([-u[1], u[0], 0.0])
    assert abs(state.positions[0] @ sideways) <= 1e-12


@every_engine
@pytest.mark.parametrize("full", [False, True])
def test_viscous_slide_is_native_damping(name, full):
    """v = v0 exp(-c t/m): exact per step in Bullet and pymunk (round-off of n products), fourth order in MuJoCo (RK4).

    RK4's local error (c h/m)^5/120 times n steps is 1e-11 here. Positions are first order in the other two: v0 h c/m.
    """
    c, m, v0, h, n = 2.0, 1.5, 3.0, 1 / 240, 240
    block = Body("block", Box((0.5, 0.5, 0.25)), m, (0.0, 0.0, 0.25), (v0, 0.0, 0.0))
    contact = Contact(0, viscosity=c)
    case = scene([plane(), block], (0,), contact=contact, gravity=DOWN, phase_free=False, laws=("doc",))
    state = run(name, case, h, n, law="doc", model=FULL if full else None)
    decay = math.exp(-c / m)
    assert state.velocities[0, 0] == pytest.approx(v0 * decay, rel=2e-11 if name == "MuJoCo" else 4 * n * EPS)
    # Neither falls nor leaves the plane: Bullet sinks by its first fall, g h^2 and little more.
    assert state.positions[0, 2] == pytest.approx(0.25, abs=1e-3)
    assert state.positions[0, 0] == pytest.approx(m * v0 / c * (1 - decay), abs=1e-10 if name == "MuJoCo" else v0 * h)


@every_engine
@pytest.mark.parametrize("axes", [(0, 2), (1, 2)])
@pytest.mark.parametrize("full", [False, True])
def test_rolling_onset_has_the_balls_inertia_and_sign(name, axes, full):
    """v = 5/7 v0 (a disc would give 2/3), spin v/R about n x v: +y for motion along x, -x along y. MuJoCo creeps: 1e-5.

    While it slides, the ball turns by alpha t^2/2 with alpha = 5/2 mu g/R; a step's first order in that is alpha t h/2.
    """
    v0, along = 3.0, axes[0]
    velocity = tuple(v0 if k == along else 0.0 for k in range(3))
    case = scene(
        [plane(), ball((0.0, 0.0, 0.5), velocity)],
        axes,
        contact=Contact(0, 0.2),
        gravity=DOWN,
        rotation=True,
        speed=v0,
        phase_free=False,
    )
    state = run(name, case, 1 / 240, 360, model=FULL if full else None)
    v = 5 / 7 * v0
    spin = (0.0, v / 0.5, 0.0) if along == 0 else (-v / 0.5, 0.0, 0.0)
    tolerance = 1e-4 if name == "MuJoCo" else 1e-12
    assert state.velocities[0, along] == pytest.approx(v, rel=tolerance)
    assert state.spins[0] == pytest.approx(spin, abs=tolerance * v / 0.5)
    time, alpha = 0.25, 2.5 * 0.2 * G / 0.5
    turn = run(name, case, 1 / 240, 60, model=FULL if full else None).orientations[0]
    angles = 2 * turn[1:] / np.linalg.norm(turn[1:]) * math.atan2(np.linalg.norm(turn[1:]), turn[0])
    expected = np.array(spin) / np.linalg.norm(spin) * alpha * time**2 / 2
    assert angles == pytest.approx(expected, abs=alpha * time / 240)


@every_engine
@pytest.mark.parametrize("mu", [0.1, 1.0])
def test_oblique_impact_with_friction(name, mu):
    """Both slide-through and stick give v_x = 5/7, w = 10/7 here: mu (1+e) v_n = 0.1 * 1.5 * 2 = 0.3 exceeds 2/7.

    MuJoCo's impedance 0.9999 leaves 1e-4 of the response out.
    """
    case = scene([plane(), ball((0, 0, 0.8), (1, 0, -2))], (0, 2), contact=Contact(0.5, mu), rotation=True)
    state = run(name, case, 1 / 1000, 400)
    assert state.velocities[0] == pytest.approx((5 / 7, 0, 1), abs=2e-4)
    assert state.spins[0] == pytest.approx((0, 10 / 7, 0), abs=2e-4)


@every_engine
def test_tilted_capsule_turns_the_right_way(name):
    """A tilted rod on a frictionless plane, end s to the side of the centre: J = (1+e) v/(1/m + s^2/I), w = J s/I.

    The engines see the impact up to a step late and with e from one step; geometry enters through s alone.
    """
    half, radius, tilt = 0.5, 0.2, 0.6
    turn = (math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0)
    rod = Body("rod", Capsule(radius, half), 1.0, (0, 0, 1.0), (0, 0, -1.0), turn)
    case = scene([plane(), rod], (0, 2), contact=Contact(1.0), rotation=True)
    state = run(name, case, 1 / 1000, 450)
    side, inertia = half * math.sin(tilt), rod.principal_inertia()[1]
    impulse = 2 / (1 + side**2 / inertia)
    assert state.velocities[0, 2] == pytest.approx(impulse - 1, abs=1e-3)
    # The lower end is at -x: an upward push there turns z towards... x, about +y.
    assert state.spins[0] == pytest.approx((0, impulse * side / inertia, 0), abs=1e-2)
    assert state.orientations[0] != pytest.approx(turn)


@pytest.mark.parametrize("name", ["Bullet", "MuJoCo"])
@pytest.mark.parametrize("turn", [(1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5)])
def test_spins_and_turns_are_read_in_world_axes(name, turn):
    """A free box keeps L = R I R^T w in world axes; a spin in body axes, or a turn in another order, would not.

    First order integrators drift by some w^2 T h of it, here 4e-3.
    """
    spin = (0.6, -0.4, 0.7)
    box = Body("box", Box((0.1, 0.3, 0.5)), 1.0, (0, 0, 0), spin=spin, orientation=turn)
    state = run(name, scene([box], (0, 1, 2), rotation=True), 1 / 240, 240)

    def momentum(q, w):
        axes = matrix(tuple(q))
        return axes @ (np.array(box.principal_inertia()) * (axes.T @ w))

    start = momentum(turn, np.array(spin))
    assert np.linalg.norm(state.spins[0] - spin) > 0.05  # it does tumble
    assert momentum(state.orientations[0], state.spins[0]) == pytest.approx(start, abs=5e-3 * np.linalg.norm(start))


@pytest.mark.parametrize("name", ["Bullet", "MuJoCo"])
@pytest.mark.parametrize("normal", [(0.6, 0.0, 0.8), (0.0, -0.6, 0.8), (-1.0, 0.0, 0.0), (0.48, 0.6, 0.64)])
def test_half_space_of_any_normal_reflects(name, normal):
    n = np.array(normal)
    case = scene([plane(normal, (1, 2, 3)), ball(tuple(n * 0.7 + [1, 2, 3]), tuple(-n))], (0, 1, 2))
    assert run(name, case, 1 / 240, 120).velocities[0] == pytest.approx(n, abs=1e-9)


@every_engine
def test_pairs_have_their_own_coefficients(name):
    """Wall left e = .5, wall right e = .8: a ball between them comes back with .4 of its speed after both."""
    walls = [plane((1, 0, 0), (-1, 0, 0), "left"), plane((-1, 0, 0), (1, 0, 0), "right")]
    pairs = (("left", "a", Contact(0.5)), ("right", "a", Contact(0.8)))
    case = scene([*walls, ball((0, 0, 0), (-1, 0, 0))], (0,), pairs=pairs)
    # left at .5 s, right 1/.5 = 2 s later, so at 3 s both are behind
    assert run(name, case, 1 / 240, 720).velocities[0, 0] == pytest.approx(-0.4, abs=1e-9)


@every_engine
def test_nothing_meets_where_scenes_do_not_collide(name):
    case = scene([ball((-0.6, 0, 0), (1, 0, 0)), ball((0.6, 0, 0), (-1, 0, 0), "b")], (0,), collide=False)
    assert run(name, case, 1 / 240, 240).velocities[:, 0] == pytest.approx([1, -1], abs=1e-12)


@every_engine
def test_pile_of_boxes_rests(name):
    """Still, and at its height to the recipes' stiffness; pymunk leaves its slop of 1e-4 in every contact."""
    boxes = [Body(f"b{i}", Box((0.5, 0.5, 0.5)), 1.0, (0, 0, 0.505 + 1.005 * i)) for i in range(5)]
    state = run(name, scene([plane(), *boxes], (2,), contact=Contact(0), gravity=DOWN), 1 / 240, 480)
    assert state.positions[:, 2] == pytest.approx(0.5 + np.arange(5), abs=1e-3)
    assert abs(state.velocities).max() <= 1e-6


def test_unsupported_scenes_say_why():
    with pytest.raises(Unsupported, match="documents' impact law"):
        run("MuJoCo", head_on(1), 1 / 240, 1, law="doc")
    viscous = Contact(0, viscosity=1.0)
    case = scene([plane(), ball((0, 0, 0.5), (1, 0, 0))], (0,), contact=viscous, gravity=DOWN, phase_free=False)
    for name in ENGINES:
        with pytest.raises(Unsupported, match="Coulomb friction only"):
            run(name, case, 1 / 240, 1, law="doc", profile="default")
    two = scene([ball((0, 0, 0)), ball((1, 0, 0), name="b")], (0,), contact=viscous, phase_free=False)
    for name in ENGINES:
        with pytest.raises(Unsupported, match="two movable"):
            run(name, two, 1 / 240, 1, law="doc")
    with pytest.raises(Unsupported, match="three axes"):
        run("Pymunk", scene([ball((0, 0, 0))], (0, 1, 2)), 1 / 240, 1)


def test_mujocos_silent_reset_shows():
    """By default a bad number puts the world back to its start; the state must not look like one."""
    world = engine("MuJoCo")(at_wall(1.0, speed=1e11), "nc", "default", at_wall(1.0).model, 1 / 240)
    world.advance(3)
    assert np.isnan(world.read().velocities).all()


@every_engine
@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_fresh_worlds_repeat_to_the_bit(name, profile):
    balls = [ball((1.1 * i, 0, 0.6 + 0.1 * (i % 3)), (1.0 - i, 0, 0), f"b{i}") for i in range(6)]
    case = scene([plane(), *balls], (0, 2), contact=Contact(0.5, 0.3), gravity=DOWN, rotation=True)
    one, two = (run(name, case, 1 / 240, 240, profile=profile) for _ in range(2))
    for field in ("positions", "velocities", "orientations", "spins"):
        assert getattr(one, field).tobytes() == getattr(two, field).tobytes()


factors = st.lists(st.one_of(st.just(0.0), st.floats(0.01, 1)), min_size=2, max_size=7)


@settings(max_examples=200, deadline=None)
@given(factors, st.data())
def test_surfaces_are_found_where_they_exist(s, data):
    """Any products of factors in [0, 1] can be split again; the factors found may differ, their products may not."""
    pairs = [p for p in itertools.combinations(range(len(s)), 2) if data.draw(st.booleans())]
    products = {(a, b): s[a] * s[b] for a, b in pairs}
    found = solve_products(products, 1.0)
    assert found is not None
    assert all(0 <= x <= 1 for x in found.values())
    assert all(found[a] * found[b] == pytest.approx(v, rel=1e-12) for (a, b), v in products.items())


def test_surfaces_that_cannot_exist_are_refused():
    cycle = {(0, 1): 1.0, (1, 2): 1.0, (2, 3): 1.0, (0, 3): 0.5}  # even cycle: s0 s1 s2 s3 is 1 and 0.5
    assert solve_products(cycle, 1.0) is None
    assert solve_products({(0, 1): 1.0, (1, 2): 1.0, (0, 2): 0.25}, 1.0) is None  # s0 = s1 = s2 = 1, not 0.25
    assert solve_products({(0, 1): 0.5, (1, 2): 0.5, (0, 2): 0.0}) is None  # all three must be positive
    assert solve_products({(0, 1): 0.25}) == {0: 0.5, 1: 0.5}
    case = scene([ball((0, 0, 0)), ball((2, 0, 0), name="b"), ball((4, 0, 0), name="c")], (0,))
    odd = scene(case.bodies, (0,), pairs=(("a", "c", Contact(0.1)),))
    with pytest.raises(Unsupported, match="per-surface"):
        surface_factors(odd, can_meet(odd, (0,)), lambda c: c.bounciness, 1.0)
