"""`impactbench check`, `explain` and `baseline`: physics against budgets, with exit codes for CI."""

from __future__ import annotations

import math
import os
import shlex
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from impactbench.reports.options import cases_of, contestants_of, progress_bar, steps_of

if TYPE_CHECKING:
    from impactbench.reports.gate import Finding, Selection
    from impactbench.reports.verdicts import Verdict
    from impactbench.scenarios.records import Law

ENGINE_HELP = "An engine (mujoco), a contestant (mujoco/tuned), a glob, or FILE.py:Class for your own. Repeatable."
FILE = click.Path(path_type=Path, dir_okay=False)
F = TypeVar("F", bound=Callable[..., Any])


def selection_options(command: F) -> F:
    """What is run: the same words for `check` and `baseline accept`."""
    for option in reversed(
        (
            click.argument("cases", nargs=-1, metavar="[CASE ...]"),
            click.option("--engine", "engines", multiple=True, help=ENGINE_HELP),
            click.option(
                "--profile", type=click.Choice(["default", "tuned", "both"]), default="tuned", show_default=True
            ),
            click.option("--law", type=click.Choice(["doc", "nc"]), help="Law of the reference. Default: doc."),
            click.option(
                "--step", "steps", multiple=True, callback=steps_of, help="Step [s], repeatable. Default: 1/240."
            ),
            click.option(
                "--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Cells run at once. Default: cores."
            ),
        )
    ):
        command = option(command)
    return command


@click.command()
@selection_options
@click.option("--only", "names", multiple=True, metavar="CHECK", help="Judge by this check alone. Repeatable.")
@click.option("--until", type=click.FloatRange(0, min_open=True), help="End runs at this time [s].")
@click.option("--budgets", type=FILE, help="TOML file of budgets that differ from the derived ones.")
@click.option("--baseline", type=FILE, help="Compare with what was accepted; see `impactbench baseline`.")
@click.option("--junit", type=FILE, help="Write verdicts and figures as a JUnit file.")
@click.option("--summary", type=FILE, help="Append a Markdown summary, for $GITHUB_STEP_SUMMARY; below 200 kB.")
@click.option("--failures", type=FILE, help="Script that repeats each failure. Default: failures.sh beside --junit.")
@click.option("--annotations", is_flag=True, help="Print GitHub annotations; on by itself inside GitHub Actions.")
@click.option("--margins", is_flag=True, help="Per check: the worst figure next to its budget, by contestant.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Write results.json and report.html.")
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON.")
def check(
    cases: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    law: Law | None,
    steps: tuple[str, ...],
    jobs: int,
    names: tuple[str, ...],
    until: float | None,
    budgets: Path | None,
    baseline: Path | None,
    **outputs: Any,
) -> None:
    """Judge momentum, energy, penetration, restitution, friction and rest against budgets.

    CASE is a family, a case, a glob or a scene file; none means all. Exit codes: 0 all passed, 1 a check failed,
    2 wrong usage or configuration, 3 something could not be measured, 4 no baseline, 5 nothing was judged.
    """
    selection = _selection(cases, engines, profile, law, steps, jobs, names, until, budgets, baseline)
    _must_be_writable(outputs)
    _measures_must_be_right()

    from impactbench.reports import gate
    from impactbench.reports.verdicts import exit_code

    with progress_bar() as progress:
        document, verdicts = gate.check_cells(selection, shlex.join(["impactbench", *sys.argv[1:]]), progress)
    if baseline is not None:
        verdicts += _against(baseline, document, selection)
    code = exit_code(verdicts, [c.name for c in selection.contestants] if engines else ())
    findings = gate.look_into(selection, verdicts) if code else []
    _tell(document, verdicts, findings, code, outputs)
    sys.exit(code)


def _selection(
    cases: Sequence[str],
    engines: Sequence[str],
    profile: str,
    law: Law | None,
    steps: Sequence[str],
    jobs: int,
    names: Sequence[str] = (),
    until: float | None = None,
    budgets: Path | None = None,
    baseline: Path | None = None,
) -> Selection:
    chosen, contestants = cases_of(cases), contestants_of(engines, profile)

    from impactbench.reports.budget_file import BudgetError, read_budgets
    from impactbench.reports.budgets import CHECKS, check_named
    from impactbench.reports.gate import STEPS, Selection
    from impactbench.scenarios.scene_file import is_scene_file

    try:
        checks = [check_named(name) for name in dict.fromkeys(names)] or CHECKS
        overrides = read_budgets(budgets)
    except BudgetError as error:
        raise click.UsageError(str(error)) from None
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    files = {cases_of([name])[0].scene.name: name for name in cases if is_scene_file(name)}
    options = ["--budgets", str(budgets)] if budgets else []
    return Selection(
        chosen, contestants, steps or STEPS, law, checks, overrides, until or math.inf, jobs, options, files,
        str(baseline) if baseline else "",
    )  # fmt: skip


def _must_be_writable(outputs: Mapping[str, Any]) -> None:
    """Before anything is run: a folder that cannot be written costs no minutes."""
    from impactbench.reports.options import writable_folder

    for name in ("junit", "summary", "failures", "file"):
        path: Path | None = outputs.get(name)
        if path:
            try:
                with tempfile.NamedTemporaryFile(dir=path.parent):
                    pass
            except OSError as error:
                option = "" if name == "file" else f"--{name} "
                raise click.UsageError(f"cannot write {option}{path}: {error.strerror}") from None
    if outputs.get("summary"):
        _earlier(outputs["summary"])
    if outputs.get("out"):
        writable_folder(outputs["out"])


def _measures_must_be_right() -> None:
    from impactbench.reports import calibration
    from impactbench.reports.verdicts import INCOMPLETE

    if wrong := calibration.faults():
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        click.echo(f"the measures are not right: {wrong[0]}{more}; nothing was judged", err=True)
        sys.exit(INCOMPLETE)


def _against(path: Path, document: dict[str, Any], selection: Selection) -> list[Verdict]:
    from impactbench.reports import baseline

    try:
        return baseline.compare(baseline.read(path), document, selection.cases)
    except baseline.NotComparable as why:
        return [baseline.missing(str(why))]


def _tell(
    document: dict[str, Any], verdicts: list[Verdict], findings: list[Finding], code: int, outputs: Mapping[str, Any]
) -> None:
    from impactbench.reports import ci_text, verdict_text

    if outputs["as_json"]:
        import json

        told = verdict_text.as_json(verdicts, document, code, findings)
        click.echo(json.dumps(told, indent=1, allow_nan=False))
    else:
        click.echo(verdict_text.text(verdicts, findings))
        if outputs["margins"]:
            click.echo("\n" + verdict_text.margins(verdicts))
    if outputs["annotations"] or os.environ.get("GITHUB_ACTIONS") == "true":
        click.echo("\n".join(ci_text.workflow_commands(verdicts, findings)), err=outputs["as_json"])
    try:
        _write(document, verdicts, findings, code, outputs)
    except OSError as error:
        raise click.UsageError(f"cannot write {error.filename or 'an output'}: {error.strerror}") from None


def _write(
    document: dict[str, Any], verdicts: list[Verdict], findings: list[Finding], code: int, outputs: Mapping[str, Any]
) -> None:
    from impactbench.reports import ci_text, results

    junit, summary, failures = outputs["junit"], outputs["summary"], outputs["failures"]
    if junit:
        from impactbench.reports.junit import junit as junit_text

        results.write_text(junit, junit_text(verdicts, findings, document["provenance"]))
    if summary:
        text = ci_text.summary(verdicts, findings, document["provenance"], code)
        results.write_text(summary, _earlier(summary) + text)
    if failures is None and (junit or summary):
        failures = (junit or summary).parent / "failures.sh"
    if failures:
        results.write_text(failures, ci_text.script(findings))
    if outputs["out"]:
        from impactbench.reports import page

        results.save(document, outputs["out"] / "results.json")
        page.write_page(document, outputs["out"] / "report.html")


def _earlier(summary: Path) -> str:
    """What an earlier step wrote, to be kept: refused before anything is run where it is no text."""
    if not summary.exists():
        return ""
    try:
        return summary.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise click.UsageError(f"cannot append to --summary {summary}: it is not UTF-8 text") from None
    except OSError as error:
        raise click.UsageError(f"cannot append to --summary {summary}: {error.strerror}") from None


@click.command()
@click.argument("name", metavar="[CHECK]", required=False)
@click.option("--case", "case", help="Work the budget out for this case.")
@click.option("--step", "steps", multiple=True, callback=steps_of, help="At this step [s]. Default: 1/240.")
def explain(name: str | None, case: str | None, steps: tuple[str, ...]) -> None:
    """Say what CHECK measures, which budget it has and why; without CHECK list them all."""
    from impactbench.reports import budgets, explanation

    try:
        chosen = budgets.check_named(name) if name else None
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if chosen is None:
        click.echo(explanation.listed())
        return
    click.echo(explanation.text(chosen, cases_of([case] if case else []), steps or ("1/240",), bool(case)))


@click.group()
def baseline() -> None:
    """Accept what is measured now as what later checks compare with."""


@baseline.command()
@click.argument("file", type=FILE)
@selection_options
@click.option("--reason", required=True, help="Why this is right; kept in the file's history.")
def accept(
    file: Path,
    cases: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    law: Law | None,
    steps: tuple[str, ...],
    jobs: int,
    reason: str,
) -> None:
    """Run the selection and write its outcomes and figures to FILE, old and new with versions and reason.

    Cells of FILE that are not run stay. Exit code 3: something could not be measured, and FILE is as it was.
    """
    selection = _selection(cases, engines, profile, law, steps, jobs)
    if not reason.strip():
        raise click.UsageError("--reason is empty: say why these figures are right")
    _must_be_writable({"file": file})
    _measures_must_be_right()

    from impactbench.reports import baseline as baselines
    from impactbench.reports import gate
    from impactbench.reports.verdict_text import line
    from impactbench.reports.verdicts import INCOMPLETE

    with progress_bar() as progress:
        document, verdicts = gate.check_cells(selection, shlex.join(["impactbench", *sys.argv[1:]]), progress)
    broken = [verdict for verdict in verdicts if verdict.status == "error"]
    if broken or not any(cell["state"] == "ok" for cell in document["cells"]):
        click.echo("\n".join(line(verdict) for verdict in broken) or "nothing was measured")
        click.echo(f"{file} is as it was", err=True)
        sys.exit(INCOMPLETE)
    try:
        changed = baselines.accept(file, document, selection.cases, " ".join(reason.split()))
    except (baselines.NotComparable, OSError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise click.UsageError(f"cannot write {file}: {why}") from None
    click.echo("\n".join([change.line() for change in changed] or ["nothing changed"]))
    click.echo(f"{file}: {len(document['cells'])} cells accepted")
