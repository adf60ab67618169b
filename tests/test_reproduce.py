"""Published figures come out of the ordinary adapters, and out of two-line integrators that say why."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from impactbench.adapters.contestants import CONTESTANTS
from impactbench.reports import reproduce
from impactbench.reports.cell import record, step_count
from impactbench.reports.cli import main
from impactbench.reports.conservation import energies
from impactbench.scenarios.engine import Unavailable
from impactbench.scenarios.published import BENCHMARKS, bouncing_balls, half_step, half_step_square

BOUNCING, TUMBLING = BENCHMARKS
QUICK = [entry for entry in reproduce.plan() if entry[0].step >= 1e-3]
G, MASS, RADIUS, HEIGHT, SECONDS = 9.81, 49 * 10.0, 0.1, 5.0, 20.0


def label(entry):
    cell, contestant = entry
    return f"{cell.benchmark.name}-{cell.engine}-{cell.step:g}-{cell.measure}-{contestant}"


@pytest.fixture(scope="module")
def rows():
    return {label((row.cell, row.contestant)): row for row in reproduce.reproduce(QUICK, 2)}


@pytest.mark.parametrize("entry", QUICK, ids=label)
def test_published_figure(rows, entry):
    """Bounces agree in all six digits, as the arithmetic is the same; see below for the tumbling box."""
    row = rows[label(entry)]
    if row.state == "unavailable":
        pytest.skip(row.reason)
    assert row.state == "ok", row.reason
    if row.cell.value is None:
        # RK4 at this step: nothing but round-off, which grows with the 490 m fallen and 10^4 steps.
        assert row.measured < 1e-10
    else:
        assert row.digits >= (6 if row.cell.benchmark is BOUNCING or row.cell.measure == "position" else 4)
    assert row.holds


def test_cells_asked_for_are_there():
    """The figures of the issue, typed a second time."""
    have = {(c.benchmark.name, c.engine, c.step, c.measure, c.value) for c, _ in QUICK}
    assert have >= {
        ("bouncing", "ODE", 1e-2, "energy_square", 18808.3),
        ("bouncing", "ODE", 4e-3, "energy_square", 2982.68),
        ("bouncing", "Bullet", 1e-2, "energy_square", 7.40664e6),
        ("bouncing", "Bullet", 4e-3, "energy_square", 1.20178e6),
        ("tumbling", "ODE", 1e-3, "angular_momentum", 0.0130708),
        ("tumbling", "ODE", 1e-3, "energy", 0.012462),
        ("tumbling", "ODE", 1e-3, "position", 0.049),
        ("tumbling", "Bullet", 1e-3, "angular_momentum", 0.0124501),
        ("tumbling", "Bullet", 1e-3, "energy", 0.0135771),
    }


def bounce(step, extra):
    """Energy errors and velocities of all balls: semi-implicit Euler, an overlapping ball is turned round at once.

    extra: 0 reflects the velocity found, 1 the velocity that already holds the step's gravity.
    """
    z, v, found = HEIGHT, 0.0, []
    for _ in range(round(SECONDS / step)):
        found.append((MASS * (v * v / 2 + G * (z - HEIGHT)), v))
        v = -v + extra * G * step if z < RADIUS and v < 0 else v - G * step
        z += v * step
    return np.array(found).T


@pytest.mark.parametrize("step", [1e-2, 4e-3])
@pytest.mark.parametrize(("engine", "extra"), [("ODE", 0), ("Bullet", 1)])
def test_two_lines_give_the_published_bounces(step, engine, extra):
    published = BOUNCING.published[engine][step]["energy_square"]
    assert reproduce.digits_agreed(published, np.mean(bounce(step, extra)[0] ** 2)) == 6


@pytest.mark.parametrize("step", [1e-2, 1e-3, 1e-4])
def test_half_step_offset(step):
    """E - E0 = M g h v / 2 at every step, impacts included: the figure holds no impact error at all.

    Its mean square departs from the formula only because the time sampled is not a whole number of bounces (of
    some 2 s, ten in all), and the turning points are missed by up to a step.
    """
    error, v = bounce(step, 0)
    assert np.abs(error - MASS * G * step * v / 2).max() < 1e-9 * MASS * G * HEIGHT
    expected = half_step(BOUNCING, step, "energy_square")
    assert expected == half_step_square(MASS, G, step, HEIGHT - RADIUS)
    assert np.mean(error**2) == pytest.approx(expected, rel=2 * step + 1e-3)
    assert np.mean(v**2) == pytest.approx(2 * G * (HEIGHT - RADIUS) / 3, rel=2 * step + 1e-3)


def test_half_step_offset_as_stated():
    assert half_step(BOUNCING, 1e-2, "energy_square") == pytest.approx(18511.6, abs=0.05)
    assert half_step(BOUNCING, 4e-3, "energy_square") == pytest.approx(2961.9, abs=0.05)
    assert half_step(TUMBLING, 1e-3, "position") == pytest.approx(0.049, rel=1e-12)
    # m g^2 h T / 2 = 4.802 J of (m v^2 + w . L) / 2 = 368.546 J.
    assert half_step(TUMBLING, 1e-3, "energy") == pytest.approx(4.802 / 368.546, rel=1e-5)
    assert half_step(TUMBLING, 1e-3, "angular_momentum") is None


def test_reflecting_gravity_too_gains_energy_at_a_steady_rate():
    """Each impact at V gains M g h V and comes every 2 V/g: M g^2 h / 2 per second at any speed. Ten bounces of growing
    length make that good to some per cent.
    """
    for step in (1e-3, 1e-2):
        error, _ = bounce(step, 1)
        assert np.mean(error**2) == pytest.approx((MASS * G**2 * step * SECONDS / 2) ** 2 / 3, rel=0.03)


def turned(q, angle, axis, linear):
    """q after a turn about `axis`: exactly, or by adding the increment and normalising, as ODE does."""
    dw, s = (1.0, angle / 2) if linear else (math.cos(angle / 2), math.sin(angle / 2))
    x, y, z = (s * part for part in axis)
    w, a, b, c = q
    q = (dw * w - x * a - y * b - z * c, dw * a + x * w + b * z - c * y)
    q += (dw * b + y * w + c * x - a * z, dw * c + z * w + a * y - b * x)
    size = math.hypot(*q)
    return tuple(part / size for part in q)


def tumble(step, linear):
    """Largest |L - L0| / |L0| of the box: explicit Euler of Euler's equations in the body's axes."""
    inertia = np.array(TUMBLING.scene.bodies[0].principal_inertia())
    i, j, k = inertia
    a, b, c = TUMBLING.scene.bodies[0].spin
    q, turns, spins = (1.0, 0.0, 0.0, 0.0), [(1.0, 0.0, 0.0, 0.0)], [(a, b, c)]
    for _ in range(round(10 / step)):
        a, b, c = a + step * b * c * (j - k) / i, b + step * a * c * (k - i) / j, c + step * a * b * (i - j) / k
        size = math.hypot(a, b, c)
        q = turned(q, size * step, (a / size, b / size, c / size), linear)
        turns.append(q)
        spins.append((a, b, c))
    w, u = np.array(turns)[:, :1], np.array(turns)[:, 1:]
    own = np.array(spins) * inertia
    t = 2 * np.cross(u, own)
    momenta = own + w * t + np.cross(u, t)
    return float(np.linalg.norm(momenta - momenta[0], axis=1).max() / np.linalg.norm(momenta[0]))


def test_why_the_tumbling_box_agrees_to_four_digits_only():
    """ODE adds quaternion increments, which turns by 2 atan(w h/2) instead of w h; engines of today turn by w h."""
    published = TUMBLING.published["ODE"][1e-3]["angular_momentum"]
    assert reproduce.digits_agreed(published, tumble(1e-3, linear=True)) >= 5
    assert reproduce.digits_agreed(published, tumble(1e-3, linear=False)) == 4


@pytest.mark.parametrize("name", ["pybullet/maximal", "pybullet/multibody", "pymunk/default"])
def test_one_ball_stands_for_49(name):
    """They never meet, so that 49 balls have 49 times the energy of one."""
    who = reproduce.contestant(name)
    step, figures = 1e-2, []
    try:
        engine = who.load()
    except Unavailable as why:
        pytest.skip(str(why))
    for count in (1, 49):
        scene = bouncing_balls(count)
        world = engine(scene, "nc", who.profile, scene.model, step)
        energy = 49 / count * energies(scene, record(world, step, step_count(scene, step)))
        world.close()
        figures.append(np.mean((energy[:-1] - energy[0]) ** 2))
    assert figures[1] == pytest.approx(figures[0], rel=1e-9)


def test_published_modes_are_not_contestants():
    """They exist to reproduce, and must not double an engine's columns in a comparison."""
    assert {c.profile for c in CONTESTANTS if c.engine in ("pybullet", "mujoco", "pymunk")} == {"default", "tuned"}


@pytest.mark.parametrize(
    ("published", "measured", "digits"),
    [
        (18808.3, 18808.3055, 6),
        (18808.3, 18808.36, 5),
        (1.20178e6, 1201783.7, 6),
        (0.0130708, 0.0130699, 4),
        (0.049, 0.0489999, 5),
        (9.99999, 10.00001, 5),
        (1.0, 1.4, 1),
        (1.0, 7.0, 0),
        (1.0, -1.0, 0),
    ],
)
def test_digits_agreed(published, measured, digits):
    assert reproduce.digits_agreed(published, measured) == digits


def row(measured, state="ok"):
    return reproduce.Row(QUICK[0][0], QUICK[0][1], state, measured=measured)


def test_exit_codes():
    value = QUICK[0][0].value
    good, bad, gone = row(value), row(value * 1.001), row(None, "unavailable")
    assert reproduce.exit_code([good]) == 0
    assert reproduce.exit_code([good, gone]) == 3
    assert reproduce.exit_code([good, gone, bad]) == 1
    assert "3 !" in reproduce.text([bad])
    assert "unavailable" in reproduce.text([gone])


def test_a_missing_engine_is_a_row_of_its_own(monkeypatch):
    gone = tuple(replace(c, distribution="no-such-distribution") for c in CONTESTANTS)
    monkeypatch.setattr(reproduce, "CONTESTANTS", gone)
    found = reproduce.reproduce(reproduce.plan(["mujoco/rk4"]), 1)
    assert {r.state for r in found} == {"unavailable"}
    assert reproduce.exit_code(found) == 3


def test_command_line():
    done = CliRunner().invoke(main, ["reproduce", "mujoco/rk4", "--json"])
    assert done.exit_code in (0, 3)
    found = json.loads(done.stdout)
    assert {r["project"] for r in found} == {"scpeters/benchmark"}
    assert {r["measure"] for r in found} == {"position", "angular_momentum", "energy"}


def test_unknown_names_are_told_the_known_ones():
    with pytest.raises(reproduce.UnknownName, match="did you mean bouncing"):
        reproduce.plan(["boncing"])
    assert {cell.benchmark.name for cell, _ in reproduce.plan(["SimBench*"])} == {"bouncing"}
    assert {name for _, name in reproduce.plan(["mujoco/*"])} >= {"mujoco/rk4", "mujoco/tuned"}
