"""Policies: settings reach the engine, stay in their own world, and mistakes are one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from impactbench.adapters import policies
from impactbench.adapters.contestants import CONTESTANTS, POLICIES, UnknownContestant, select
from impactbench.reports.cell import Cell, build
from impactbench.reports.cli import main
from impactbench.reports.gate import selector

CASE = "bouncing_ball[bounciness=0.8]"
CELL = Cell(CASE, "nc", "", "minimal", "1/60")


def names(*engines: str) -> list[str]:
    return [contestant.name for contestant in select(engines)]


def test_every_policy_has_its_source_and_every_source_its_policy():
    assert {c.name for c in (*CONTESTANTS, *POLICIES)} == set(policies.SOURCES)
    assert all(policies.SOURCES.values())


@pytest.mark.parametrize("name", [p.name for p in POLICIES if p.options])
def test_settings_reach_the_engine_and_its_neighbours_do_not_inherit_them(name: str):
    """The settings are stored with the run; the same profile without them moves as before to the last bit."""
    (plain,), (changed,) = select([name.partition(":")[0]]), select([name])
    before = end(plain)
    engine = build(CELL, changed)
    assert dict(changed.options).items() <= dict(engine.settings).items()
    engine.advance(30)
    engine.close()
    assert end(plain) == before


def end(contestant) -> list[list[float]]:
    engine = build(CELL, contestant)
    engine.advance(60)
    found: list[list[float]] = engine.read().positions.tolist()
    engine.close()
    return found


@pytest.mark.parametrize(
    ("plain", "changed"),
    [
        ("pybullet/default", "pybullet/default:numSubSteps=4"),
        ("mujoco/default", "mujoco/default:integrator=RK4"),
        ("pymunk/default", "pymunk/default:collision_slop=0.001"),
    ],
)
def test_a_setting_that_matters_changes_the_motion(plain: str, changed: str):
    assert end(select([plain])[0]) != end(select([changed])[0])


def test_names_are_the_same_however_settings_are_written():
    assert names("mujoco/tuned: iterations=20 ,cone=pyramidal") == ["mujoco/tuned:cone=pyramidal,iterations=20"]
    assert names("mujoco/tuned:iterations=20.0") == names("mujoco/tuned:iterations=20")
    (found,) = select(["mujoco/tuned:iterations=20"])
    assert selector(found) == found.name
    assert replace(found, options=()) == select(["mujoco/tuned"])[0]
    assert len(select(["mujoco", "mujoco/tuned:iterations=20"])) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mujoco/tuned:iteration=3", "unknown setting 'iteration'; did you mean iterations"),
        ("mujoco/tuned:iterations=x", "takes a whole number of at least 1"),
        ("mujoco/tuned:iterations=1.5", "takes a whole number of at least 1"),
        ("mujoco/tuned:tolerance=nan", "takes a number from 0 to 1"),
        ("mujoco/tuned:cone=round", "takes pyramidal or elliptic"),
        ("mujoco/tuned:iterations", "is not a setting; write mujoco/tuned:name=value"),
        ("mujoco/tuned:iterations=1,iterations=2", "given twice"),
        ("mujco/tuned:iterations=1", "did you mean mujoco/tuned"),
        ("mujoco:iterations=1", "no profile 'mujoco'"),
        ("reference/stepped:iterations=1", "known: none"),
        ("absent.toml", "No such file"),
    ],
)
def test_a_mistake_is_one_line(text: str, message: str):
    with pytest.raises(UnknownContestant, match=message) as caught:
        select([text])
    assert "\n" not in str(caught.value)


def test_policies_of_a_file(tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text('[[policy]]\nbase = "mujoco/tuned"\niterations = 20\n\n[[policy]]\nbase = "pymunk/default"\n')
    assert names(str(file)) == ["pymunk/default", "mujoco/tuned:iterations=20"]
    for text, message in (
        ("[[policy]]\niterations = 1\n", "policy 1: base is missing"),
        ('[[policy]]\nbase = "mujoco/tuned"\nfoo = 1\n', "unknown setting 'foo'"),
        ("[[policies]]\n", "holds tables"),
        ("policy = [", "is not TOML"),
    ):
        file.write_text(text)
        with pytest.raises(UnknownContestant, match=message) as caught:
            select([str(file)])
        assert str(file) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_policy_runs_from_the_command_line_under_its_own_name():
    words = ["run", CASE, "--engine", "mujoco/tuned:iterations=20", "--step", "1/60", "--json"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    (cell,) = json.loads(result.stdout)["cells"]
    assert cell["contestant"] == "mujoco/tuned:iterations=20"
    assert cell["settings"]["iterations"] == 20


def test_the_list_of_engines_names_every_policy_and_setting(monkeypatch):
    monkeypatch.setenv("COLUMNS", "250")
    text = CliRunner().invoke(main, ["list", "engines"]).output
    for policy in POLICIES:
        assert f"{policy.name} " in text
        assert policies.SOURCES[policy.name] in text
    assert "numSubSteps" in text
