"""The hard families: their cases are found by name only, and every criterion of survival can fail."""

import pytest
from impactbench.scenarios import catalogue, hard
from impactbench.scenarios.catalogue import UnknownCase

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
