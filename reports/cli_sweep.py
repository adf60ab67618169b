"""Options of a comparison that grows: its cache, its workers, its whole extent; and the export of its figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from impactbench.reports.cache import Cache
    from impactbench.reports.compare import Plan, Progress

FULL_HELP = "Time every case, at every phase; says beforehand how long it will take."
CACHE_HELP = "Folder of outcomes kept for the next run; remove it to clear it. Default: OUT/.cache."
RERUN_HELP = "Run cells again that the cache holds: those that crashed, timed out or raised an error; or all."
SCHEDULER_HELP = (
    "Run cells on the workers of a dask.distributed scheduler, tcp://host:8786. Times are still taken here."
)


@dataclass(frozen=True)
class Sweep:
    """How a comparison is run, as the options say."""

    full: bool
    cache: Path | None
    no_cache: bool
    rerun: str | None
    scheduler: str | None
    time_on_workers: bool

    def cache_in(self, out: Path) -> Cache | None:
        from impactbench.reports.cache import FAILED, STATES, Cache

        if self.no_cache:
            return None
        again = {None: (), "failed": FAILED, "all": STATES}[self.rerun]
        return Cache(self.cache or out / ".cache", again)

    def run(self, plan: Plan, command: str, out: Path) -> dict[str, Any]:
        """The comparison's document; says beforehand how long a full one will take, and afterwards how long it took."""
        from impactbench.reports.compare import compare
        from impactbench.reports.options import progress_bar

        cache = self.cache_in(out)
        with self.executor() as executor, progress_bar() as progress:
            expected = _forecast(plan, progress) if self.full else None
            document = compare(
                plan, command, progress, cache=cache, executor=executor, time_on_workers=self.time_on_workers
            )
        if expected is not None:
            document["provenance"]["expected_seconds"] = round(expected, 1)
            click.echo(f"measured in {document['provenance']['seconds']:.0f} s; expected were {expected:.0f} s")
        if cache:
            cache.prune()
        return document

    @contextmanager
    def executor(self) -> Iterator[Executor | None]:
        """The cluster's workers, or None for children of this process. A cluster's fault is one line."""
        if self.scheduler is None:
            yield None
            return
        from impactbench.reports import executors

        try:
            with executors.cluster(self.scheduler) as workers:
                yield workers
        except executors.ClusterError as why:
            raise click.UsageError(str(why)) from None


def _forecast(plan: Plan, progress: Progress) -> float:
    """Seconds the plan will take here; printed."""
    from impactbench.reports.compare import ROUNDS, compile_reference
    from impactbench.reports.estimate import estimate

    if any(contestant.engine == "reference" for contestant in plan.contestants):
        compile_reference(progress)
    expected = estimate(plan.cells(), plan.timed(), plan.phases[0], ROUNDS, plan.jobs)
    click.echo(str(expected))
    return expected.seconds


def sweep_options(command: Callable[..., None]) -> Callable[..., None]:
    """Adds the options; the command gets them as one argument `sweep`."""

    @wraps(command)
    def with_sweep(
        full: bool,
        cache: Path | None,
        no_cache: bool,
        rerun: str | None,
        scheduler: str | None,
        time_on_workers: bool,
        **others: Any,
    ) -> None:
        if no_cache and (cache or rerun):
            raise click.UsageError("--no-cache leaves nothing for --cache or --rerun to act on")
        if time_on_workers and not scheduler:
            raise click.UsageError("--time-on-workers needs --scheduler tcp://host:port")
        command(**others, sweep=Sweep(full, cache, no_cache, rerun, scheduler, time_on_workers))

    options = (
        click.option("--full", is_flag=True, help=FULL_HELP),
        click.option("--cache", type=click.Path(path_type=Path, file_okay=False), help=CACHE_HELP),
        click.option("--no-cache", is_flag=True, help="Neither use nor fill the cache."),
        click.option("--rerun", type=click.Choice(["failed", "all"]), help=RERUN_HELP),
        click.option("--scheduler", metavar="ADDRESS", help=SCHEDULER_HELP),
        click.option("--time-on-workers", is_flag=True, help="Take times on one of the scheduler's workers instead."),
    )
    for option in reversed(options):
        with_sweep = option(with_sweep)
    return with_sweep


@click.command()
@click.argument("source", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--csv", type=click.Path(path_type=Path, dir_okay=False), help="Write this CSV file.")
@click.option("--parquet", type=click.Path(path_type=Path, dir_okay=False), help="Write this Parquet file.")
def export(source: Path, csv: Path | None, parquet: Path | None) -> None:
    """Write the figures of OUT/results.json as one table: a row per cell and measure, times included."""
    if not (csv or parquet):
        raise click.UsageError("nothing to write: give --csv FILE, --parquet FILE or both")

    from impactbench.reports import results

    try:
        document = results.read(source / "results.json" if source.is_dir() else source)
        table = results.export(document, csv, parquet)
    except results.ResultsError as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        where = " or ".join(str(path) for path in (csv, parquet) if path)
        raise click.UsageError(f"cannot write {where}: {error.strerror}; earlier files are untouched") from None
    for path in (csv, parquet):
        if path:
            click.echo(f"{len(table)} rows: {path}")
