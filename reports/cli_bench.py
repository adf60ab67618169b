"""`impactbench bench`: speed of the reference, against the engines and against its own size."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME ...]")
@click.option("--quick", is_flag=True, help="Fewer rounds and smaller sizes: under a minute, less sure.")
@click.option("--json", "file", type=click.Path(path_type=Path, dir_okay=False), help="Write the figures to this file.")
def bench(names: tuple[str, ...], quick: bool, file: Path | None) -> None:
    """Measure speed: paired, interleaved ratios against the engines, growth with size, start-up.

    NAME is a benchmark (gas, growth, ...); none means all. Ratios say how many times faster the reference is. Run it on
    a machine that does nothing else.
    """
    from impactbench.reports import bench as benchmarks
    from impactbench.reports import results

    try:
        chosen = benchmarks.chosen(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if file is not None and not file.parent.is_dir():
        raise click.UsageError(f"cannot write {file}: there is no folder {file.parent}")
    from impactbench.reports.bench_text import text_of

    document: dict[str, Any] = {"machine": benchmarks.machine(), "quick": quick, "benchmarks": {}}
    click.echo("compiling the kernels, or loading them from an earlier run ...", err=True)
    from impactbench.reference.warm_up import warm_up, warm_up_crowds

    warm_up()
    warm_up_crowds()
    for name in chosen:
        part = document["benchmarks"][name] = benchmarks.measure(name, quick)
        click.echo(text_of(name, part))
        sys.stdout.flush()
        if file is not None:  # after every part: what is measured stays, even if a later one fails
            try:
                results.save(document, file)
            except OSError as error:
                raise click.UsageError(f"cannot write {file}: {error.strerror}") from None
