"""The hard families: their cases are found by name only, and every criterion of survival can fail."""

import json
import sys
from pathlib import Path

import pytest
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import Cell
from impactbench.reports.hard import LINES, Journal, plan, run
from impactbench.reports.hard_cell import run_hard
from impactbench.scenarios import catalogue, hard
from impactbench.scenarios.catalogue import UnknownCase

sys.path.insert(0, str(Path(__file__).parent))  # also what child processes search
from fakes import hard as fakes

EVERY = [(family.name, name) for family in hard.HARD.values() for name in family.names(full=False)]


def test_hard_cases_take_part_only_when_named():
    assert not {case.scene.family for case in catalogue.select()} & set(hard.HARD)
    assert not {case.scene.family for case in catalogue.select(["*"])} & set(hard.HARD)
    assert not set(catalogue.FAMILIES) & set(hard.HARD)
    named = [case.scene.name for case in catalogue.select(["heavy_on_light", "equal_masses"])]
    assert list(dict.fromkeys(name.partition("[")[0] for name in named)) == ["equal_masses", "heavy_on_light"]
    assert len(catalogue.select(["heavy_*"])) == 6
    assert [case.scene.name for case in catalogue.select(["tall_stack[shape=box,*5]"])] == [
        "tall_stack[shape=box,count=5]"
    ]


@pytest.mark.parametrize("name", [name for _, name in EVERY])
def test_every_case_is_known_by_its_name_and_has_criteria(name):
    (case,) = catalogue.select([name])
    assert case.scene.name == name
    criteria = hard.criteria_of(case.scene)
    assert criteria
    assert all(criterion.derivation and criterion.description for criterion in criteria)
    assert set(case.truths) == set(case.scene.laws)


def test_any_value_makes_a_case():
    (case,) = catalogue.select(["tall_stack[shape=box,count=37]"])
    assert len(case.scene.movable) == 37
    for wrong in ("tall_stack[count=37]", "tall_stack[shape=box,count=x]", "tall_stack[shape=box,count=037]"):
        with pytest.raises(UnknownCase, match="nearest: tall_stack"):
            catalogue.select([wrong])


@pytest.mark.parametrize("family", [family for family in hard.HARD.values() if family.knob], ids=lambda f: f.name)
def test_knobs_reach_their_bounds(family):
    knob = family.knob
    names = {criterion.name for criterion in hard.criteria_of(hard.knob_case(family, knob.low).scene)}
    assert set(knob.criteria) <= names
    for value in (knob.low, knob.high):
        scene = hard.knob_case(family, value).scene
        assert knob.step or scene.parameters[knob.parameter] == value


def fake(kind):
    return Contestant(kind.__name__, "default", f"{kind.__module__}:{kind.__name__}", "")


def verdicts(kind, name, step="1/240"):
    (case,) = catalogue.select([name])
    cell = Cell(name, case.scene.laws[-1], "fake", "minimal", step)
    return run_hard((cell, fake(kind)))


BREAKING = [
    (fakes.Sagging, "tall_stack[shape=box,count=5]", "stands"),
    (fakes.Sagging, "heavy_on_light[ratio=1]", "stands"),
    (fakes.Sagging, "light_on_heavy[ratio=100]", "stands"),
    (fakes.Leaning, "tall_stack[shape=box,count=5]", "supported"),
    (fakes.Trembling, "tall_stack[shape=sphere,count=5]", "quiet"),
    (fakes.Ghost, "bullet_wall[travel=1]", "holds"),
    (fakes.Slow, "bullet_wall[travel=1]", "approach"),
    (fakes.Dull, "bullet_wall[travel=1]", "rebound"),
    (fakes.Slow, "fast_flight[speed=10]", "speed"),
    (fakes.Slow, "dispersing_billiard[ratio=1]", "energy"),
]


@pytest.mark.parametrize(("kind", "name", "criterion"), BREAKING, ids=lambda value: getattr(value, "__name__", value))
def test_each_criterion_fails_on_the_engine_that_breaks_it(kind, name, criterion):
    found = verdicts(kind, name)
    assert found["state"] == "failed"
    broken = {v["criterion"]: v for v in found["verdicts"] if not v["survived"]}
    assert broken[criterion]["worst"] > broken[criterion]["limit"]
    assert broken[criterion]["time"] is not None


@pytest.mark.parametrize("name", sorted({name for _, name, _ in BREAKING}))
def test_the_truth_survives(name):
    found = verdicts(fakes.Truthful, name)
    assert (found["state"], found["reason"]) == ("survived", "")


def test_every_criterion_has_its_fake():
    """A criterion nobody has seen fail is no criterion."""
    wanted = {(f.name, c.name) for f in hard.HARD.values() for v in f.values for c in f.criteria(f.make(**v).scene)}
    shared = {c for _, c in wanted}
    seen = {criterion for _, _, criterion in BREAKING}
    assert shared - seen == set()


def test_a_world_put_back_to_its_start_has_diverged():
    found = verdicts(fakes.PutBack, "fast_flight[speed=10]")
    assert (found["state"], found["reason"]) == (
        "diverged",
        "the whole world jumped back to its start at t = 0.416667 s",
    )


def test_a_killed_run_goes_on_where_it_stopped(tmp_path):
    entries = plan(catalogue.select(["fast_flight"]), [fake(fakes.Truthful)], policies=False)
    first = run(entries[:2], tmp_path, 1, "first", lambda *_: None)
    lines = tmp_path / LINES
    assert [cell["state"] for cell in first["cells"]] == ["survived", "survived"]
    with lines.open("a") as stream:
        stream.write('{"key": "torn')
    stored = lines.read_text()
    seen = []
    whole = run(entries, tmp_path, 1, "second", lambda lane, done, total: seen.append((done, total)))
    assert seen == [(2, 5), (3, 5), (4, 5), (5, 5)]
    assert lines.read_text().startswith(stored)
    assert [cell["case"] for cell in whole["cells"]] == [cell.case for cell, _ in entries]
    assert {cell["state"] for cell in whole["cells"]} == {"survived"}
    assert len(Journal(lines, json.loads(lines.read_text().splitlines()[0])).cells) == 5
    assert Journal(lines, {"impactbench": "another"}).cells == {}
