"""Finished probes, kept in a file as soon as they are known, so that a search that was stopped goes on where it was.

One line of JSON a probe. A line that a kill cut short is skipped. What a probe depends on is part of its key: the
scene, the criteria, the contestant with its version, and the sources that run it.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.reports.sources import fingerprint


class ProbeStore:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, dict[str, Any]] = {}
        if path.exists():
            lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
            for line in lines:
                self._take(line)
            if lines and not path.read_bytes().endswith(b"\n"):
                with path.open("a", encoding="utf-8") as stream:
                    stream.write("\n")

    def _take(self, line: str) -> None:
        try:
            entry = json.loads(line)
            self._found[entry["key"]] = entry["probe"]
        except (ValueError, TypeError, KeyError):
            return

    def get(self, key: str) -> dict[str, Any] | None:
        return self._found.get(key)

    def put(self, key: str, probe: dict[str, Any]) -> None:
        self._found[key] = probe
        with self._path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps({"key": key, "probe": probe}, allow_nan=False) + "\n")


def key_of(contestant: Contestant, *parts: object) -> str:
    """A digest of everything that decides a probe's outcome."""
    words = [contestant.name, fingerprint(contestant), *parts]
    return hashlib.sha256("\n".join(map(repr, words)).encode()).hexdigest()[:32]
