"""`impactbench limits`: where the hard families break."""

from __future__ import annotations

import os
from pathlib import Path

import click
from impactbench.reports.options import contestants_of, progress_bar, publish, writable_folder


@click.command()
@click.argument("names", nargs=-1, metavar="[FAMILY ...]")
@click.option(
    "--engine", "engines", multiple=True, help="An engine, a contestant, a glob or FILE.py:Class. Repeatable."
)
@click.option("--profile", type=click.Choice(["default", "tuned", "both"]), default="both", show_default=True)
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True)
@click.option("--budget", type=click.FloatRange(0.1), help="Seconds of runs per search. Default: 120, with --full 900.")
@click.option("--full", is_flag=True, help="A denser sweep, and brackets of 1 % instead of 2 %.")
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Runs at once. Default: cores.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def limits(
    names: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    out: Path,
    budget: float | None,
    full: bool,
    jobs: int,
    as_json: bool,
) -> None:
    """Find the height, ratio, speed or step at which each contestant ceases to satisfy the truth of a hard family.

    A sweep shows whether survival is monotone, bisection finds the point. Without --engine, settings that are meant to
    mend a family are tried too. Finished runs are kept in OUT, so that a
    search that was stopped goes on. Writes OUT/limits.json, and the report where OUT/results.json stands. Exit code 3:
    nothing was measured.
    """
    contestants, folder = contestants_of(engines, profile), writable_folder(out)

    from dataclasses import replace

    from impactbench.reports import limits as search
    from impactbench.reports import results
    from impactbench.reports.limits_view import text
    from impactbench.reports.probe_store import ProbeStore

    try:
        chosen = search.families(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    effort = search.FULL if full else search.QUICK
    effort = effort if budget is None else replace(effort, budget=budget)
    try:
        with progress_bar() as progress:
            store = ProbeStore(folder / "limits.probes.jsonl")
            part = search.hunt(chosen, contestants, effort, jobs, store, progress, policies=not engines)
    except results.ResultsError as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        raise click.UsageError(f"cannot write to {folder}: {error.strerror}") from None
    publish(folder, "limits", part, as_json, text)
    if all(each["status"] == "unknown" for each in part["searches"]):
        raise click.exceptions.Exit(3)
