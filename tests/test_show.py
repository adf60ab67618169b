"""`show`: a case in plain text, and a sketch that puts bodies where they are."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from impactbench.reports.picture import describe, picture_axes, sketch
from impactbench.scenarios.catalogue import all_cases, select
from impactbench.scenarios.records import Body, HalfSpace, Model, Scene, Sphere, Vector

COMMAND = str(Path(sys.executable).parent / "impactbench")


def scene(*bodies: Body) -> Scene:
    return Scene("made[up=1]", bodies, 1.0, Model((0, 2)), 1.0, 1.0, 1.0)


def ball(name: str, position: Vector, velocity: Vector = (0.0, 0.0, 0.0), radius: float = 0.1) -> Body:
    return Body(name, Sphere(radius), 1.0, position, velocity)


def test_every_case_fits_a_screen_and_shows_every_body() -> None:
    for case in all_cases():
        text = describe(case)
        assert len(text.splitlines()) <= 100, case.scene.name
        drawing = sketch(case.scene)
        assert max(map(len, drawing.splitlines())) <= 90, case.scene.name
        assert "A" in drawing, case.scene.name
        if case.scene.statics:
            assert "#" in drawing, case.scene.name


def test_bodies_stand_in_the_order_of_their_places() -> None:
    drawing = sketch(scene(ball("left", (-1, 0, 0)), ball("right", (1, 0, 0)), ball("high", (0, 0, 1))))
    rows = drawing.splitlines()
    first = {name: next(row for row, line in enumerate(rows) if name in line) for name in "ABC"}
    assert first["C"] < first["A"] == first["B"]
    both = rows[first["A"]]
    assert both.index("A") < both.index("B")


@pytest.mark.parametrize(
    ("velocity", "tip"), [((1, 0, 0), ">"), ((-1, 0, 0), "<"), ((0, 0, 1), "^"), ((0, 0, -1), "v"), ((0, 0, 0), None)]
)
def test_the_arrow_points_where_the_body_goes(velocity: Vector, tip: str | None) -> None:
    drawing = sketch(scene(ball("one", (0, 0, 0), velocity), ball("other", (2, 0, 2))))
    assert {mark for mark in "><^v" if mark in drawing.rpartition("\n")[0]} == ({tip} if tip else set())


def test_a_wall_fills_its_own_side() -> None:
    wall = Body("wall", HalfSpace((1.0, 0.0, 0.0)), None, (-1.0, 0.0, 0.0))
    lines = sketch(scene(ball("ball", (0, 0, 0)), wall)).splitlines()[:-1]
    assert all(line.startswith("#") for line in lines)
    assert all(set(line[line.rindex("#") :]) <= {"#", " ", "A"} for line in lines)


def test_the_axes_are_those_of_the_motion() -> None:
    assert picture_axes(scene(ball("one", (0, 0, 0), (0, 3, 1)))) == (1, 2)
    assert picture_axes(scene(ball("one", (0, 0, 0), (3, 2, 0)))) == (0, 1)
    assert picture_axes(scene(ball("one", (0, 0, 0), (3, 0, 0)))) == (0, 2)


def test_facts_come_from_the_case() -> None:
    (case,) = select(["sliding_on_slab[friction=coulomb]"])
    text = describe(case)
    assert "slab and block   bounciness 0, friction 0.3" in text
    assert "smallest model   axes x z, gravity, friction" in text
    assert "truth, law nc" in text
    assert "truth, law doc" not in text


def test_the_command_shows_one_case() -> None:
    def show(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([COMMAND, "show", name], capture_output=True, text=True, check=False, timeout=60)

    done = show("equal_masses[bounciness=0.5]")
    assert (done.returncode, done.stderr) == (0, "")
    assert "impacts at 0.276667 s" in done.stdout
    several = show("equal_masses")
    assert several.returncode == 2
    assert several.stderr.startswith("impactbench: show takes one case; equal_masses is 7: equal_masses[bounciness=0],")
    assert len(several.stderr.splitlines()) == 1
