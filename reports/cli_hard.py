"""`impactbench hard`: the hard families on all contestants."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path

import click
from impactbench.reports.options import cases_of, contestants_of, progress_bar, writable_folder

NOTHING_MEASURED = 3
ENGINE_HELP = "An engine, a contestant (mujoco/tuned), a policy (mujoco/stiff) or FILE.py:Class. Repeatable."


@click.command()
@click.argument("families", nargs=-1, metavar="[FAMILY ...]")
@click.option("--engine", "engines", multiple=True, help=ENGINE_HELP)
@click.option("--full", is_flag=True, help="The large cases too; says beforehand what they may take.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True)
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Cells run at once. Default: cores.")
def hard(families: tuple[str, ...], engines: tuple[str, ...], full: bool, out: Path, jobs: int) -> None:
    """Run hard cases (tall stacks, thin walls, mass ratios, ...) and say who survives them.

    FAMILY is a hard family (tall_stack), a case (tall_stack[shape=box,count=37]) or a glob; none means all. Writes
    OUT/hard.json, which the report of `compare` in the same folder takes along. A run that was stopped goes on where it
    was. Exit code 3: nothing was measured.
    """
    from impactbench.scenarios.hard import HARD

    names = [*(families or HARD)]
    if full:
        names += [
            name for family in HARD.values() if not families or family.name in families for name in family.names()
        ]
    cases = {case.scene.name: case for case in cases_of(names)}
    core = [name for name, case in cases.items() if case.scene.family not in HARD]
    if core:
        raise click.UsageError(f"{core[0]} is no hard case; `impactbench list` names the hard families")
    contestants, folder = contestants_of(engines, "both"), writable_folder(out)
    if full:
        chosen = {case.scene.family for case in cases.values()}
        seconds = sum(family.seconds for family in HARD.values() if family.name in chosen)
        click.echo(f"the large cases may take {seconds / 60:.0f} minutes on one core with all contestants", err=True)

    from impactbench.reports import hard as hard_set
    from impactbench.reports import results, sections
    from impactbench.reports.hard_view import terminal_table

    entries = hard_set.plan(list(cases.values()), contestants, policies=not engines)
    limit = hard_set.FULL_LIMIT if full else hard_set.LIMIT
    try:
        with progress_bar() as progress:
            document = hard_set.run(entries, folder, jobs, shlex.join(["impactbench", *sys.argv[1:]]), progress, limit)
        sections.attach(folder, "hard", document)
        (folder / hard_set.LINES).unlink(missing_ok=True)
    except (results.ResultsError, OSError) as error:
        raise click.UsageError(f"cannot write to {folder}: {error}") from None
    click.echo(terminal_table(document))
    click.echo(f"all verdicts: {folder / 'hard.json'}")
    if not any(cell["state"] in ("survived", "failed", "diverged") for cell in document["cells"]):
        sys.exit(NOTHING_MEASURED)
