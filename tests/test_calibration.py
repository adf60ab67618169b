"""The measures give the known figures of known faults, and no seeded fault of a measure gets past that."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import mutants  # puts the fakes on the path
from impactbench.reports import calibration
from impactbench.reports.calibration_runs import probes
from measure_mutants import CHANGES

EVERY = """import importlib, json, sys, measure_mutants
found = {}
for name in measure_mutants.CHANGES:
    measure_mutants.apply(name)
    from impactbench.reports import calibration
    importlib.reload(calibration)
    found[name] = any(calibration.faults([probe]) for probe in calibration.probes())
json.dump(found, sys.stdout)
"""


def test_the_measures_are_right_and_asking_costs_little() -> None:
    assert calibration.faults() == []
    spent = time.process_time()
    calibration.faults()
    assert time.process_time() - spent < 0.2  # s; some 0.07 in fact


def test_every_figure_of_every_probe_counts() -> None:
    """Each known figure in turn is said to be another by the smallest fault looked for, 1e-6: it must be told."""
    for probe in probes():
        for name, known in probe.known.items():
            (line,) = calibration.faults([replace(probe, known={name: known + 1e-6})])
            assert probe.what in line
            assert name in line


def test_every_seeded_fault_of_a_measure_is_told() -> None:
    """Which also shows that none of them exchanges a line for one that does the same."""
    done = subprocess.run(
        [sys.executable, "-c", EVERY], env=os.environ | {"PYTHONPATH": str(mutants.FAKES)},
        capture_output=True, text=True, check=True, cwd=Path(__file__).parent.parent,
    )  # fmt: skip
    found = json.loads(done.stdout)
    assert list(found) == list(CHANGES)
    assert not [name for name, told in found.items() if not told]


def test_check_judges_nothing_with_wrong_measures() -> None:
    assert "momentum_drift comes out as" in mutants.check_refuses("MomentumAlongZ")
