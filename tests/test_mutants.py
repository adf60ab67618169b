"""A handful of the seeded faults of `make mutants`, and that none of the list has gone stale."""

from __future__ import annotations

import importlib
from pathlib import Path

import mutants
import pytest  # puts the fakes on the path
from measure_mutants import CHANGES

FEW = ("free_flight[dimension=1]", "equal_masses[bounciness=0.5]", "static_wall[bounciness=0.5]")


def test_a_few_seeded_faults_fail_the_right_check() -> None:
    expected = {"MomentumLeak": "momentum", "SmallerE": "restitution", "MissingStatic": "penetration"}
    rows = {row["name"]: row for row in mutants.outcomes([*expected, "PotentialSign"], own_tests=False, flat=FEW)}
    for name, check in expected.items():
        assert (rows[name]["exit code"], rows[name]["caught by"]) == (1, "check"), rows[name]
        assert check in rows[name]["checks"]
    assert rows["PotentialSign"]["exit code"] == 1
    assert {"energy-gain", "energy-loss"} & set(rows["PotentialSign"]["checks"])


@pytest.mark.parametrize("name", CHANGES)
def test_every_fault_of_a_measure_still_has_its_line(name: str) -> None:
    change = CHANGES[name]
    module = importlib.import_module(f"impactbench.reports.{change.module}")
    assert module.__file__
    assert Path(module.__file__).read_text(encoding="utf-8").count(change.old) == 1
    assert change.old != change.new
