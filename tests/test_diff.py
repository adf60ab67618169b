"""Two results compared: each verdict on a document with one known change, and its renderings."""

from __future__ import annotations

import copy
import json
import re
import textwrap
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from impactbench.reports import diff, diff_page, diff_text, results, summary
from impactbench.reports.cli_report import diff as command
from impactbench.reports.cli_report import report
from impactbench.reports.diff import BETTER, SAME, UNKNOWN, WORSE
from impactbench.reports.terminal import plain
from impactbench.reports.terminal import summary as terminal_summary
from test_page import HOSTILE, Maker, Outline, case, document, small

NASTY = (
    HOSTILE,
    "a|b`c*d_e[f](http://g.test)",
    "\u202eright to left \u05d0\u05d1",
    "'\"&{{ 7*7 }}\nnew line",
    "x" * 200,
)


def one(error: float, wall: float = 1e-3, **changes: Any) -> dict[str, Any]:
    """A document of one cell."""
    maker = Maker()
    times = {"wall_time": wall, "wall_time_low": 0.9 * wall, "wall_time_high": 1.1 * wall}
    maker.cell("a", "x/y", 60, {"position_error": error, **times}, **changes)
    return document(maker, [case("a", "a")])


def verdicts(before: dict[str, Any], after: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Verdict and reason by measure."""
    return {change.measure: (change.verdict, change.why) for change in diff.compare(before, after).changes}


def test_a_run_against_itself_changes_nothing() -> None:
    found = diff.compare(small(), small())
    assert found.counts() == {WORSE: 0, BETTER: 0, UNKNOWN: 0, SAME: len(found.changes)}
    assert len(found.changes) > 5


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        (0.01, 0.02, WORSE),
        (0.02, 0.01, BETTER),
        (0.02, -0.01, BETTER),  # the size counts, not the sign
        (0.01, 0.01 + 1.5e-12, SAME),  # two figures good to 1e-12 each
        (0.01, 0.01 + 2.5e-12, WORSE),
        (0.0, 1.5e-12, SAME),
    ],
)
def test_errors_differ_beyond_twice_round_off(before: float, after: float, verdict: str) -> None:
    assert verdicts(one(before), one(after))["position_error"][0] == verdict


@pytest.mark.parametrize(("factor", "verdict"), [(1.0, SAME), (1.2, SAME), (1.25, WORSE), (0.8, BETTER), (0.85, SAME)])
def test_times_differ_where_their_intervals_do_not_overlap(factor: float, verdict: str) -> None:
    # [0.9, 1.1] against [0.9, 1.1] * factor: apart above 1.1 / 0.9 = 1.222 and below 0.9 / 1.1 = 0.818
    assert verdicts(one(0.01), one(0.01, factor * 1e-3))["wall_time"][0] == verdict


def test_any_step_that_gets_worse_makes_the_figure_worse_and_the_largest_change_stands_for_it() -> None:
    def ladder(errors: dict[int, float]) -> dict[str, Any]:
        maker = Maker()
        for rung, error in errors.items():
            maker.cell("a", "x/y", rung, {"position_error": error})
        return document(maker, [case("a", "a")])

    (change,) = diff.compare(ladder({30: 0.4, 60: 0.2, 120: 0.1}), ladder({30: 0.1, 60: 0.25, 120: 0.2})).changes
    assert (change.verdict, change.step, change.before, change.after, change.steps) == (WORSE, "1/120", 0.1, 0.2, 2)
    assert change.why == "better at 1 of 3 steps"


def changed(key: str, value: Any) -> dict[str, Any]:
    found = one(0.02)
    found["provenance"][key] = value
    return found


def test_what_cannot_be_compared_says_why() -> None:
    other_machine = verdicts(one(0.01), changed("processor", "another"))
    assert other_machine["wall_time"] == (UNKNOWN, "times of another machine (processor)")
    assert other_machine["position_error"][0] == WORSE
    version = verdicts(one(0.01), changed("impactbench", "0.2.0"))["state"]
    assert version == (UNKNOWN, "other version of impactbench (0.1.0, 0.2.0)")
    assert verdicts(one(0.01, law="nc"), one(0.02, law="doc"))["state"] == (UNKNOWN, "other law (doc, nc)")
    assert verdicts(one(0.01), one(0.02, model="full"))["state"] == (UNKNOWN, "other model (full, minimal)")
    assert verdicts(one(0.01), one(0.02, phase=0.5))["state"] == (UNKNOWN, "other impact phases")
    assert verdicts(one(0.01), one(0.02, step_text="1/61"))["state"] == (UNKNOWN, "not measured after")
    longer = one(0.02)
    longer["cases"][0]["duration"] = 2.0
    assert verdicts(one(0.01), longer)["state"] == (UNKNOWN, "the case is defined otherwise (duration)")
    less = one(0.02)
    less["rows"] = [row for row in less["rows"] if row["measure"] != "position_error"]
    assert verdicts(one(0.01), less)["position_error"] == (UNKNOWN, "no position_error after")


def test_a_run_that_breaks_is_worse_and_one_that_is_mended_better() -> None:
    broken = one(0.01, state="crashed", reason="signal 11")
    assert verdicts(one(0.01), broken)["state"] == (WORSE, "ok before, crashed after: signal 11")
    assert verdicts(broken, one(0.01))["state"] == (BETTER, "crashed before, ok after")
    gone = one(0.01, state="unavailable", reason="not installed")
    assert verdicts(one(0.01), gone)["state"] == (UNKNOWN, "ok before, unavailable after: not installed")
    assert verdicts(broken, copy.deepcopy(broken)) == {}


def test_an_engine_of_another_version_is_compared_and_named() -> None:
    found = diff.compare(one(0.01), changed("versions", {"engine": "1.1"}))
    assert found.notes == ["engine 1.0 before, 1.1 after"]
    assert found.of(WORSE)


@pytest.mark.parametrize("name", NASTY)
def test_hostile_names_are_text_in_the_page_and_in_markdown(name: str) -> None:
    def run(error: float) -> dict[str, Any]:
        maker = Maker()
        maker.ladder(name, f"{name}/default", error, 1e-4)
        maker.cell(name, name, 60, {}, state="crashed" if error > 0.1 else "ok", reason=name)
        return document(maker, [case(name, name, question=name)])

    found = diff.compare(run(0.1), run(0.2))
    outline = Outline(diff_page.render(found))
    assert name in outline.text
    assert not {tag for tag, _ in outline.tags} & {"img", "script"}
    for text in (diff_text.markdown(found), summary.markdown(run(0.2))):
        text = re.sub(r"(?<!\\)(`+)[^`].*?(?<!`)\1(?!`)", "", text)  # code spans hold text by themselves
        assert "<img" not in text
        assert not re.search(r"(?<!\\)\]\(", text)
        assert "http://" not in text
        cells = [line.replace("\\|", "").count("|") for line in text.splitlines() if line.startswith("| ")]
        assert set(cells) <= {9, 4, 6}, text  # no name adds a column
    assert "\n" not in diff_text.row(found.changes[0])[0]


@pytest.mark.parametrize("name", [*NASTY, "[red]a[/red]", "\x1b[31mred\x1b]0;title\x07", "a\rb\nc"])
def test_hostile_names_are_text_in_a_terminal(name: str) -> None:
    """No colour, no markup of the library that draws the tables, no line or direction of their own."""

    def run(error: float) -> dict[str, Any]:
        maker = Maker()
        maker.cell(name, f"{name}/default", 60, {"position_error": error, "energy_gain": error, "wall_time": 1e-3})
        return document(maker, [case(name, name)])

    shown = plain(name)
    for text in (
        diff_text.terminal(diff.compare(run(0.1), run(0.2))),
        "\n".join(summary.verdict_lines(run(0.2))),
        terminal_summary(run(0.2)),
    ):
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202a-\u202e]", text)
        assert shown in text.replace("\n", "") or all(part in text for part in textwrap.wrap(shown, 20))


def save(folder: Path, found: dict[str, Any]) -> Path:
    folder.mkdir(exist_ok=True)
    results.save(found, folder / "results.json")
    return folder


def test_the_commands_write_what_they_say(tmp_path: Path) -> None:
    a, b = save(tmp_path / "a", one(0.01)), save(tmp_path / "b", one(0.02))
    run = CliRunner().invoke(command, [str(a), str(b / "results.json"), "--out", str(tmp_path / "d.html")])
    assert run.exit_code == 0
    assert "✕ Worse: 1 figure: most x/y in a: position error 1 % → 2 % at 1/60 s." in run.output
    assert "position error 1 % → 2 %" in Outline((tmp_path / "d.html").read_text(encoding="utf-8")).text
    run = CliRunner().invoke(command, [str(a), str(b), "--json"])
    assert json.loads(run.output)["counts"] == {WORSE: 1, BETTER: 0, UNKNOWN: 0, SAME: 1}
    run = CliRunner().invoke(command, [str(a), str(b), "--markdown", "-"])
    assert run.output.startswith("# impactbench: before and after")
    run = CliRunner().invoke(report, [str(b), "--markdown", str(tmp_path / "s.md")])
    assert run.exit_code == 0
    assert "## Time to 1 % error" in (tmp_path / "s.md").read_text(encoding="utf-8")
    assert (b / "report.html").exists()


@pytest.mark.parametrize("where", ["nowhere", "."])
def test_results_that_are_not_there_are_the_users_mistake(where: str, tmp_path: Path) -> None:
    a = save(tmp_path / "a", one(0.01))
    run = CliRunner().invoke(command, [str(a), str(tmp_path / where)])
    assert run.exit_code == 2
    assert "impactbench compare" in run.output
