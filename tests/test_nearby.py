"""Which pairs the particle runner looks at: none that may touch is missing, and a run on those near is the run on all
pairs, bit for bit.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference.cells import build_cells, gather
from impactbench.reference.coefficients import build_coefficients, refuse_reversal
from impactbench.reference.contestant import PROFILES, Particles
from impactbench.reference.gaps import locate_all
from impactbench.reference.interlocked import Centres, depth
from impactbench.reference.nearby import all_listed, all_pairs, build_nearby, list_anew
from impactbench.reference.pair_list import no_pairs
from impactbench.reference.particles import build_bodies
from impactbench.reference.progress import build_progress
from impactbench.scenarios.crowds import heap, wall
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere

STEP = 1 / 240
ALL, NEAR = 10**9, 0
"""So many pairs are few."""


def crowd(seed: int, count: int, ratio: float, axes=(0, 1, 2)) -> Scene:
    """Spheres and boxes of sizes over 10^ratio, among statics of all kinds; some pairs have their own contact."""
    rng = np.random.default_rng(seed)
    spread = 2 * count ** (1 / len(axes))
    bodies = [Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))]
    for i in range(count):
        size = float(10 ** rng.uniform(-ratio, 0)) / 2
        shape = Sphere(size) if rng.random() < 0.5 else Box(tuple((size * rng.uniform(0.3, 1, 3)).tolist()))
        place = np.zeros(3)
        place[list(axes)] = rng.uniform(-spread / 2, spread / 2, len(axes))
        place[2] += spread / 2 + 0.5
        speed = np.zeros(3)
        speed[list(axes)] = rng.normal(size=len(axes)) * 10 ** rng.uniform(-1, 1)
        mass = None if rng.random() < 0.2 else float(10 ** rng.uniform(-1, 1))
        bodies.append(
            Body(f"{i}", shape, mass, tuple(place.tolist()), (0.0, 0.0, 0.0) if mass is None else tuple(speed))
        )
    own = Contact(bounciness=0.9, friction=0.1, viscosity=0.2)
    pairs = tuple((str(a), str(b), own) for a, b in rng.integers(0, count, (count, 2)).tolist() if a != b)
    return Scene(
        name="crowd",
        bodies=tuple(outside(bodies)),
        duration=1.0,
        model=Model(axes, gravity=True, friction=True),
        length=1.0,
        speed=1.0,
        energy=1.0,
        gravity=(0.0, 0.0, -9.81),
        contact=Contact(bounciness=0.4, friction=0.3, viscosity=0.5),
        pairs=pairs,
    )


def outside(bodies: list[Body]) -> list[Body]:
    """Without the movable bodies whose centre may lie within a static one: those are refused."""

    def inside(body: Body, static: Body) -> bool:
        half = static.shape.half_extents if isinstance(static.shape, Box) else (static.shape.radius,) * 3
        away = np.abs(np.array(body.position) - static.position)
        return bool((away <= half).all())

    solids = [b for b in bodies if b.static and not isinstance(b.shape, HalfSpace)]
    return [b for b in bodies if b.static or not any(inside(b, s) for s in solids)]


def bits(world: Scene, law: str, profile: str, few: int, parts: int = 6) -> list[bytes]:
    """Positions and velocities every ten steps; how it ended where contacts did not settle."""
    run = Particles(world, law, profile, world.model, STEP, few)
    found = []
    for _ in range(parts):
        try:
            run.advance(10)
        except RuntimeError as why:
            return [*found, str(why).encode()]
        state = run.read()
        found.append(state.positions.tobytes() + state.velocities.tobytes())
    return found


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("law", ["doc", "nc"])
@given(st.integers(0, 10_000), st.integers(2, 60), st.floats(0, 2), st.sampled_from([(2,), (0, 2), (0, 1, 2)]))
@settings(max_examples=15, deadline=None)
def test_a_run_on_the_pairs_near_is_the_run_on_all_pairs(profile, law, seed, count, ratio, axes):
    world = crowd(seed, count, ratio, axes)
    assert bits(world, law, profile, NEAR) == bits(world, law, profile, ALL)


def test_a_wall_of_bricks_falls_the_same_on_the_pairs_near():
    world = wall(6, 6)
    assert bits(world, "doc", "stepped", NEAR, 24) == bits(world, "doc", "stepped", ALL, 24)


def test_of_a_crowd_only_pairs_that_are_near_are_listed():
    world = heap(1000)
    run = Particles(world, "nc", "stepped", world.model, STEP)
    run.advance(60)
    # Twelve touch a ball at most; half of them are listed with it, and a few more are near, and the walls.
    assert len(run._pairs.first) < 12 * 1000


@given(st.integers(0, 10_000), st.integers(1, 80), st.floats(0, 3), st.floats(0, 0.5))
@settings(max_examples=60, deadline=None)
def test_lists_hold_exactly_the_pairs_whose_gap_is_within_the_room_of_both(seed, count, ratio, reach):
    world = crowd(seed, count, ratio)
    bodies, coefficients = build_bodies(world), build_coefficients(world)
    nearby = build_nearby(world, bodies, coefficients, np.ones(3), STEP)
    progress = build_progress(len(world.bodies))
    assert not all_listed(bodies.position, nearby.rooms, progress, reach) or not world.movable
    assert progress.wanted[0] == reach or not world.movable
    near = list_anew(bodies, no_pairs(), nearby, reach)
    every = all_pairs(world, bodies, coefficients)
    locate_all(bodies, every)
    wanted = every.gap <= nearby.rooms.size[every.first] + nearby.rooms.size[every.second]
    for name in ("first", "second", "bounciness", "friction", "viscosity"):
        assert getattr(near, name).tolist() == getattr(every, name)[wanted].tolist()
    assert all_listed(bodies.position, nearby.rooms, progress, reach)
    assert (bodies.inverse_mass[near.second] > 0).all()


@given(st.integers(0, 10_000), st.integers(1, 200), st.floats(0, 3), st.floats(0, 3))
@settings(max_examples=60, deadline=None)
def test_cells_find_everybody_in_the_way_of_a_cube_once(seed, count, ratio, extent):
    rng = np.random.default_rng(seed)
    place, size = rng.normal(size=(count, 3)) * 5, 10 ** rng.uniform(-ratio, 0, count)
    place[rng.random(count) < 0.1] *= 1e9
    size[rng.random(count) < 0.1] = 0.0
    cells = build_cells(np.arange(count), place, size, np.ones(3))
    found = np.zeros(count, dtype=np.int64)
    for at in (np.zeros(3), place[0]):
        seen: list[int] = []
        for level in range(len(cells.exponent)):
            seen += found[: gather(cells, level, at, extent, found)].tolist()
        assert len(seen) == len(set(seen))
        assert set(np.flatnonzero((np.abs(place - at) <= extent + size[:, None]).all(axis=1))) <= set(seen)


def test_bodies_that_leave_leave_the_lists():
    world = heap(200)

    def run(few: int) -> tuple[Particles, list[bytes]]:
        engine = Particles(world, "nc", "stepped", world.model, STEP, few)
        engine.on_contact(lambda _time, one, other: [other] if one == "floor" else [])
        states = []
        for _ in range(120):
            engine.advance(1)
            states.append(engine.read().positions.tobytes())
        return engine, states

    near, found = run(NEAR)
    assert found == run(ALL)[1]
    assert 0 < len(near.read().positions) < 200


def test_own_contacts_of_pairs_count_by_name_the_first_of_several():
    world = crowd(1, 4, 0.0)
    first, other = (world.bodies[i].name for i in (0, world.movable[0]))
    twice = replace(world, pairs=((first, other, Contact(0.1, 0.2, 0.3)), (other, first, Contact(0.4, 0.5, 0.6))))
    pairs = all_pairs(twice, build_bodies(twice), build_coefficients(twice))
    own = (pairs.first == 0) & (pairs.second == world.movable[0])
    assert (pairs.bounciness[own], pairs.friction[own], pairs.viscosity[own]) == (0.1, 0.2, 0.3)
    assert set(pairs.bounciness[~own].tolist()) == {0.4}


def test_a_contact_that_is_not_over_stays_listed_with_its_memory():
    """A pair that touched a moment ago, though it is far apart by now; the one that only was near is forgotten."""
    world = crowd(1, 30, 0.0)
    bodies, coefficients = build_bodies(world), build_coefficients(world)
    nearby = build_nearby(world, bodies, coefficients, np.ones(3), STEP)
    old = list_anew(bodies, no_pairs(), nearby, 0.5)
    p, q = np.flatnonzero(bodies.inverse_mass[old.first] > 0)[:2]
    for name, value in (("reach", 0.25), ("push", 2.0), ("slow", 3.0), ("parted", 4.0), ("clear", 5.0)):
        getattr(old, name)[p] = value
    old.touching[p] = old.touched[p] = True
    old.normal[p] = (0.0, 0.6, 0.8)
    for number, i in enumerate(world.movable):
        bodies.position[i] = (0.0, 0.0, 1000.0 * (number + 2))
    new = list_anew(bodies, old, nearby, 0.0)
    assert (new.first.tolist(), new.second.tolist()) == ([old.first[p]], [old.second[p]])
    for name in ("bounciness", "touching", "touched", "reach", "push", "slow", "parted", "clear", "normal"):
        assert getattr(new, name)[0].tolist() == getattr(old, name)[p].tolist()
    assert (old.first[q], old.second[q]) != (old.first[p], old.second[p])


@given(st.integers(0, 10_000), st.integers(2, 12), st.floats(0.001, 0.2))
@settings(max_examples=60, deadline=None)
def test_a_force_is_refused_where_any_of_all_pairs_would_be_reversed(seed, count, step):
    world = crowd(seed, count, 0.0)
    bodies, coefficients = build_bodies(world), build_coefficients(world, step)
    every = all_pairs(world, bodies, build_coefficients(world))
    rate = every.viscosity * (bodies.inverse_mass[every.first] + bodies.inverse_mass[every.second])
    refused = rate.max(initial=0.0) * step > 1
    with pytest.raises(ValueError, match="would reverse the sliding") if refused else nullcontext():
        refuse_reversal(world, coefficients, bodies.inverse_mass)


@given(st.integers(0, 10_000), st.integers(1, 60), st.floats(0, 3))
@settings(max_examples=60, deadline=None)
def test_no_body_inside_a_static_is_missed(seed, count, ratio):
    rng = np.random.default_rng(seed)
    solids = [body for body in crowd(seed, count, ratio).bodies if not isinstance(body.shape, HalfSpace)]
    solids += [replace(body, shape=Capsule(0.2, 0.5), orientation=(0.6, 0.0, 0.8, 0.0)) for body in solids[:5]]
    places = [np.array(body.position) + rng.normal(size=3) * 0.3 for body in solids for _ in range(3)]
    points = [Body(f"{i}", Sphere(0.0), 1.0, tuple(place.tolist())) for i, place in enumerate(places)]
    near = Centres(points)
    for solid in solids:
        inside = [point for point in points if depth(solid, point.position) > 0]
        found = near.within(solid)
        assert [point for point in found if depth(solid, point.position) > 0] == inside
