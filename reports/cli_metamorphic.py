"""`impactbench metamorphic`: relations that any scene must keep, on any contestant."""

from __future__ import annotations

import os
from pathlib import Path

import click
from impactbench.reports.options import cases_of, contestants_of, progress_bar, publish, steps_of, writable_folder


@click.command()
@click.argument("cases", nargs=-1, metavar="[CASE ...]")
@click.option(
    "--engine", "engines", multiple=True, help="An engine, a contestant, a glob or FILE.py:Class. Repeatable."
)
@click.option("--profile", type=click.Choice(["default", "tuned", "both"]), default="both", show_default=True)
@click.option("--step", "steps", default=("1/240",), multiple=True, callback=steps_of, help="Step [s]. Default: 1/240.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True)
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Trials at once. Default: cores.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def metamorphic(
    cases: tuple[str, ...],
    engines: tuple[str, ...],
    profile: str,
    steps: tuple[str, ...],
    out: Path,
    jobs: int,
    as_json: bool,
) -> None:
    """Tell scenes differently (shifted, turned, mirrored, in other units, ...) and say what does not map along.

    CASE is a family, a case, a glob or a scene file; none means a set of cases that are not chaotic. No truth is
    needed. Writes OUT/metamorphic.json, and the report where OUT/results.json stands. Exit code 3: nothing was
    measured.
    """
    from impactbench.reports.metamorphic import DEFAULT

    if len(steps) != 1:
        raise click.UsageError(f"metamorphic takes one step; got {', '.join(steps)}")
    chosen, contestants = cases_of(cases or DEFAULT), contestants_of(engines, profile)
    folder = writable_folder(out)

    from impactbench.reports import metamorphic as relations

    with progress_bar() as progress:
        part = relations.metamorphic(chosen, contestants, steps[0], jobs, progress)
    publish(folder, "metamorphic", part, as_json, relations.text)
    if not any(trial["state"] == "ok" for trial in part["trials"]):
        raise click.exceptions.Exit(3)
