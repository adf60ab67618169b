"""The results document: what it holds, how it is written (whole or not at all) and how it is read."""

from __future__ import annotations

import json
import os
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from impactbench.reports.damage import damage

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = 1


class ResultsError(Exception):
    """A results file cannot be read or written. One line: what, where, what is possible instead."""


def write_text(path: Path, text: str) -> None:
    """Replace `path` by a file with this text: readers see the old file or the new one, never a part."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Replace `path` by a file with this content: readers see the old file or the new one, never a part."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        # mkstemp makes files private; a report is to be read by whoever may read its folder.
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def remove_leftovers(folder: Path) -> None:
    """Remove unfinished files that a killed run left here. Only for whoever holds the folder's lock."""
    for path in folder.glob(".*.????????"):
        if re.fullmatch(r"\..+\.(json|html|csv|parquet|md|xml)\.[a-z0-9_]{8}", path.name):
            path.unlink(missing_ok=True)


def save(document: dict[str, Any], path: Path) -> None:
    """Write the document as JSON. Numbers are finite by contract: NaN or infinity raises ValueError and leaves the
    old file alone.
    """
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def load_json(path: Path) -> Any:
    """What the JSON file at `path` holds. Raises ResultsError where it is missing or broken."""
    try:
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
    except OSError as error:
        raise ResultsError(f"cannot read {path}: {error.strerror}; `impactbench compare` writes one") from None
    except (ValueError, RecursionError) as error:
        raise ResultsError(f"{path} is not a results file: {error}") from None


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no JSON number")


def read(path: Path) -> dict[str, Any]:
    """The document at `path`. Raises ResultsError where it is missing, broken or of another schema."""
    document = load_json(path)
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise ResultsError(
            f"{path} has results schema {schema!r}, this version reads {SCHEMA}: run `impactbench compare` again"
        )
    if wrong := damage(document):
        raise ResultsError(f"{path} is damaged: {wrong}; run `impactbench compare` again")
    return dict(document)


def frame(document: dict[str, Any]) -> pd.DataFrame:
    """One tidy row per cell and measure; a cell without figures keeps one row with no measure, so that nothing is
    dropped.
    """
    import pandas as pd

    cells = pd.DataFrame(document["cells"]).rename_axis("cell").reset_index()
    rows = pd.DataFrame(document["rows"], columns=["cell", "measure", "value", "unit"])
    return cells.merge(rows, on="cell", how="left")


def export(document: dict[str, Any], csv: Path | None, parquet: Path | None) -> pd.DataFrame:
    """Write the frame of a document as CSV, Parquet or both, settings as JSON text; return it as written.

    Raises ResultsError where Parquet's extra is missing, OSError where a file cannot be written.
    """
    table = frame(document)
    table["settings"] = [json.dumps(settings, sort_keys=True) for settings in table["settings"]]
    contents: dict[Path, bytes] = {}
    if csv:
        contents[csv] = table.to_csv(index=False).encode("utf-8")
    if parquet:
        try:
            contents[parquet] = table.to_parquet(engine="pyarrow", index=False)
        except ImportError:
            raise ResultsError("--parquet needs pyarrow: pip install 'impactbench[parquet]'") from None
    for path, content in contents.items():
        write_bytes(path, content)
    return table
