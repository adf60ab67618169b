"""The hard families: their cases are found by name only, and every criterion of survival can fail."""

import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from impactbench.adapters.contestants import Contestant, select
from impactbench.reports import hard_view, page
from impactbench.reports.cell import Cell
from impactbench.reports.geometry import Placed
from impactbench.reports.hard import LINES, Journal, describe_case, describe_family, plan, run
from impactbench.reports.hard_cell import put_back, run_hard
from impactbench.scenarios import catalogue, hard
from impactbench.scenarios.catalogue import UnknownCase
from impactbench.scenarios.trajectory import Trajectory

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
    ("Sagging", "tall_stack[shape=box,count=5]", "stands"),
    ("Leaning", "tall_stack[shape=box,count=5]", "supported"),
    ("Trembling", "tall_stack[shape=sphere,count=5]", "quiet"),
    ("Sagging", "heavy_on_light[ratio=1]", "stands"),
    ("Trembling", "heavy_on_light[ratio=1]", "quiet"),
    ("Sagging", "light_on_heavy[ratio=100]", "stands"),
    ("Trembling", "light_on_heavy[ratio=100]", "quiet"),
    ("Turning", "tipping[angle=20,expect=stand]", "stands"),
    ("Frozen", "tipping[angle=30,expect=tip]", "tips"),
    ("Sagging", "overhang[count=4,fraction=0.9,expect=stand]", "stands"),
    ("Frozen", "overhang[count=4,fraction=1.1,expect=fall]", "falls"),
    ("Leaning", "pyramid[rows=3]", "stands"),
    ("Sagging", "arch[friction=0.32,expect=stand]", "stands"),
    ("Frozen", "arch[friction=0.21,expect=fall]", "falls"),
    ("Ghost", "bullet_wall[travel=1]", "holds"),
    ("Slow", "bullet_wall[travel=1]", "approach"),
    ("Dull", "bullet_wall[travel=1]", "rebound"),
    ("Slow", "fast_flight[speed=10]", "speed"),
    ("Frozen", "fast_flight[speed=10]", "unclipped"),
    ("Trembling", "deep_overlap[overlap=0.1]", "calm"),
    ("Frozen", "deep_overlap[overlap=0.1]", "resolved"),
    ("Trembling", "zeno[bounciness=0.5]", "settles"),
    ("Frozen", "zeno[bounciness=0.5]", "bounces"),
    ("Heating", "wedge[angle=45]", "energy"),
    ("Frozen", "wedge[angle=45]", "place"),
    ("Heating", "cascade[ratio=10]", "energy"),
    ("Slow", "cascade[ratio=10]", "last"),
    ("Heating", "pi_billiard[ratio=100]", "energy"),
    ("Frozen", "pi_billiard[ratio=100]", "collisions"),
    ("Slow", "pi_billiard[ratio=100]", "leaves"),
    ("Ghost", "grazing[depth=0.1]", "hit"),
    ("Uneven", "impact_phase[pairs=32]", "spread"),
    ("Heating", "long_run[bounces=1000]", "energy"),
    ("Ghost", "long_run[bounces=1000]", "inside"),
    ("Frozen", "long_run[bounces=1000]", "bounces"),
    ("Heating", "tumbling_box[offset=0.001]", "energy"),
    ("Turning", "tumbling_box[offset=0.001]", "spin"),
    ("Slow", "far_from_origin[offset=1000]", "speed"),
    ("Late", "far_from_origin[offset=1000]", "place"),
    ("Frozen", "tiny[scale=0.1]", "heights"),
    ("Trembling", "tiny[scale=0.1]", "quiet"),
    ("Frozen", "huge[scale=10]", "heights"),
    ("Trembling", "huge[scale=10]", "quiet"),
    ("Late", "step_extremes[scene=bounce]", "error"),
    ("Sagging", "step_extremes[scene=stack]", "stands"),
    ("Heating", "billiard_gas[count=100,seed=1]", "energy"),
    ("Ghost", "billiard_gas[count=100,seed=1]", "inside"),
    ("Ghost", "billiard_gas[count=100,seed=1]", "apart"),
    ("Ghost", "billiard_gas[count=100,seed=1]", "maxwell"),
    ("Uneven", "simultaneous_break[rows=2,face=flat]", "symmetric"),
    ("Slow", "simultaneous_break[rows=2,face=flat]", "momentum"),
    ("Heating", "simultaneous_break[rows=2,face=flat]", "energy"),
    ("Slow", "dispersing_billiard[ratio=1]", "energy"),
]
KNOWN_TRUTHS = sorted(
    {
        name
        for _, name, _ in BREAKING
        if all(truth.kind == "trajectory" for truth in catalogue.select([name])[0].truths.values())
    }
)


@pytest.mark.parametrize(("kind", "name", "criterion"), BREAKING)
def test_each_criterion_fails_on_the_engine_that_breaks_it(kind, name, criterion):
    found = verdicts(getattr(fakes, kind), name)
    assert found["state"] == "failed"
    broken = {v["criterion"]: v for v in found["verdicts"] if not v["survived"]}
    assert broken[criterion]["worst"] > broken[criterion]["limit"]
    assert broken[criterion]["time"] is not None


@pytest.mark.parametrize("name", KNOWN_TRUTHS)
def test_the_truth_survives(name):
    found = verdicts(fakes.Truthful, name)
    assert (found["state"], found["reason"]) == ("survived", "")


def test_every_criterion_has_its_fake():
    """A criterion nobody has seen fail is no criterion."""
    wanted = {(f.name, c.name) for f in hard.HARD.values() for v in f.values for c in f.criteria(f.make(**v).scene)}
    assert wanted == {(name.partition("[")[0], criterion) for _, name, criterion in BREAKING}


@pytest.mark.parametrize(
    "name",
    [
        "wedge[angle=45]",
        "deep_overlap[overlap=0.5]",
        "long_run[bounces=1000]",
        "billiard_gas[count=100,seed=1]",
        "simultaneous_break[rows=2,face=flat]",
        "tipping[angle=35,expect=tip]",
        "overhang[count=4,fraction=1.1,expect=fall]",
        "arch[friction=0.21,expect=fall]",
        "tiny[scale=0.1]",
    ],
)
def test_cases_without_a_known_state_can_be_survived(name):
    """By a real engine: pymunk with its tuned settings."""
    cell = Cell(name, "nc", "pymunk/tuned", "minimal", hard.HARD[name.partition("[")[0]].steps(case(name).scene)[0])
    found = run_hard((cell, select(["pymunk/tuned"])[0]))
    assert (found["state"], found["reason"]) == ("survived", "")


def case(name):
    (found,) = catalogue.select([name])
    return found


@pytest.mark.parametrize(("ratio", "count"), [(1, 3), (100, 31), (10000, 314)])
def test_pi_comes_out_of_the_truth(ratio, count):
    assert len(case(f"pi_billiard[ratio={ratio}]").truths["nc"].impact_times) == count


def test_the_margins_of_statics():
    """Moments of the beam about its foot, and centres of mass of books, from the scenes' own places."""
    beam = case("arch[friction=0.32,expect=stand]").scene.bodies[1]
    corners = Placed(beam.shape, np.array([beam.position]), np.array([beam.orientation])).corners()[:, 0]
    foot, head = corners[np.argmin(corners[:, 2])], corners[np.argmax(corners[:, 0])]
    thrust = (beam.position[0] - foot[0]) / (head[2] - foot[2])  # H z = W x
    assert abs(foot[2]) < 1e-12
    assert abs(head[0]) < 1e-12
    assert math.isclose(thrust, hard.HARD["arch"].knob.truth, rel_tol=1e-12)
    books = [b.position[0] for b in case("overhang[count=4,fraction=1,expect=stand]").scene.bodies[1:]]
    assert all(math.isclose(np.mean(books[k + 1 :]) - books[k], 0.5, rel_tol=1e-12) for k in range(3))


def test_random_starts_are_stored():
    first = describe_case(case("billiard_gas[count=100,seed=1]").scene)
    again = describe_case(hard.HARD["billiard_gas"].make(count=100, seed=1).scene)
    assert first["parameters"]["seed"] == 1
    assert len(first["initial"]["positions"]) == len(first["initial"]["velocities"]) == 100
    assert first == again
    assert first != describe_case(hard.HARD["billiard_gas"].make(count=100, seed=2).scene)


POLICIES = [
    ("heavy_on_light[ratio=1e+06]", "mujoco/default", "mujoco/stiff"),
    ("tall_stack[shape=sphere,count=50]", "mujoco/tuned", "mujoco/cushion"),
    ("bullet_wall[travel=20]", "mujoco/tuned", "mujoco/speculative"),
    ("bullet_wall[travel=20]", "pybullet/tuned", "pybullet/swept"),
    ("bullet_wall[travel=20]", "pymunk/tuned", "pymunk/substeps"),
    ("heavy_on_light[ratio=10000]", "pymunk/default", "pymunk/iterations"),
]


@pytest.mark.parametrize(("name", "without", "policy"), POLICIES)
def test_policies_mend_what_breaks(name, without, policy):
    found = {}
    for who in select([without, policy]):
        found[who.name] = run_hard((Cell(name, "nc", who.name, "minimal", "1/240"), who))["state"]
    assert found == {without: "failed", policy: "survived"}


def test_an_engine_that_gives_up_its_world_has_diverged():
    """MuJoCo resets all bodies beyond 1e10 m/s; its other states are not to be taken for a result."""
    (who,) = select(["mujoco/default"])
    found = run_hard((Cell("fast_flight[speed=1e+11]", "nc", who.name, "minimal", "1/240"), who))
    assert found["state"] == "diverged"


def test_a_world_put_back_to_its_start_has_diverged():
    found = verdicts(fakes.PutBack, "fast_flight[speed=10]")
    assert (found["state"], found["reason"]) == (
        "diverged",
        "the whole world jumped back to its start at t = 0.416667 s",
    )


def test_round_off_to_and_fro_is_no_jump():
    """A body that position corrections push by an ulp returns exactly, at rest: that is no reset, a metre is."""
    times = np.arange(6) / 240
    for away, found in ((2.0**-52, None), (1.0, times[2])):
        places = np.array([1.0, 1.0 + away] * 3)[:, None, None] * np.ones(3)
        assert put_back(Trajectory(times, places, np.zeros((6, 1, 3))), 1.0) == found


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
    assert seen == [(2, 6), (3, 6), (4, 6), (5, 6), (6, 6)]
    assert lines.read_text().startswith(stored)
    assert [cell["case"] for cell in whole["cells"]] == [cell.case for cell, _ in entries]
    assert {cell["state"] for cell in whole["cells"]} == {"survived"}
    assert len(Journal(lines, json.loads(lines.read_text().splitlines()[0])).cells) == 6
    assert Journal(lines, {"impactbench": "another"}).cells == {}


def test_what_readers_see(tmp_path):
    """Survived, failed with its criterion and time, diverged: told apart in the terminal and on the page."""
    entries = plan(
        catalogue.select(["fast_flight[speed=10]"]), [fake(fakes.Truthful), fake(fakes.Slow)], policies=False
    )
    document = run(entries, tmp_path, 1, "hard", lambda *_: None)
    text = hard_view.terminal_table(document)
    assert re.search(r"fast_flight\[speed=10\]  ok +speed 0.0042 s", text)
    template = page.environment().get_template("hard.html")
    html = template.render(view=hard_view.view(json.loads(json.dumps(document))))
    assert '<td class="met">survived' in html
    assert '<td class="missed">speed 0.05 at 0.0042 s' in html
    assert "no force acts: v is constant" in html
    assert "10 m/s after one step" in html


@pytest.mark.parametrize("name", sorted(hard.HARD))
def test_a_family_describes_every_criterion_its_cases_are_judged_by(name):
    described = {criterion["name"] for criterion in describe_family(name)["criteria"]}
    asked = {
        c for values in hard.HARD[name].values for c in describe_case(hard.HARD[name].make(**values).scene)["criteria"]
    }
    assert asked <= described
