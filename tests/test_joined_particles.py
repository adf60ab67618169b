"""The two routes of rule R14, each against its own closed form; how far they differ is shown, never a gate."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from impactbench.reference.joined_particles import SHAPES, TIME, particle_route, rigid_route
from impactbench.reports.cli import main


@pytest.mark.parametrize("shape", SHAPES)
def test_the_rigid_route_is_the_closed_form(shape):
    # n particles of 1 kg, arm 1/2: I = 1/2 (dumbbell), 2 (square); m_eff = 1/(1/n + 1/(4 I)): 1, 8/3 kg.
    count, inertia = (2, 0.5) if shape.startswith("dumbbell") else (4, 2.0)
    blow = 2 / (1 + 1 / count + 0.25 / inertia)
    found = rigid_route(shape, 1.0)
    assert (found.ball, found.body, found.spin) == pytest.approx((1 - blow, blow / count, -blow / 2 / inertia))


@pytest.mark.parametrize("b", [1.0, 0.5])
@pytest.mark.parametrize("shape", SHAPES)
def test_in_the_particle_route_spin_emerges_from_the_struck_particles_impact(shape, b):
    # The particle takes J = (1 + b)/2 N s; the distances share it: V = J/n, w = J/2 / I. Spin errs to first order:
    # putting the struck particle back by v h/2 across its velocity v changes L by v^2 h/2, and turning on the chord
    # loses w^2 h^2 of it a step.
    count, inertia = (2, 0.5) if shape.startswith("dumbbell") else (4, 2.0)
    blow = (1 + b) / 2
    for step in (1 / 60, 1 / 960):
        found = particle_route(shape, b, step)
        assert (found.ball, found.body) == pytest.approx((1 - blow, blow / count), abs=1e-9)
        spin = blow / 2 / inertia
        assert found.spin == pytest.approx(-spin, abs=blow**2 * step / 2 / inertia + spin**3 * step * TIME)


def test_both_agree_where_the_struck_particle_carries_the_effective_mass_and_only_there():
    end, corner = SHAPES
    rigid, particles = rigid_route(end, 0.5), particle_route(end, 0.5, 1 / 960)
    assert (particles.ball, particles.body, particles.spin) == pytest.approx(
        (rigid.ball, rigid.body, rigid.spin), abs=1e-3
    )
    assert rigid_route(corner, 1.0).body - particle_route(corner, 1.0, 1 / 960).body > 0.1


def test_the_command_shows_both():
    text = CliRunner().invoke(main, ["routes"])
    assert text.exit_code == 0, text.output
    assert "dumbbell" in text.output
    rows = json.loads(CliRunner().invoke(main, ["routes", "--json"]).output)
    assert rows[0]["routes"]["rigid body"]["spin"] == pytest.approx(-1.0)
    assert rows[0]["routes"]["particles, 1/960 s"]["spin"] == pytest.approx(-1.0, abs=1e-3)
