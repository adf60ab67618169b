"""The exact runner against closed forms: truths of the catalogue, collision counts, conservation, reversal, rest."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from impactbench.reference import events_cells, exact_contestant
from impactbench.reference.events_roots import curve, meet
from impactbench.reference.exact_contestant import Exact
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.engine import Engine, Unsupported
from impactbench.scenarios.hard import case_named
from impactbench.scenarios.records import FULL, Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere

G = 9.81
EPS = float(np.finfo(float).eps)
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
FAMILIES = (
    *("free_flight", "equal_masses", "unequal_masses", "oblique_pair", "static_wall", "oblique_wall", "box_of_walls"),
    *("bouncing_ball", "galilean_cannon", "newtons_cradle", "mass_chain"),
)

laws = pytest.mark.parametrize("law", ["doc", "nc"])


def scene(bodies, axes=(0, 1, 2), gravity=0.0, **contact) -> Scene:
    return Scene(
        name="test[case=1]",
        bodies=tuple(bodies),
        duration=1.0,
        model=Model(axes, gravity=gravity > 0),
        length=1.0,
        speed=1.0,
        energy=1.0,
        gravity=(0.0, 0.0, -gravity),
        contact=Contact(**contact),
    )


def engine(world: Scene, law="doc", step=1.0, model=None) -> Exact:
    return Exact(world, law, "exact", model or world.model, step)


def ball(name, position, velocity=(0.0, 0.0, 0.0), mass=1.0, radius=0.1) -> Body:
    return Body(name, Sphere(radius), mass, tuple(map(float, position)), tuple(map(float, velocity)))


def room(size, boxes=False) -> list[Body]:
    """Six walls around 0..size [m], as half-spaces or as boxes that overlap one another."""
    walls = []
    for axis, sign in itertools.product(range(3), (1.0, -1.0)):
        normal = tuple(sign if k == axis else 0.0 for k in range(3))
        face = [0.0 if sign > 0 else size] * 3
        if boxes:
            place = tuple(face[k] - sign if k == axis else size / 2 for k in range(3))
            half = tuple(1.0 if k == axis else size for k in range(3))
            walls.append(Body(f"wall {axis} {sign}", Box(half), None, place))
        else:
            place = tuple(face[k] if k == axis else 0.0 for k in range(3))
            walls.append(Body(f"wall {axis} {sign}", HalfSpace(normal), None, place))
    return walls


def gas(count, gravity=0.0, **contact) -> Scene:
    """Balls of diameter 1 m on a cubic lattice that fills a fifth of a room, at random velocities near 1 m/s."""
    side = math.ceil(count ** (1 / 3))
    pitch = (math.pi / 6 / 0.2) ** (1 / 3)
    places = pitch * (np.array(list(itertools.product(range(side), repeat=3)))[:count] + 0.5)
    velocities = np.random.default_rng(1).normal(size=(count, 3))
    balls = [ball(f"{i}", places[i], velocities[i], radius=0.5) for i in range(count)]
    return scene([*room(side * pitch), *balls], gravity=gravity, **contact)


def least_gap(world: Scene, positions: np.ndarray) -> float:
    """Least gap [m] among balls of one radius and to the walls of `gas`."""
    radius = world.bodies[-1].shape.radius
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2) + 9 * np.eye(len(positions))
    size = max(max(wall.position) for wall in world.bodies[:6])
    return min(apart.min() - 2 * radius, positions.min() - radius, size - radius - positions.max())


@pytest.mark.parametrize("case", select(FAMILIES), ids=lambda case: case.scene.name)
@laws
def test_the_truths_of_the_catalogue(case, law):
    world, truth = case.scene, case.truths[law]
    run = engine(world, law, world.duration / 97)
    for sample in range(98):
        now, expected = run.read(), truth.state(sample * world.duration / 97)
        if expected is not None:
            # Fewer than 50 impacts of some 50 operations each, on numbers below 2 length and 2 speed: 5000 EPS = 1e-12.
            assert np.abs(now.positions - expected.positions).max() <= 5000 * EPS * world.length
            assert np.abs(now.velocities - expected.velocities).max() <= 5000 * EPS * world.speed
        run.advance(1)


@laws
def test_a_touching_cradle_keeps_momentum_and_energy(law):
    (case,) = select(["newtons_cradle[count=5,gap=0]"])
    run = engine(case.scene, law)
    run.advance(1)
    assert run.read().velocities[:, 0].tolist() == pytest.approx([0, 0, 0, 0, 3], abs=1e-14)


@pytest.mark.parametrize(("power", "count"), [(0, 3), (1, 31), (2, 314), (3, 3141)])
def test_a_billiard_counts_the_digits_of_pi(power, count):
    """Balls of masses 1 and 100^k before a wall collide as often as the first k + 1 digits of pi say (Galperin)."""
    wall = Body("wall", HalfSpace((1.0, 0.0, 0.0)), None, (0.0, 0.0, 0.0))
    balls = [ball("light", (1, 0, 0)), ball("heavy", (2, 0, 0), (-1, 0, 0), mass=100.0**power)]
    run = engine(scene([wall, *balls], (0,)), step=100.0)
    run.advance(1)
    assert sum(run.impacts) == count


@pytest.mark.parametrize("count", [100_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_a_hundred_elastic_spheres_keep_their_energy(count):
    world = gas(100)
    run = engine(world)
    start, least = (run.read().velocities ** 2).sum(), 0.0
    while run.impacts[0] < count:
        run.advance(100)
        least = min(least, least_gap(world, run.read().positions))
    # Each impact errs by some EPS of the whole at most, at random: EPS sqrt(10^6) = 2e-13.
    assert abs((run.read().velocities ** 2).sum() / start - 1) <= 1e-12
    assert least >= -50 * EPS * 6  # coordinates up to 6 m


@laws
@pytest.mark.parametrize(("gravity", "b"), [(0.0, 0.9), (2.0, 1.0), (2.0, 0.9)])
def test_nothing_ever_overlaps(law, gravity, b):
    world = gas(60, gravity, bounciness=b)
    run, least = engine(world, law, step=0.01), 0.0
    for _ in range(200):
        run.advance(1)
        least = min(least, least_gap(world, run.read().positions))
    assert run.impacts[0] > 100
    assert least >= -50 * EPS * 6


def test_a_hundred_thousand_bounces_run_backwards():
    """A non-chaotic path: round-off adds up and is not amplified."""
    walls, inner, time = room(1.0), 0.2, 10_000.0
    start, velocity = np.array([0.41, 0.52, 0.47]), np.array([1.0, 0.7, 0.4])
    there = engine(scene([*walls, ball("ball", start, velocity, radius=0.4)]), step=time)
    there.advance(1)
    assert there.impacts[1] > 100_000
    turn = there.read()
    folded = np.mod(start - 0.4 + velocity * time, 2 * inner)
    expected = np.minimum(folded, 2 * inner - folded) + 0.4
    # Coordinates below 1 m err by an EPS a bounce at worst, which makes 2e-11 m.
    bound = there.impacts[1] * EPS
    assert np.abs(turn.positions[0] - expected).max() <= bound
    back = engine(scene([*walls, ball("ball", turn.positions[0], -turn.velocities[0], radius=0.4)]), step=time)
    back.advance(1)
    assert np.abs(back.read().positions[0] - start).max() <= 2 * bound
    # Velocities only change their signs.
    assert np.array_equal(back.read().velocities[0], -velocity)


def test_a_billiard_of_five_spheres_run_backwards_errs_as_its_copies_part():
    """A chaotic path: what round-off does to it is some EPS times the growth of a small difference, at every time."""
    places = np.array([[0.2, 0.3, 0.25], [0.7, 0.25, 0.6], [0.3, 0.75, 0.7], [0.75, 0.7, 0.3], [0.5, 0.5, 0.5]])
    speeds = np.random.default_rng(3).normal(size=(5, 3))

    def after(time, where, velocity):
        balls = [ball(f"{i}", *motion) for i, motion in enumerate(zip(where, velocity, strict=True))]
        run = engine(scene([*room(1.0), *balls]), step=time)
        run.advance(1)
        return run.read()

    small, growths, errors = 1e-10, [], []
    for time in (0.5, 1.0, 1.5, 2.0, 2.5):
        turn = after(time, places, speeds)
        back = after(time, turn.positions, -turn.velocities).positions
        copy = after(time, turn.positions + small * np.array([1.0, -1.0, 1.0]), -turn.velocities).positions
        growths.append(np.abs(copy - back).max() / small)
        errors.append(np.abs(back - places).max())
    assert growths[-1] > 1e6 * growths[0]
    # Some 20 impacts a second err by an EPS or two each, early ones in directions that grow less than the copy's: over
    # seven powers of ten the error stays within three of EPS times the growth.
    for growth, error in zip(growths, errors, strict=True):
        assert 1e-3 * EPS * growth <= error <= 1e3 * EPS * growth


@laws
def test_cells_change_nothing(law, monkeypatch):
    world = gas(64, 1.0, bounciness=0.95)
    cut = engine(world, law, 0.1)
    monkeypatch.setattr(events_cells, "FEW", 1000)
    whole = engine(world, law, 0.1)
    assert cut.settings["cells"] == (5, 5, 5)
    assert whole.settings["cells"] == (1, 1, 1)
    for run in (cut, whole):
        run.advance(5)
    assert cut.impacts == whole.impacts
    assert cut.impacts[0] > 50
    # Round-off grows by some 2 (free path/radius) per impact of a ball; each has had about four.
    assert np.abs(cut.read().positions - whole.read().positions).max() <= 1e-10


def test_faces_of_boxes_are_walls():
    balls = [ball("a", (0.3, 0.4, 0.5), (1.3, -0.7, 0.9)), ball("b", (0.7, 0.5, 0.6), (-0.4, 0.8, 0.3))]
    flat, solid = (engine(scene([*room(1.0, boxes), *balls], gravity=1.0), step=3.0) for boxes in (False, True))
    for run in (flat, solid):
        run.advance(1)
    assert flat.impacts == solid.impacts
    assert flat.impacts[1] > 10
    assert np.abs(flat.read().positions - solid.read().positions).max() <= 1e-11


def test_a_ball_passes_beside_a_box_and_lands_on_it_from_above():
    table = Body("table", Box((1.0, 1.0, 0.5)), None, (0.0, 0.0, 0.5))
    beside = engine(scene([table, ball("ball", (1.2, 0, 3))], gravity=G))
    beside.advance(2)
    assert beside.impacts == (0, 0)
    thrown = engine(scene([table, ball("ball", (-2, 0, 0.5), (2, 0, 5))], gravity=G, bounciness=1.0), step=0.01)
    # z = 1.1 on the way down, at x between -1 and 1.
    time = (5 + math.sqrt(25 - 2 * G * 0.6)) / G
    thrown.advance(math.ceil(time / 0.01))
    assert thrown.impacts == (0, 1)
    assert thrown.read().velocities[0, 2] > 0


def test_a_box_edge_is_declared():
    table = Body("table", Box((1.0, 1.0, 0.5)), None, (0.0, 0.0, 0.5))
    for drop in (ball("ball", (1.05, 0, 3)), ball("ball", (0.9, 0, 1.1), (1, 0, 0))):
        with pytest.raises(Unsupported, match=r"test\[case=1\]: t = .* s: a sphere comes to a box's edge"):
            engine(scene([table, drop], gravity=G, bounciness=0.5))


@laws
def test_a_ball_comes_to_rest_on_an_incline_and_slides_without_friction(law):
    """Across the plane a Zeno series of bounces, along it a = g sin th; `doc` damps the sliding at every bounce too."""
    tilt = math.radians(30)
    world = replace(
        scene([FLOOR, ball("ball", (0, 0, 1.1))], (0, 2), bounciness=0.5),
        gravity=(G * math.sin(tilt), 0.0, -G * math.cos(tilt)),
    )
    run, across = engine(world, law, 2.0), G * math.cos(tilt)
    first = math.sqrt(2 / across)
    assert first * (1 + 0.5) / (1 - 0.5) < 2.0  # all bounces are over
    run.advance(1)
    one = run.read()
    run.advance(1)
    two = run.read()
    assert abs(one.positions[0, 2] - 0.1) <= 1e-15
    assert one.velocities[0, 2] == 0
    assert two.velocities[0, 0] - one.velocities[0, 0] == pytest.approx(2 * G * math.sin(tilt), rel=1e-14)
    if law == "nc":
        assert one.velocities[0, 0] == pytest.approx(2 * G * math.sin(tilt), rel=1e-13)
    else:
        # Flights of t_1, 2 b t_1 (b^n t_1 ...): after bounce n the speed along is b (speed + g sin th * flight).
        speed, flight, time = 0.0, first, 0.0
        for bounce in range(1, 60):
            time += flight
            speed, flight = 0.5 * (speed + G * math.sin(tilt) * flight), 2 * first * 0.5**bounce
        # The series is cut where bounces leave at 1e-10 m/s: later than that nothing slower than 1e-9 m/s is lost.
        assert one.velocities[0, 0] == pytest.approx(speed + G * math.sin(tilt) * (2.0 - time), abs=1e-8)


@laws
def test_a_ball_at_rest_is_hit_from_above_and_from_the_side(law):
    """From above: down, off the floor and up again in one instant, so the falling ball rebounds and the other stays."""
    world = scene([FLOOR, ball("low", (0, 0, 0.1)), ball("high", (0, 0, 1.3))], (2,), G)
    run, fall = engine(world, law, 2 * math.sqrt(2 / G)), G * math.sqrt(2 / G)
    run.advance(1)
    assert run.read().positions[:, 2].tolist() == pytest.approx([0.1, 1.3], abs=1e-13)
    assert fall > 4
    assert run.read().velocities[:, 2].tolist() == pytest.approx([0, 0], abs=1e-13)
    pair = [FLOOR, ball("a", (0, 0, 0.1), (2, 0, 0)), ball("b", (1, 0, 0.1))]
    run = engine(scene(pair, gravity=G, bounciness=1.0), law)
    run.advance(1)
    assert run.read().positions.ravel().tolist() == pytest.approx([0.8, 0, 0.1, 2.2, 0, 0.1], abs=1e-14)


def test_a_static_sphere_is_an_obstacle():
    post = Body("post", Sphere(0.5), None, (0.0, 0.0, 0.0))
    run = engine(scene([post, ball("ball", (0, 0, 1.6))], gravity=G), step=2 * math.sqrt(2 / G))
    run.advance(1)
    assert run.read().positions[0].tolist() == pytest.approx([0, 0, 1.6], abs=1e-13)
    assert run.impacts == (1, 0)


@laws
def test_independent_impacts_at_one_instant_mirror_exactly(law):
    left = [ball("a", (-2, 0.05, 0), (1.5, 0, 0)), ball("b", (-1, 0, 0), (0.5, 0.1, 0), mass=2.0)]
    right = [replace(b, position=(-b.position[0], *b.position[1:])) for b in left]
    right = [replace(b, name=b.name + "'", velocity=(-b.velocity[0], *b.velocity[1:])) for b in right]
    run = engine(scene([*left, *right], bounciness=0.7), law)
    run.advance(1)
    state = run.read()
    assert run.impacts[0] >= 2
    assert np.array_equal(state.positions[:2] * (-1, 1, 1), state.positions[2:])
    assert np.array_equal(state.velocities[:2] * (-1, 1, 1), state.velocities[2:])


@laws
@pytest.mark.parametrize("b", [0.0, 0.5, 1.0])
def test_a_ball_between_two_gives_both_the_same(law, b):
    """Normals at 30 degrees, c^2 = 3/4. Each gets p = m v (1 + e) c/(1 + 2 c^2) along its normal: elastic, the ball
    comes back at v/5 and the two leave at 6 v/(5 sqrt 3). Glued (R8), all three go on at v/3.
    """
    near = (math.sqrt(0.03), 0.1)
    balls = [ball("cue", (-1, 0, 0), (2, 0, 0)), *(ball(f"{z}", (near[0] - 0.3, 0, z * near[1])) for z in (-1, 1))]
    run = engine(scene([*balls], (0, 2), bounciness=b), law)
    run.advance(1)
    push = 2 * (1 + b) * math.sqrt(3) / 2 / 2.5
    newton = np.array([[2 - math.sqrt(3) * push, 0], *([math.sqrt(3) / 2 * push, z * push / 2] for z in (-1, 1))])
    elastic = np.array([[-0.4, 0], *([1.2, z * 1.2 / math.sqrt(3)] for z in (-1, 1))])
    due = newton if law == "nc" else b * elastic + (1 - b) * np.array([[2 / 3, 0]] * 3)
    assert np.abs(run.read().velocities[:, [0, 2]] - due).max() <= 20 * EPS


@laws
@pytest.mark.parametrize("b", [0.3, 1.0])
@pytest.mark.parametrize("face", ["flat", "point"])
def test_a_symmetric_break_is_symmetric(law, b, face):
    (case,) = (case_named(f"simultaneous_break[rows=2,face={face}]"),)
    world = replace(case.scene, contact=Contact(b))
    run = engine(world, law, world.duration)
    run.advance(1)
    velocities, total = run.read().velocities, np.array([3.0, 0.0, 0.0])
    assert np.abs(velocities[2] - velocities[3] * (1, 1, -1)).max() <= 20 * EPS  # the row of two
    assert np.abs(velocities.sum(axis=0) - total).max() <= 20 * EPS
    assert (velocities**2).sum() <= 9 * (1 + 20 * EPS)
    if b == 1:
        assert (velocities**2).sum() == pytest.approx(9, rel=20 * EPS)


def test_a_corner_reverses_both_and_unlike_walls_are_taken_one_by_one():
    corner = [Body(n, HalfSpace(w), None, (0.0, 0.0, 0.0)) for n, w in (("x", (1.0, 0, 0)), ("z", (0.0, 0.0, 1.0)))]
    hit = scene([*corner, ball("ball", (0.6, 0, 0.6), (-1, 0, -1))], (0, 2), bounciness=1.0)
    run = engine(hit)
    run.advance(1)
    assert run.impacts == (0, 2)
    assert run.read().velocities[0].tolist() == [1, 0, 1]
    unlike = engine(replace(hit, pairs=(("x", "ball", Contact(0.5)),)), "nc")
    unlike.advance(1)
    assert unlike.read().velocities[0].tolist() == [0.5, 0, 1]


def test_two_balls_that_hit_a_touching_row_send_two_on():
    row = [ball(f"{i}", (0.2 * i, 0, 0), ((1.0 if i < 2 else 0.0), 0, 0)) for i in range(2)]
    row += [ball(f"{i}", (0.2 * i + 0.5, 0, 0)) for i in range(2, 5)]
    run = engine(scene(row, (0,), bounciness=1.0))
    run.advance(1)
    assert run.read().velocities[:, 0].tolist() == [0, 0, 0, 1, 1]


def test_one_call_is_as_many_single_steps_and_the_full_model_is_the_same():
    world = gas(40)
    whole, single, full = engine(world, step=0.01), engine(world, step=0.01), engine(world, step=0.01, model=FULL)
    contestant: Engine = whole
    contestant.advance(300)
    full.advance(300)
    for _ in range(300):
        single.advance(1)
        single.read()
    assert np.array_equal(whole.read().positions, single.read().positions)
    assert np.array_equal(whole.read().positions, full.read().positions)
    contestant.close()


def test_contact_times_against_a_fine_search():
    """The first inward passage of |d + u t + a t^2/2| = 1, found on a grid; a step of 1e-4 s tells roots apart."""
    random, times, found = np.random.default_rng(5), np.arange(1, 100_001) * 1e-4, 0
    for _ in range(60):
        d = random.normal(size=3)
        d *= random.uniform(1.2, 3) / np.linalg.norm(d)
        u, a = random.normal(size=3) - d, random.normal(size=3) * random.choice([0.1, 3.0])
        for pull, time in ((a, curve(*d, *u, *a, 1.0, 0.0)), (0 * a, meet(*d, *u, 1.0))):
            path = d + np.outer(times, u) + np.outer(times**2 / 2, pull)
            inside = np.nonzero(np.linalg.norm(path, axis=1) < 1)[0]
            if len(inside):
                assert times[inside[0]] - 1e-4 - 1e-12 <= time <= times[inside[0]] + 1e-12
                found += 1
            elif time < 10:  # a grazing passage between two points of the grid
                closest = np.linalg.norm(path, axis=1).min()
                assert closest < 1 + 1e-7
    assert found > 40


def test_the_bound_of_events_raises(monkeypatch):
    monkeypatch.setattr(exact_contestant, "MOST_EVENTS", 50)
    with pytest.raises(RuntimeError, match=r"test\[case=1\]: t = [0-9.]+ s: more than 50 events"):
        engine(gas(40), step=100.0).advance(1)


@laws
@pytest.mark.parametrize("b", [0.0, 0.5])
def test_stacks_are_declared(law, b):
    column = [FLOOR, ball("low", (0, 0, 0.2)), ball("high", (0, 0, 0.6))]
    with pytest.raises(Unsupported, match=r"test\[case=1\]: t = .*does not stack"):
        engine(scene(column, (2,), G, bounciness=b), law)


def test_what_is_not_done_is_declared():
    def refused(message, bodies, law="doc", model=None, **options):
        with pytest.raises(Unsupported, match=message):
            engine(scene(bodies, **options), law, model=model)

    with pytest.raises(Unsupported, match="needs rotation"):
        engine(replace(scene([ball("a", (0, 0, 0))]), model=FULL))
    refused("moves spheres only", [Body("crate", Box((1.0, 1.0, 1.0)), 1.0, (0.0, 0.0, 0.0))])
    refused("has no capsule", [Body("pill", Capsule(0.1, 0.2), 1.0, (0.0, 0.0, 0.0))])
    turned = Body("crate", Box((1.0, 1.0, 1.0)), None, (0.0, 0.0, 0.0), orientation=(0.6, 0.8, 0.0, 0.0))
    refused("'crate'.*axis-aligned", [turned])
    refused("frictionless", [ball("a", (0, 0, 0))], "nc", friction=0.2)
    refused("frictionless", [ball("a", (0, 0, 0))], viscosity=0.2)
    refused("R14 would spin", [ball("a", (0, 0, 0))], model=FULL, bounciness=0.5)
    refused("'a' and 'b' overlap by 0.1 m", [ball("a", (0, 0, 0)), ball("b", (0.1, 0, 0))])
    refused("'floor' and 'a' overlap by 0.05 m", [FLOOR, ball("a", (0, 0, 0.05))])
    refused("side by side", [ball("a", (0, 0, 0)), ball("b", (1, 0.1, 0))], axes=(0,))
    refused("radius 0", [ball("a", (0, 0, 0), radius=0.0), ball("b", (1, 0, 0), radius=0.0)])
    slope = Body("slope", HalfSpace((0.6, 0.0, 0.8)), None, (-5.0, 0.0, 0.0))
    refused("'slope': normal .* off the modelled axes", [slope, ball("a", (0, 0, 0))], axes=(0,))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "'ball': mass 0.0"),
        ({"mass": math.nan}, "'ball': mass nan"),
        ({"position": (0.0, math.nan, 0.0)}, "'ball': position"),
        ({"velocity": (math.inf, 0.0, 0.0)}, "'ball': velocity"),
        ({"velocity": (0.0, 1.0, 0.0)}, "'ball': velocity .* leaves the modelled axes"),
        ({"shape": Sphere(-0.1)}, "'ball': radius -0.1"),
        ({"shape": HalfSpace((0.0, 0.0, 1.0))}, "'ball': mass 1.0 given"),
    ],
)
def test_a_bad_body_is_refused_by_name_and_field(change, message):
    with pytest.raises(ValueError, match=message):
        engine(scene([FLOOR, replace(ball("ball", (0, 0, 1)), **change)], (0, 2)))


def test_bad_options_are_refused():
    world = scene([ball("a", (0, 0, 0))])
    with pytest.raises(ValueError, match=r"bounciness 1\.5 must lie"):
        engine(replace(world, contact=Contact(1.5)))
    with pytest.raises(ValueError, match="step 0"):
        engine(world, step=0)
    with pytest.raises(ValueError, match="unknown profile 'stepped'"):
        Exact(world, "doc", "stepped", world.model, 1.0)
    with pytest.raises(ValueError, match=r"test\[case=1\]: gravity"):
        engine(replace(world, gravity=(0.0, 0.0, math.nan)))
