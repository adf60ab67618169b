"""The fast runner: its broad phase finds exactly the pairs in reach, its steps are those of the stepped runner."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference.contestant import LARGE, Particles, Stepped
from impactbench.reference.particles import BOX, HALF_SPACE, SPHERE
from impactbench.reference.swarm import BLOCK, NEAR_SIDES, PAIRS, SIDES, SKIN, from_arrays
from impactbench.reference.swarm_run import Gas, advanced, prepared, tally
from impactbench.reference.swarm_statics import build_statics
from impactbench.scenarios.crowds import gas
from impactbench.scenarios.records import Body, Box, Contact, Sphere

STEP = 1 / 240
EPS = np.finfo(float).eps
dimensions = pytest.mark.parametrize("d", [1, 2, 3])


def no_statics(d):
    return build_statics(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3)), 1.0, d)


def listed(swarm, count, entries) -> list[tuple[int, int]]:
    """The list as labels, so that the order of the cells does not matter."""
    return [tuple(int(x) for x in row) for row in entries[: 2 * swarm.tally[count]].reshape(-1, 2)]


@dimensions
@given(seed=st.integers(0, 10_000), count=st.integers(2, 120), ratio=st.floats(0, 3), spread=st.floats(0.3, 30))
@settings(max_examples=60, deadline=None)
def test_the_lists_hold_exactly_the_pairs_within_the_skin(d, seed, count, ratio, spread):
    """Radii over up to 10^3, some bodies far out (past the grid's edge), against a look at every pair."""
    rng = np.random.default_rng(seed)
    place = np.zeros((count, d + 1))
    place[:, :d] = rng.normal(size=(count, d)) * spread
    place[rng.random(count) < 0.05, :d] *= 50
    place[:, d] = 10 ** rng.uniform(-ratio, 0, count)
    velocity = np.zeros((count, d + 1))
    velocity[:, :d] = rng.normal(size=(count, d)) * 10
    swarm = prepared(from_arrays(place, velocity, np.ones(count), no_statics(d), STEP, 1e-10, 1e-13))
    found = [tuple(sorted(swarm.now.label[list(pair)].tolist())) for pair in listed(swarm, PAIRS, swarm.lists.pairs)]
    off = np.sqrt(((place[:, None, :d] - place[None, :, :d]) ** 2).sum(axis=2))
    reach = place[:, None, d] + place[None, :, d] + swarm.gauge[SKIN]
    sure = np.argwhere(np.triu(off < reach * (1 - 8 * EPS), 1))
    possible = np.argwhere(np.triu(off < reach * (1 + 8 * EPS), 1))
    assert len(found) == len(set(found))
    assert {tuple(pair) for pair in sure.tolist()} <= set(found) <= {tuple(pair) for pair in possible.tolist()}


@dimensions
@given(seed=st.integers(0, 10_000), count=st.integers(1, 60), statics=st.integers(0, 60))
@settings(max_examples=40, deadline=None)
def test_the_lists_hold_exactly_the_bodies_near_statics(d, seed, count, statics):
    rng = np.random.default_rng(seed)
    place, velocity = np.zeros((count, d + 1)), np.zeros((count, d + 1))
    place[:, :d], place[:, d] = rng.uniform(-10, 10, (count, d)), rng.uniform(0.01, 0.5, count)
    velocity[:, :d] = rng.normal(size=(count, d))
    kind = rng.choice([SPHERE, BOX, HALF_SPACE], statics)
    at, size = np.zeros((statics, 3)), np.zeros((statics, 3))
    at[:, :d], size[:, :d] = rng.uniform(-12, 12, (statics, d)), 10 ** rng.uniform(-2, 0.5, (statics, d))
    size[kind == SPHERE] = size[kind == SPHERE, :1]
    normals = rng.normal(size=(statics, d))
    size[kind == HALF_SPACE, :d] = (normals / np.linalg.norm(normals, axis=1)[:, None])[kind == HALF_SPACE]
    fixed = build_statics(kind.astype(np.int64), at, size, float(place[:, d].max()), d)
    swarm = prepared(from_arrays(place, velocity, np.ones(count), fixed, STEP, 1e-10, 1e-13))
    found = {(int(swarm.now.label[i]), s) for i, s in listed(swarm, SIDES, swarm.lists.sides)}
    expected = set()
    for i in range(count):
        for s in range(statics):
            off = place[i, :d] - at[s, :d]
            if kind[s] == HALF_SPACE:
                gap = off @ size[s, :d]
            elif kind[s] == SPHERE:
                gap = np.linalg.norm(off) - size[s, 0]
            else:
                outside = np.maximum(np.abs(off) - size[s, :d], 0)
                gap = np.linalg.norm(outside) if outside.any() else (np.abs(off) - size[s, :d]).max()
            if gap - place[i, d] <= swarm.gauge[SKIN] / 2:
                expected.add((i, s))
    assert found == expected


def mixed(d, seed=3):
    """A gas of unlike masses and radii, with a static ball and a static box in the way."""
    world = gas(60, d, {1: 0.7, 2: 0.2, 3: 0.1}[d], seed)
    rng = np.random.default_rng(seed)
    bodies = [
        replace(body, shape=Sphere(float(rng.uniform(0.02, 0.5))), mass=float(10 ** rng.uniform(-2, 2)))
        if isinstance(body.shape, Sphere)
        else body
        for body in world.bodies
    ]
    bodies[10] = replace(bodies[10], mass=None, velocity=(0.0, 0.0, 0.0))
    bodies[20] = replace(bodies[20], mass=None, velocity=(0.0, 0.0, 0.0), shape=Box((0.3, 0.2, 0.4)))
    return replace(world, bodies=tuple(bodies))


@dimensions
@pytest.mark.parametrize("law", ["doc", "nc"])
def test_a_step_is_that_of_the_stepped_runner(d, law):
    world = mixed(d)
    slow, fast = Particles(world, law, "stepped", world.model, STEP), Gas(world, world.model, STEP)
    for _ in range(12):
        slow.advance(20)
        fast.advance(20)
        there, here = slow.read(), fast.read()
        # A billiard multiplies a difference with every impact; over 1 s and a few impacts a body, some 10^4 times eps.
        assert np.abs(there.positions - here.positions).max() <= 1e-10
        assert np.abs(there.velocities - here.velocities).max() <= 1e-10
    assert fast.figures()["impacts"] > 10


@dimensions
def test_energy_and_overlap_of_a_crowd(d):
    world = gas(400, d, {1: 0.3, 2: 0.4, 3: 0.2}[d], seed=5)
    run = Stepped(world, "doc", "stepped", world.model, STEP)
    before = (run.read().velocities ** 2).sum()
    run.advance(600)
    after = run.read()
    assert abs((after.velocities**2).sum() / before - 1) <= 1e-12
    figures = run.figures()
    assert figures["impacts"] > 100
    # Free flight between two looks: nobody gets deeper than one step of the fastest closing pair.
    assert 0 < figures["deepest before projection"] <= STEP * figures["largest closing speed"] * (1 + 1e-9)
    side = max(max(body.position) for body in world.bodies)
    assert after.positions[:, :d].min() >= 0.5 - 1e-9
    assert after.positions[:, :d].max() <= side - 0.5 + 1e-9
    off = np.sqrt(((after.positions[:, None] - after.positions[None]) ** 2).sum(axis=2)) + 10 * np.eye(400)
    # Projected pairs may push others, which wait for the next step: a small part of the overlap before.
    assert 1 - off.min() <= 0.1 * figures["deepest before projection"]
    assert figures["bytes"] / 400 <= 400


@dimensions
def test_bodies_pushed_into_others_push_those_on(d):
    """A row in which only the first two overlap, by .2 m, and the next gaps are .01 m: taken apart, the row is .2 m
    longer less the gaps, so that all touch, and the common centre stays.
    """
    places = np.array([0.0, 0.8, 1.81, 2.82, 3.83])
    place = np.zeros((len(places) + 1, d + 1))
    place[:-1, 0], place[-1, 0], place[:, d] = places, 100.0, 0.5
    velocity = np.zeros_like(place)
    velocity[-1, 0] = 9.0  # what the fastest body may do in two steps counts as near: here .075 m
    start = prepared(from_arrays(place, velocity, np.ones(len(place)), no_statics(d), STEP, 1e-10, 1e-13))
    now = advanced(start, 1).now
    row = np.sort(now.place.reshape(-1, d + 1)[now.label < 5, 0])
    assert np.diff(row).min() >= 1 - 1e-10
    assert row[-1] - row[0] == pytest.approx(4.0, abs=1e-9)
    assert row.mean() == pytest.approx(places.mean(), abs=1e-14)


def test_lists_grow_where_a_crowd_is_dense():
    """Far more pairs than there is room for at first; none may be lost, so energy and walls hold."""
    n = 300
    rng = np.random.default_rng(1)
    place = np.concatenate([rng.uniform(0, 1, (n, 2)), np.full((n, 1), 0.4)], axis=1)
    swarm = from_arrays(place, np.zeros((n, 3)), np.ones(n), no_statics(2), STEP, 1e-10, 1e-13)
    room = len(swarm.lists.pairs) // 2
    swarm = prepared(swarm)
    assert swarm.tally[PAIRS] > room
    assert len(listed(swarm, PAIRS, swarm.lists.pairs)) == swarm.tally[PAIRS]
    assert np.isfinite(advanced(swarm, 5).now.place).all()


@dimensions
def test_bodies_have_moved_before_their_pairs_are_looked_at(d):
    """Unlike sizes, so that pairs of several levels follow one another in the list."""
    n = 6000
    rng = np.random.default_rng(4)
    place = np.concatenate(
        [rng.uniform(0, {1: 60, 2: 5, 3: 1.5}[d], (n, d)), 10 ** rng.uniform(-2, -1, (n, 1))], axis=1
    )
    swarm = prepared(from_arrays(place, np.zeros((n, d + 1)), np.ones(n), no_statics(d), STEP, 1e-10, 1e-13))
    numbers = swarm.lists.pairs[: 2 * swarm.tally[PAIRS]]
    assert len(numbers) > 4 * BLOCK
    furthest = np.maximum.accumulate(numbers)[2 * BLOCK - 1 :: 2 * BLOCK]
    assert (swarm.lists.until[: len(furthest)] == furthest + 1).all()
    assert swarm.lists.until[(len(numbers) // 2 - 1) // BLOCK] == numbers.max() + 1


def test_large_scenes_take_the_fast_path_and_others_do_not():
    def order(world):
        return Stepped(world, "doc", "stepped", world.model, STEP).settings["order"]

    fast = "impacts, move, detect, project"
    assert order(gas(LARGE + 1, 2)) == fast
    assert order(gas(LARGE, 2)) != fast
    assert order(replace(gas(LARGE + 1, 2), contact=Contact(bounciness=0.9))) != fast
    assert order(replace(gas(LARGE + 1, 2), gravity=(0.0, -9.81, 0.0))) != fast
    aside = Body("aside", Sphere(0.5), 1.0, (5.0, 5.0, 3.0))
    crowd = gas(LARGE + 1, 2)
    assert order(replace(crowd, bodies=(*crowd.bodies, aside))) != fast  # passes above the others


def test_many_bad_bodies_are_refused_by_name_and_field():
    crowd = gas(LARGE + 1, 2)
    for change, message in (
        ({"mass": -1.0}, "'ball 7': mass -1.0"),
        ({"mass": math.nan}, "'ball 7': mass nan"),
        ({"position": (0.0, math.nan, 0.0)}, "'ball 7': position"),
        ({"shape": Sphere(-1.0)}, "'ball 7': radius -1.0"),
        ({"position": (-3.0, 1.0, 0.0)}, "'ball 7': position .* inside"),
    ):
        bodies = list(crowd.bodies)
        bodies[7] = replace(bodies[7], **change)
        with pytest.raises(ValueError, match=message):
            Stepped(replace(crowd, bodies=tuple(bodies)), "doc", "stepped", crowd.model, STEP)


def test_order_of_bodies_and_mirroring_change_no_more_than_round_off():
    """As long as no body touches two others at once (a dilute gas, half a second)."""
    world = gas(200, 3, 0.05, seed=2)
    run = Stepped(world, "doc", "stepped", world.model, STEP)
    run.advance(120)
    state = run.read()
    turned = Stepped(replace(world, bodies=world.bodies[::-1]), "doc", "stepped", world.model, STEP)
    turned.advance(120)
    assert np.abs(turned.read().positions[::-1] - state.positions).max() <= 1e-11

    def mirror(body):
        flipped = {"position": tuple(-x for x in body.position), "velocity": tuple(-v for v in body.velocity)}
        if not isinstance(body.shape, Sphere):
            flipped["shape"] = replace(body.shape, normal=tuple(-x for x in body.shape.normal))
        return replace(body, **flipped)

    mirrored = Stepped(replace(world, bodies=tuple(map(mirror, world.bodies))), "doc", "stepped", world.model, STEP)
    mirrored.advance(120)
    assert np.abs(mirrored.read().positions + state.positions).max() <= 1e-11
    assert run.figures()["impacts"] > 20


def test_nothing_moves_where_nothing_can():
    swarm = prepared(from_arrays(np.zeros((3, 3)), np.zeros((3, 3)), np.ones(3), no_statics(2), STEP, 1e-10, 1e-13))
    assert tally(advanced(swarm, 10))["impacts"] == 0
    assert swarm.tally[NEAR_SIDES] == 0
