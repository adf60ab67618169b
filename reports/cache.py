"""Outcomes of cells, kept by what they depend on, so that a repeated or interrupted sweep runs only what is missing.

One small file an outcome: the digest of its text in the first line, then the text. Its name is the digest of everything
the figures depend on, so that a change of a scene, an engine or our code misses rather than serves what is old.
Only the accuracy lane is kept: times belong to one session.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Collection
from pathlib import Path
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import Cell, case_of
from impactbench.reports.executors import LOST
from impactbench.reports.measures import Figure
from impactbench.reports.sources import fingerprint

FAILED = ("crashed", "timed out", "error")
"""States that another run may not end in; the others are results."""
STATES = ("ok", "unsupported", "diverged", *FAILED)
UNUSED_DAYS = 30


class Cache:
    """The outcomes under `folder`; those in a state of `again` count as missing."""

    def __init__(self, folder: Path, again: Collection[str] = ()) -> None:
        self.folder = folder
        self.again = again
        self.served = 0
        self.failed = 0
        self.broken = 0
        self.refused = ""
        self._paths: dict[str, Path] = {}

    def get(self, cell: Cell, contestant: Contestant) -> dict[str, Any] | None:
        """The outcome of this cell as an earlier run left it; None where there is none that is whole."""
        path = self._paths[cell.key] = self._path(cell, contestant)
        try:
            outcome = _parse(path.read_bytes())
            os.utime(path)
        except OSError:
            return None
        except ValueError:
            self.broken += 1
            return None
        if outcome["state"] in self.again:
            return None
        self.served += 1
        self.failed += outcome["state"] in FAILED
        return outcome

    def put(self, cell: Cell, contestant: Contestant, outcome: dict[str, Any]) -> None:
        """Keep an outcome, whole or not at all. A cache that cannot be written costs a note, never the sweep."""
        if outcome["state"] == "unavailable" or outcome["reason"].startswith(LOST):
            return
        path = self._paths.get(cell.key) or self._path(cell, contestant)
        temporary = path.with_suffix(f".{os.getpid()}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # No fsync: what a power cut leaves half written fails its digest and is computed again.
            temporary.write_bytes(_text(outcome))
            temporary.replace(path)
        except OSError as error:
            self.refused = str(error.strerror)

    def notes(self, cells: int) -> list[str]:
        """What a reader of the report must know of it, a line each."""
        found = []
        if self.served:
            text = f"{self.served} of {cells} cells come from an earlier run's cache; times never do"
            again = f"; {self.failed} of them had failed: --rerun failed tries those again" if self.failed else ""
            found.append(text + again)
        if self.broken:
            found.append(f"{self.broken} files of the cache were damaged; their cells were computed again")
        if self.refused:
            found.append(f"the cache {self.folder} could not be written: {self.refused}")
        return found

    def prune(self) -> None:
        """Remove what nobody asked for in a month: outcomes of older scenes, engines and code."""
        oldest = time.time() - UNUSED_DAYS * 86400
        for path in self.folder.glob("??/*"):
            try:
                if path.stat().st_mtime < oldest:
                    path.unlink()
            except OSError:  # another sweep was faster
                continue

    def _path(self, cell: Cell, contestant: Contestant) -> Path:
        scene = case_of(cell).scene
        parts = (fingerprint(contestant), contestant, scene, cell.law, cell.model, cell.step, cell.phase)
        key = hashlib.sha256(repr(parts).encode()).hexdigest()
        return self.folder / key[:2] / key[2:]


def _text(outcome: dict[str, Any]) -> bytes:
    figures = [[figure.measure, figure.value, figure.time, figure.bodies] for figure in outcome.get("figures", [])]
    plain = {**outcome, "figures": figures} if "figures" in outcome else outcome
    text = json.dumps(plain, allow_nan=False, separators=(",", ":")).encode()
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text


def _parse(content: bytes) -> dict[str, Any]:
    """The outcome in a file. Raises ValueError where the file is not what was written."""
    digest, _, text = content.partition(b"\n")
    if hashlib.sha256(text).hexdigest().encode() != digest:
        raise ValueError("damaged")
    outcome = dict(json.loads(text))
    if "figures" in outcome:
        outcome["figures"] = [
            Figure(name, value, time, tuple(bodies)) for name, value, time, bodies in outcome["figures"]
        ]
    return outcome
