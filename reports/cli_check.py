"""`impactbench check` and `impactbench explain`: physics against budgets, with exit codes for CI."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from impactbench.reports.options import cases_of, contestants_of, progress_bar, steps_of

if TYPE_CHECKING:
    from impactbench.scenarios.records import Law

ENGINE_HELP = "An engine (mujoco), a contestant (mujoco/tuned), a glob, or FILE.py:Class for your own. Repeatable."
FILE = click.Path(path_type=Path, dir_okay=False)


@click.command()
@click.argument("cases", nargs=-1, metavar="[CASE ...]")
@click.option("--engine", "engines", multiple=True, help=ENGINE_HELP)
@click.option("--profile", type=click.Choice(["default", "tuned", "both"]), default="tuned", show_default=True)
@click.option("--law", type=click.Choice(["doc", "nc"]), help="Law of the reference; engines realise nc. Default: doc.")
@click.option("--step", "steps", multiple=True, callback=steps_of, help="Step [s], repeatable. Default: 1/240.")
@click.option("--budgets", type=FILE, help="TOML file of budgets that differ from the derived ones.")
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Cells run at once. Default: cores.")
@click.option("--margins", is_flag=True, help="Per check: the worst figure next to its budget, by contestant.")
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON.")
def check(
    cases: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    law: Law | None,
    steps: tuple[str, ...],
    budgets: Path | None,
    jobs: int,
    margins: bool,
    as_json: bool,
) -> None:
    """Judge momentum, energy, penetration, restitution, friction and rest against budgets.

    CASE is a family, a case, a glob or a scene file; none means all. Exit codes: 0 all passed, 1 a check failed,
    2 wrong usage or configuration, 3 something could not be measured, 4 no baseline, 5 nothing was judged.
    """
    chosen, contestants, overrides = cases_of(cases), contestants_of(engines, profile), _overrides(budgets)

    from impactbench.reports import gate, verdict_text
    from impactbench.reports.verdicts import exit_code, judge_document

    command = shlex.join(["impactbench", *sys.argv[1:]])
    with progress_bar() as progress:
        document = gate.run_cells(chosen, contestants, steps, law, jobs, command, progress)
    verdicts = judge_document(document, chosen, overrides)
    code = exit_code(verdicts, [c.name for c in contestants] if engines else ())
    if as_json:
        import json

        click.echo(json.dumps(verdict_text.as_json(verdicts, document, code), indent=1, allow_nan=False))
    else:
        click.echo(verdict_text.text(verdicts))
        if margins:
            click.echo("\n" + verdict_text.margins(verdicts))
    sys.exit(code)


def _overrides(path: Path | None) -> Any:
    from impactbench.reports.budget_file import BudgetError, read_budgets

    try:
        return read_budgets(path)
    except BudgetError as error:
        raise click.UsageError(str(error)) from None


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
