"""What the commands share: options turned into cases, contestants, steps and folders, each mistake one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from impactbench.adapters.contestants import Contestant
    from impactbench.reports.compare import Progress
    from impactbench.scenarios.truth import Case


class OneLineErrors(click.Group):
    """Any mistake of the user's is one line on stderr and exit code 2."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        try:
            return super().main(*args, **{**kwargs, "standalone_mode": False})
        except click.exceptions.Exit as done:
            sys.exit(done.exit_code)
        except (click.exceptions.Abort, KeyboardInterrupt):
            click.echo("impactbench: interrupted", err=True)
            sys.exit(130)
        except click.ClickException as error:
            click.echo(f"impactbench: {' '.join(error.format_message().split())}", err=True)
            sys.exit(2)
        except OSError as error:  # a full disk under stdout, no process to be had: nothing of ours to debug
            what = f"{error.filename}: " if error.filename else ""
            click.echo(f"impactbench: {what}{error.strerror or error}", err=True)
            sys.exit(2)


def steps_of(_: click.Context, __: click.Parameter, texts: Sequence[str]) -> tuple[str, ...]:
    from impactbench.reports.cell import step_seconds

    for text in texts:
        try:
            step_seconds(text)
        except ValueError as error:
            raise click.BadParameter(str(error)) from None
    return tuple(dict.fromkeys(texts))


def contestants_of(engines: Sequence[str], profile: str) -> Sequence[Contestant]:
    """An engine named with its profile needs no `--profile`; the reference's own always pass."""
    from impactbench.adapters import contestants

    whole = [name for name in engines if "/" in name or name.endswith(".toml")]
    try:
        if profile == "all":
            return contestants.with_policies(engines)
        if whole and len(whole) == len(engines):
            return contestants.select(engines)
        return contestants.select(engines, () if profile == "both" else (profile, "stepped", "exact"))
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def cases_of(names: Sequence[str]) -> list[Case]:
    from impactbench.scenarios import catalogue

    try:
        return catalogue.select(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def writable_folder(path: Path) -> Path:
    """The folder, made if need be and ours until the command ends: another run would replace what this one writes."""
    from filelock import FileLock, Timeout
    from impactbench.reports import results

    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
        # The file stays: to remove it would let two runs hold one lock each. The system unlocks it when we die.
        lock = FileLock(path / ".lock", timeout=0)
        click.get_current_context().with_resource(lock)
        results.remove_leftovers(path)
    except Timeout:
        message = f"another run is writing to {path}; wait for it or choose another folder with --out"
        raise click.UsageError(message) from None
    except OSError as error:
        message = f"cannot write to {path}: {error.strerror}; choose another folder with --out"
        raise click.UsageError(message) from None
    return path


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar with the remaining time on stderr; nothing where stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, Any] = {}

        def show(lane: str, done: int, total: int) -> None:
            task = tasks.setdefault(lane, None) or bar.add_task(lane, total=total)
            tasks[lane] = task
            bar.update(task, completed=done)

        yield show


def publish(folder: Path, key: str, part: dict[str, Any], as_json: bool, text: Callable[[dict[str, Any]], str]) -> None:
    """Write a measured part to OUT/<key>.json and into the report beside it, and print it."""
    from impactbench.reports import results, sections

    try:
        sections.attach(folder, key, part)
    except results.ResultsError as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        raise click.UsageError(f"cannot write to {folder}: {error.strerror}") from None
    if as_json:
        import json

        click.echo(json.dumps(part, indent=1, allow_nan=False))
    else:
        click.echo(text(part))
