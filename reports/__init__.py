"""From trajectories to what a person or a CI job reads: measures, comparison, checks, renderers, command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


def load(path: str | Path) -> pd.DataFrame:
    """A `results.json` (or the folder that holds one) as one tidy pandas frame: a row per cell and measure."""
    from impactbench.reports import results

    path = Path(path)
    return results.frame(results.read(path / "results.json" if path.is_dir() else path))
