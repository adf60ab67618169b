"""`impactbench predictability`: how long a scene's motion can be known."""

from __future__ import annotations

import os
from pathlib import Path

import click
from impactbench.reports.options import cases_of, contestants_of, progress_bar, publish, writable_folder


@click.command()
@click.argument("cases", nargs=-1, metavar="[CASE ...]")
@click.option("--engine", "engines", multiple=True, help="Who runs the copies. Default: the finest reference.")
@click.option("--profile", type=click.Choice(["default", "tuned", "both"]), default="both", show_default=True)
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True)
@click.option("--jobs", type=click.IntRange(1, 256), default=os.cpu_count, help="Cases at once. Default: cores.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def predictability(
    cases: tuple[str, ...], engines: tuple[str, ...], profile: str, out: Path, jobs: int, as_json: bool
) -> None:
    """Run perturbed copies of scenes and say how their spread grows and until when the motion can be known.

    CASE is a family, a case, a glob or a scene file. Writes OUT/predictability.json, and the report where
    OUT/results.json stands. Exit code 3: nothing was measured.
    """
    from impactbench.reports import predictability_view as horizons

    chosen = cases_of(cases or horizons.DEFAULT)
    contestants, folder = contestants_of(engines, profile) if engines else (), writable_folder(out)
    with progress_bar() as progress:
        part = horizons.predict(chosen, contestants, jobs, progress)
    publish(folder, "predictability", part, as_json, horizons.text)
    if not any(row["state"] == "ok" for row in part["rows"]):
        raise click.exceptions.Exit(3)
