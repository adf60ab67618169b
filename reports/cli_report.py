"""Commands on results that are there already: render them again, or compare two of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

MARKDOWN_HELP = "Also as Markdown (a pull request, a CI step's summary) into FILE; - prints it and writes no page."


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--markdown", "text", metavar="FILE", help=MARKDOWN_HELP)
def report(folder: Path, text: str | None) -> None:
    """Render FOLDER/report.html again from FOLDER/results.json."""
    document = _read(folder / "results.json")
    if text is not None:
        from impactbench.reports import summary

        _write_text(summary.markdown(document), text)
        if text == "-":
            return
    from impactbench.reports import page

    _saved(folder / "report.html", lambda path: page.write_page(document, path))
    click.echo(f"report: {folder / 'report.html'}")


@click.command()
@click.argument("before", metavar="A", type=click.Path(path_type=Path))
@click.argument("after", metavar="B", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), default=Path("diff.html"), show_default=True)
@click.option("--markdown", "text", metavar="FILE", help=MARKDOWN_HELP)
@click.option("--json", "as_json", is_flag=True, help="Print every figure's verdict as JSON and write no page.")
def diff(before: Path, after: Path, out: Path, text: str | None, as_json: bool) -> None:
    """Compare two results, A before and B after: files, or folders that hold a results.json.

    Says for every case, policy and measure: better, worse, no significant change, or not comparable and why. It
    judges nothing: the exit code is 0 whatever it finds.
    """
    documents = [_read(path / "results.json" if path.is_dir() else path) for path in (before, after)]

    from impactbench.reports import diff as difference
    from impactbench.reports import diff_page, diff_text

    found = difference.compare(*documents)
    if as_json:
        import json

        click.echo(json.dumps(diff_text.as_json(found), indent=1, allow_nan=False))
        return
    if text is not None:
        _write_text(diff_text.markdown(found), text)
        if text == "-":
            return
    _saved(out, lambda path: diff_page.write_page(found, path))
    click.echo(diff_text.terminal(found))
    click.echo(f"report: {out}")


def _read(path: Path) -> dict[str, Any]:
    from impactbench.reports import results

    try:
        return results.read(path)
    except results.ResultsError as error:
        raise click.UsageError(str(error)) from None


def _write_text(text: str, name: str) -> None:
    from impactbench.reports import results

    if name == "-":
        click.echo(text, nl=False)
    else:
        _saved(Path(name), lambda path: results.write_text(path, text))


def _saved(path: Path, write: Callable[[Path], None]) -> None:
    """Write a file; what keeps it from being written is the user's to mend."""
    try:
        write(path)
    except OSError as error:
        raise click.UsageError(f"cannot write {path}: {error.strerror}") from None
