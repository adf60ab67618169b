"""The figures as one table: the frame that loads, and the files it is written to."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pandas as pd
import pytest
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reports import compare as comparison
from impactbench.reports import load, results
from impactbench.scenarios.catalogue import select


def test_frame_csv_and_parquet_hold_every_figure_to_the_bit(tmp_path: Path) -> None:
    contestants = select_contestants(["pymunk/tuned", f"{Path(__file__).parent / 'fakes' / 'faults.py'}:Raising"])
    document = comparison.compare(comparison.Plan(select(["free_flight[dimension=1]"]), contestants, ("1/60",)), "test")
    results.save(document, tmp_path / "results.json")
    frame = load(tmp_path)
    assert {"wall_time", "wall_time_low", "wall_time_high", "position_error"} <= set(frame["measure"].dropna())
    assert list(frame["value"].dropna()) == [row["value"] for row in document["rows"]]
    assert list(frame[frame["measure"].isna()]["state"]) == ["error"]  # a cell without figures keeps its row
    csv, parquet = tmp_path / "a.csv", tmp_path / "a.parquet"
    table = results.export(document, csv, parquet)
    assert len(table) == len(frame)
    read = pd.read_csv(csv)
    for found in (read, pd.read_parquet(parquet)):
        assert list(found.columns) == list(frame.columns)
        assert list(found["value"].dropna()) == [row["value"] for row in document["rows"]]
        assert json.loads(found["settings"].iloc[0]) == document["cells"][0]["settings"]


def test_a_missing_extra_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    document = {"cells": [{"case": "a", "settings": {}}], "rows": []}
    with pytest.raises(results.ResultsError, match=r"pip install 'impactbench\[parquet\]'"):
        results.export(document, tmp_path / "a.csv", tmp_path / "a.parquet")
    assert list(tmp_path.iterdir()) == []
