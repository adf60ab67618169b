"""Budgets: their derivations, files of others, and what the texts for CI keep to."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from impactbench.reports import ci_text, explanation
from impactbench.reports.budget_file import BudgetError, known_limits, overriding, read_budgets
from impactbench.reports.budget_formulas import EPSILON, Setting
from impactbench.reports.budgets import CHECKS, check_named
from impactbench.reports.gate import Finding
from impactbench.reports.verdicts import Verdict, judge
from impactbench.scenarios.catalogue import all_cases, select

PROVENANCE = {"versions": {"mine": "1.0"}, "impactbench": "0.1.0", "python": "3.11"}


def budget(check: str, case: str, step: float = 1 / 240) -> float:
    (found,) = select([case])
    return check_named(check).budget(Setting(found, "nc", step))


def test_budgets_are_what_their_derivations_say() -> None:
    """Worked by hand from the scenes: 3 m/s at a ball at rest, equal masses, L = 3 m, T = 1 s, E = 4.5 J."""
    h = 1 / 240
    round_off = 100 * 240 * EPSILON
    assert budget("momentum", "equal_masses[bounciness=0.5]") == pytest.approx(round_off)
    assert budget("penetration", "equal_masses[bounciness=0.5]") == pytest.approx(3 * h / 3 + round_off)
    # e = 0.5 changes each ball's velocity by (1 + e)/2 * 3 m/s.
    assert budget("position", "equal_masses[bounciness=0.5]") == pytest.approx(2.25 * h / 3 + round_off)
    # A ball dropped from 1 m arrives with sqrt(2 g) and is at most that times h too low: m g v h of m g * 1 m.
    arrival = math.sqrt(2 * 9.81)
    assert budget("energy-gain", "bouncing_ball[bounciness=1]") == pytest.approx(arrival * h + 3 * round_off)
    # Three boxes of a column may each rest g h^2 too deep; L = 0.15 m, T = 1.5 s.
    deep = 3 * 9.81 * h**2 / 0.15
    assert budget("rest-heights", "stacked_drop[shape=box,count=3]") == pytest.approx(deep + 1.5 * round_off)
    # A slide at 3 m/s for 1.5 s: L = 4.5 m.
    assert budget("friction", "coulomb_slide[heading=45]") == pytest.approx(
        (3 * h + 9.81 * h**2) / 4.5 + 1.5 * round_off
    )


def test_no_budget_lies_below_a_hundred_round_offs() -> None:
    """One round-off a step for what is summed over steps, eight for the one impact of which e is a ratio."""
    for case in all_cases():
        for law in case.scene.laws:
            for check in CHECKS:
                if not check.excused(case, law):
                    setting = Setting(case, law, 1 / 240)
                    once = check.name in ("restitution", "impact")
                    least = 100 * EPSILON * (8 if once else setting.steps)
                    assert check.budget(setting) >= least * (setting.step if check.unit == "s" else 1.0)


def test_explain_works_every_check_out() -> None:
    cases = all_cases()
    for check in CHECKS:
        text = explanation.text(check, cases, ["1/240"], every=False)
        assert check.formula in text
        assert text.count("1/240") >= 1, check.name
    assert f"{budget('penetration', 'equal_masses[bounciness=0.5]'):.3g}" in explanation.text(
        check_named("penetration"), select(["equal_masses[bounciness=0.5]"]), ["1/240"], every=True
    )


BROKEN = [
    ("check =", "is not TOML"),
    ('budgets = "none"', "unknown key 'budgets'"),
    ('known_limits = "no"', "known_limits is true or false"),
    ("budget = 1", r"\[\[budget\]\] tables"),
    ('[[budget]]\ncheck = "momentun"\nlimit = 1\nreason = "x"', "no check is named 'momentun'"),
    ('[[budget]]\ncheck = "momentum"\nlimit = 1', "a reason is missing"),
    ('[[budget]]\nreason = "x"', "not none"),
    ('[[budget]]\nlimit = 1\nfactor = 2\nreason = "x"', "not limit, factor"),
    ('[[budget]]\nlimit = nan\nreason = "x"', "at least 0"),
    ('[[budget]]\nlimit = -1\nreason = "x"', "at least 0"),
    ('[[budget]]\nlimit = "1"\nreason = "x"', "at least 0"),
    ('[[budget]]\nlimit = 1\nlimits = 1\nreason = "x"', "unknown key 'limits'"),
    ('[[budget]]\nlimit = 1\norder = 1\nreason = "x"', "order needs the step"),
    ('[[budget]]\nlimit = 1\nstep = "0"\nreason = "x"', "write it as 1/240"),
    ('[[budget]]\nlimit = 1\nengine = 3\nreason = "x"', "engine is a text or a list"),
]


@pytest.mark.parametrize(("text", "message"), BROKEN, ids=[message for _, message in BROKEN])
def test_a_broken_budget_file_says_what_is_wrong_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "budgets.toml"
    file.write_text(text)
    with pytest.raises(BudgetError, match=message) as raised:
        read_budgets(file)
    assert "\n" not in str(raised.value)


def test_the_last_entry_that_matches_wins_and_known_limits_may_be_left_out(tmp_path: Path) -> None:
    file = tmp_path / "budgets.toml"
    file.write_text(
        'known_limits = false\n[[budget]]\ncheck = "pen*"\nfactor = 2\nreason = "a"\n'
        '[[budget]]\ncheck = "penetration"\nengine = "mine"\ncase = ["equal_masses", "static_wall[bounciness=?]"]\n'
        'limit = 0.5\nstep = "1/240"\norder = 2\nreason = "b"\n'
    )
    entries = read_budgets(file)
    check, (case,) = check_named("penetration"), select(["equal_masses[bounciness=0.5]"])
    mine = overriding(entries, check, "mine/default", case.scene.name)
    other = overriding(entries, check, "other/default", case.scene.name)
    assert mine is not None
    assert mine.budget(check, Setting(case, "nc", 1 / 120)) == pytest.approx(2.0)
    assert other is not None
    setting = Setting(case, "nc", 1 / 120)
    assert other.budget(check, setting) == pytest.approx(2 * check.budget(setting))
    assert overriding(entries, check, "mine/default", "static_wall[bounciness=0.5]") is entries[0]
    assert overriding(entries, check_named("momentum"), "mujoco/tuned", case.scene.name) is None
    assert len(known_limits()) > 20


def test_an_entry_can_tighten_loosen_and_excuse() -> None:
    (case,) = select(["equal_masses[bounciness=0.5]"])
    (limit,) = (entry for entry in known_limits() if entry.check == ("momentum",))
    everywhere = replace(limit, engine=("*",))

    def status(value: float, **changes: object) -> str:
        entry = replace(everywhere, at_least=None, **changes)  # type: ignore[arg-type]
        verdicts = judge(case, "nc", "1/240", {"momentum_drift": value}, "mine/default", [entry])
        return next(verdict.status for verdict in verdicts if verdict.check == "momentum")

    assert status(1e-12, factor=1.0) == "passed"
    assert status(1e-12, limit=1e-13) == "failed"
    assert status(1e-9, limit=1e-8) == "passed"
    assert status(math.nan, limit=1.0) == "failed"
    assert status(1.0, off=True) == "excused"


def finding(number: int) -> Finding:
    verdict = Verdict(
        "momentum", f"case|{number}[a=1,b=<2>]", "nc", "mine/default", "minimal", "1/240", 0.0, "failed",
        "momentum_drift", 1.0, 1e-12,
    )  # fmt: skip
    return Finding(verdict, 3, f"impactbench check {number}", "", 0.25, ("A", "B"))


def test_a_summary_of_very_many_failures_stays_below_200_kb() -> None:
    findings = [finding(number) for number in range(3000)]
    verdicts = [found.verdict for found in findings]
    text = ci_text.summary(verdicts, findings, PROVENANCE, 1)
    assert 150_000 < len(text.encode()) < 200_000
    assert "more; the JUnit file has all of them" in text
    assert "0 passed, 3000 failed" in text
    short = ci_text.summary(verdicts[:1], findings[:1], PROVENANCE, 1)
    assert "case\\|0\\[a=1,b=\\<2\\>\\]" in short
    assert "first at t = 0.25 s; bodies A, B" in short


def test_annotations_are_nine_and_one_with_all_counts() -> None:
    findings = [finding(number) for number in range(12)]
    lines = ci_text.workflow_commands([found.verdict for found in findings], findings)
    assert len(lines) == 10
    assert lines[0].startswith("::error title=mine/default%3A momentum::case|0[a=1,b=<2>] at 1/240 s")
    assert lines[-1].endswith("3 more contestants and checks are not listed")
    assert all("\n" not in line for line in lines)
