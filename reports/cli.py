"""The command line. Heavy packages are imported only by the command that needs them, so that help answers at once."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from impactbench.reports.cli_bench import bench
from impactbench.reports.cli_check import baseline, check, explain
from impactbench.reports.cli_hard import hard
from impactbench.reports.cli_limits import limits
from impactbench.reports.cli_metamorphic import metamorphic
from impactbench.reports.cli_predictability import predictability
from impactbench.reports.cli_report import diff, report
from impactbench.reports.cli_routes import routes
from impactbench.reports.cli_sweep import Sweep, export, sweep_options
from impactbench.reports.options import OneLineErrors, cases_of, contestants_of, progress_bar, steps_of, writable_folder

if TYPE_CHECKING:
    from impactbench.scenarios.records import Law

NOTHING_MEASURED = 3
STEP_HELP = "Step [s], 1/240 or 0.004. Repeatable. Default: 1/30 ... 1/960."
PHASES_HELP = "Impact phases tried per step in the cases that are timed; the worst one counts."
TIMING_HELP = "Time a case of each of six families, every case, or none."
ENGINE_HELP = (
    "An engine (mujoco), a contestant (mujoco/tuned), one with settings (mujoco/tuned:iterations=20), a glob, a file "
    "of policies (FILE.toml), or FILE.py:Class for your own. Repeatable."
)
PROFILES = ["default", "tuned", "both", "all"]
PROFILE_HELP = "`all` adds every policy of `list engines`."


@click.group(cls=OneLineErrors, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="impactbench")
def main() -> None:
    """Compare rigid-body engines on contact scenes with known truth: momentum, energy, penetration, speed against
    error.
    """


@main.command()
@click.argument("cases", nargs=-1, metavar="[CASE ...]")
@click.option("--engine", "engines", multiple=True, help=ENGINE_HELP)
@click.option("--profile", type=click.Choice(PROFILES), default="both", show_default=True, help=PROFILE_HELP)
@click.option("--law", type=click.Choice(["doc", "nc"]), help="Law of the reference; engines realise nc. Default: doc.")
@click.option("--step", "steps", multiple=True, callback=steps_of, help=STEP_HELP)
@click.option("--model", type=click.Choice(["minimal", "full", "both"]), default="minimal", show_default=True)
@click.option(
    "--timing", type=click.Choice(["some", "all", "none"]), default="some", show_default=True, help=TIMING_HELP
)
@click.option("--phases", type=click.IntRange(1, 64), default=3, show_default=True, help=PHASES_HELP)
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True)
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Cells run at once. Default: cores.")
@click.option("--replay/--no-replay", default=True, help="Record a case of each family for the report's replay.")
@sweep_options
def compare(
    cases: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    law: Law | None,
    steps: tuple[str, ...],
    model: str,
    timing: str,
    phases: int,
    out: Path,
    jobs: int,
    replay: bool,
    sweep: Sweep,
) -> None:
    """Run scenarios on all contestants and write OUT/results.json and OUT/report.html.

    CASE is a family (equal_masses), a case (equal_masses[bounciness=0.5]) or a glob; none means all. Exit code 3:
    nothing was measured.
    """
    chosen, contestants, folder = cases_of(cases), contestants_of(engines, profile), writable_folder(out)

    from impactbench.reports.compare import LADDER, Plan

    models = ("minimal", "full") if model == "both" else (model,)
    shifts = tuple(k / phases for k in range(phases))
    timing = "all" if sweep.full else timing
    plan = Plan(chosen, contestants, steps or LADDER, law, models, shifts, jobs, timing, replay)
    document = sweep.run(plan, shlex.join(["impactbench", *sys.argv[1:]]), folder)
    if timing == "all":
        from impactbench.reports import time_to_error
        from impactbench.reports.page_view import View

        document["time_to_error"] = time_to_error.rows(View(document))
    _write(document, folder)
    from impactbench.reports.summary import verdict_lines
    from impactbench.reports.terminal import summary

    click.echo(summary(document))
    if timing == "all":
        click.echo("\n" + time_to_error.text(document["time_to_error"]))
    click.echo("\n" + "\n".join(verdict_lines(document)))
    click.echo(f"report: {folder / 'report.html'}")
    if not any(cell["state"] == "ok" for cell in document["cells"]):
        sys.exit(NOTHING_MEASURED)


def _write(document: dict[str, Any], folder: Path) -> None:
    from impactbench.reports import page, results, sections

    try:
        document = sections.with_sections(document, folder)
        results.save(document, folder / "results.json")
        page.write_page(document, folder / "report.html")
    except results.ResultsError as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        message = f"cannot write to {folder}: {error.strerror}; earlier files there are untouched"
        raise click.UsageError(message) from None


@main.command()
@click.argument("case")
@click.option("--engine", required=True, help="One contestant: mujoco (with --profile), mujoco/tuned or FILE.py:Class.")
@click.option("--step", "steps", required=True, multiple=True, callback=steps_of, help="Step [s], 1/240 or 0.004.")
@click.option("--profile", type=click.Choice(["default", "tuned"]), default="tuned", show_default=True)
@click.option("--law", type=click.Choice(["doc", "nc"]), help="Law of the reference; engines realise nc. Default: doc.")
@click.option("--model", type=click.Choice(["minimal", "full"]), default="minimal", show_default=True)
@click.option(
    "--phase", type=click.FloatRange(0, 1), default=0.0, show_default=True, help="Start this part of a step earlier."
)
@click.option("--json", "as_json", is_flag=True, help="Print the cell as JSON.")
def run(
    case: str,
    engine: str,
    steps: tuple[str, ...],
    profile: str,
    law: Law | None,
    model: str,
    phase: float,
    as_json: bool,
) -> None:
    """Run one cell and print all its measures. Exit code 3: it could not be measured."""
    chosen, contestants = cases_of([case]), contestants_of([engine], profile)
    if len(chosen) != 1 or len(contestants) != 1 or len(steps) != 1:
        names = [c.scene.name for c in chosen] if len(chosen) != 1 else [c.name for c in contestants]
        got = f"{len(chosen)} cases, {len(contestants)} contestants, {len(steps)} steps ({', '.join(names[:4])}, ...)"
        raise click.UsageError(f"run takes one case, one contestant and one step; got {got}")
    if phase and not chosen[0].scene.phase_free:
        raise click.UsageError(f"{chosen[0].scene.name}: bodies touch at t = 0, so that --phase must be 0")

    from impactbench.reports.compare import Plan
    from impactbench.reports.compare import compare as run_comparison
    from impactbench.reports.terminal import cell_table

    plan = Plan(chosen, contestants, steps, law, (model,), (phase,), timing="all")
    document = run_comparison(plan, shlex.join(["impactbench", *sys.argv[1:]]))
    if as_json:
        import json

        click.echo(json.dumps(document, indent=1, allow_nan=False))
    else:
        click.echo(cell_table(document))
    if document["cells"][0]["state"] != "ok":
        sys.exit(NOTHING_MEASURED)


@main.command()
@click.argument("case")
@click.option("--error", "text", default="1%", show_default=True, help="Largest error allowed: 1% or 0.01.")
@click.option("--engine", "engines", multiple=True, help=ENGINE_HELP)
@click.option("--profile", type=click.Choice(PROFILES), default="both", show_default=True, help=PROFILE_HELP)
@click.option("--step", "steps", multiple=True, callback=steps_of, help=STEP_HELP)
@click.option(
    "--phases", type=click.IntRange(1, 64), default=8, show_default=True, help="Impact phases tried per step."
)
def advise(case: str, text: str, engines: tuple[str, ...], profile: str, steps: tuple[str, ...], phases: int) -> None:
    """Say which step each contestant may take on CASE to stay below an error, and what it costs."""
    chosen, contestants = cases_of([case]), contestants_of(engines, profile)
    if len(chosen) != 1:
        raise click.UsageError(f"advise takes one case; {case} is {', '.join(c.scene.name for c in chosen)}")

    from impactbench.reports.advise import advice, target_of
    from impactbench.reports.compare import LADDER, Plan
    from impactbench.reports.compare import compare as run_comparison

    try:
        target = target_of(text)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    shifts = tuple(k / phases for k in range(phases))
    plan = Plan(chosen, contestants, steps or LADDER, phases=shifts, jobs=os.cpu_count() or 1, timing="all")
    with progress_bar() as progress:
        document = run_comparison(plan, shlex.join(["impactbench", *sys.argv[1:]]), progress)
    click.echo(advice(document, target))
    if not any(cell["state"] == "ok" for cell in document["cells"]):
        sys.exit(NOTHING_MEASURED)


@main.command()
@click.argument("engine")
def conform(engine: str) -> None:
    """Try ENGINE against the engine contract, point by point.

    ENGINE is an engine (mujoco), a contestant (mujoco/tuned), FILE.py:Class or an installed engine's name. Exit code 1:
    a point fails; 3: an engine could not be run.
    """
    contestants = contestants_of([engine], "both")

    from impactbench.reports import conform as contract

    verdicts = contract.conform(contestants)
    click.echo("\n".join(contract.lines(verdicts)))
    sys.exit(contract.exit_code(verdicts))


@main.command()
@click.argument("case")
def show(case: str) -> None:
    """Show a case: bodies, coefficients, truth, scales and a sketch of the start."""
    chosen = cases_of([case])
    if len(chosen) != 1:
        names = [c.scene.name for c in chosen]
        raise click.UsageError(f"show takes one case; {case} is {len(names)}: {', '.join(names)}")

    from impactbench.reports.picture import describe

    click.echo(describe(chosen[0]))


@main.command()
@click.argument("names", nargs=-1, metavar="[NAME ...]")
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Runs at once. Default: cores.")
@click.option("--json", "as_json", is_flag=True, help="Print the rows as JSON.")
def reproduce(names: tuple[str, ...], jobs: int, as_json: bool) -> None:
    """Reproduce figures that others published of engines, through the ordinary adapters.

    NAME is a benchmark (bouncing), its project (SimBenchmark), an engine or contestant (mujoco/rk4) or a glob; none
    means all. Exit code 1: a figure disagrees; 3: one could not be measured.
    """
    from impactbench.reports import reproduce as reproduction

    try:
        entries = reproduction.plan(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    with progress_bar() as progress:
        rows = reproduction.reproduce(entries, jobs, progress)
    if as_json:
        import json

        click.echo(json.dumps(reproduction.as_json(rows), indent=1, allow_nan=False))
    else:
        click.echo(reproduction.text(rows))
    sys.exit(reproduction.exit_code(rows))


@main.command("list")
@click.argument("what", type=click.Choice(["scenarios", "engines", "all"]), default="all")
@click.option("--pair-laws", is_flag=True, help="Measure how each engine combines the coefficients of two surfaces.")
def list_(what: str, pair_laws: bool) -> None:
    """List scenarios and engines, with what is available here."""
    if pair_laws and what == "scenarios":
        raise click.UsageError("--pair-laws is about engines: list engines --pair-laws")

    from impactbench.reports import terminal

    parts: dict[str, Callable[[], str]] = {
        "scenarios": lambda: terminal.scenario_table() + "\n" + terminal.hard_table(),
        "engines": terminal.engine_table,
    }
    click.echo("\n".join(parts[name]() for name in parts if what in (name, "all")))
    if pair_laws:
        from impactbench.reports.pair_laws import measured_laws

        click.echo("\n" + terminal.pair_law_table(measured_laws()))


main.add_command(baseline)
main.add_command(check)
main.add_command(explain)
main.add_command(limits)
main.add_command(metamorphic)
main.add_command(predictability)
main.add_command(routes)
main.add_command(export)
main.add_command(report)
main.add_command(diff)
main.add_command(hard)
main.add_command(bench)


if __name__ == "__main__":
    main()
