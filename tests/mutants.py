"""Seeded faults against the gate: python -m tests.mutants [NAME ...] [--json FILE] [--jobs N]

Every mutant is run through what `impactbench check` runs: cells in child processes, judged by the budgets. It is caught
if that gives exit code 1 (3 for what cannot be measured) by a failure that the contestant without the fault does not
have, and caught *rightly* if a check that is there for it is among them. A fault of a measure that hides faults fails
no true run: `impactbench check` itself is then started with the fault in, and must refuse to judge (exit code 3)
because its calibration (reports/calibration.py) is off; else the measures' own tests are run with it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
FAKES = HERE / "fakes"
sys.path.insert(0, str(FAKES))

CASES = (
    "free_flight", "equal_masses[bounciness=0.5]", "equal_masses[bounciness=1]",
    "unequal_masses[mass_ratio=10,bounciness=0.5]", "oblique_pair[offset=0.25,bounciness=0.5]",
    "oblique_pair[offset=0.5,bounciness=1]", "static_wall[bounciness=0]", "static_wall[bounciness=0.5]",
    "static_wall[bounciness=1]", "oblique_wall[angle=60,bounciness=0.5,dimension=2]",
    "oblique_wall[angle=45,bounciness=1,dimension=3]", "box_of_walls", "bouncing_ball[bounciness=0.5]",
    "bouncing_ball[bounciness=1]", "stacked_drop[shape=sphere,count=3]", "galilean_cannon[count=2]",
    "newtons_cradle[count=3,gap=0.01]", "mass_chain[count=4,ratio=2]", "coulomb_slide",
    "incline[angle=10]", "incline[angle=25]", "sliding_on_slab[friction=coulomb]",
)  # fmt: skip
TURNING = (
    "rolling_onset[friction=0.3]", "rolling_incline[angle=30,friction=0.5]", "rolling_incline[angle=60,friction=0.3]",
    "oblique_friction_impact[angle=30,bounciness=0.5]", "oblique_friction_impact[angle=60,bounciness=1]",
    "rigid_offset_hit[offset=0.25,bounciness=1]", "rod_drop[angle=30,bounciness=0.5]",
)  # fmt: skip
"""One or two cases a family: the gate's own default set is every case."""

EXPLAINED = {
    "Slightly": "0.1 mm at 2 m/s is 0.05 ms early, and budgets of a first-order scheme allow a step, 4.2 ms",
}
"""Survivors, each with why no check can or should see it."""


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these mutants")
    parser.add_argument("--json", type=Path, help="write the outcome here too")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args(words)
    rows = outcomes(asked.names, asked.jobs)
    print(text(rows))
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0 if all(row["caught by"] or row["name"] in EXPLAINED for row in rows) else 1


def outcomes(
    names: Sequence[str] = (), jobs: int = 2, own_tests: bool = True, flat: Sequence[str] = CASES
) -> list[dict[str, Any]]:
    """One row a mutant: name, fault, kind, exit code, what caught it ("check", "another check", "own tests" or ""),
    the failed checks, where, and why not. `flat` are the cases for what does not turn.
    """
    import law_mutants
    import measure_mutants
    from impactbench.reports.compare import compile_reference

    compile_reference(lambda *_: None)
    plain = [*law_mutants.MUTANTS]
    laws = [kind.__name__ for kind in plain if not issubclass(kind, law_mutants.Planar)]
    spins = [kind.__name__ for kind in plain if issubclass(kind, law_mutants.Planar)]
    measures = list(measure_mutants.CHANGES)
    faults = {kind.__name__: (kind.fault, kind.expected) for kind in plain}
    faults |= {name: (change.fault, ()) for name, change in measure_mutants.CHANGES.items()}
    if unknown := set(names) - set(faults):
        raise SystemExit(f"unknown mutants {', '.join(sorted(unknown))}; known: {', '.join(faults)}")
    rows = []
    for cases, base, group, file in (
        (flat, "Reference", laws, "law_mutants.py"),
        (TURNING, "Planar", spins, "law_mutants.py"),
        (flat, "Reference", [name for name in measures if "Spin" not in name], "measure_mutants.py"),
        (TURNING, "Planar", [name for name in measures if "Spin" in name], "measure_mutants.py"),
    ):
        chosen = [name for name in group if name in names or not names]
        if chosen:
            rows += judged(cases, base, chosen, file, jobs, faults)
    for row in rows:
        if row["kind"] == "measure" and not row["caught by"] and own_tests:
            if refusal := check_refuses(row["name"]):
                row |= {"caught by": "check", "exit code": 3, "checks": ["calibration"], "where": refusal}
            elif not measures_own_tests_pass(row["name"]):
                row["caught by"] = "own tests"
    return rows


def judged(
    cases: Sequence[str], base: str, names: list[str], file: str, jobs: int, faults: dict[str, Any]
) -> list[dict[str, Any]]:
    """What the gate says of each mutant beside what it says of the contestant without a fault."""
    from impactbench.adapters.contestants import select as contestants_named
    from impactbench.reports import gate
    from impactbench.reports.verdicts import exit_code
    from impactbench.scenarios.catalogue import select

    chosen = select(cases)
    contestants = contestants_named(
        [f"{FAKES / 'law_mutants.py'}:{base}", *(f"{FAKES / file}:{name}" for name in names)]
    )
    _, verdicts = gate.check_cells(gate.Selection(chosen, contestants, law="nc", jobs=jobs), "mutants")
    bad = ("failed", "error")
    healthy = {(v.case, v.check) for v in verdicts if v.contestant == f"{base}/default" and v.status in bad}
    rows = []
    for name in names:
        own = [v for v in verdicts if v.contestant == f"{name}/default"]
        failed = [v for v in own if v.status in bad and (v.case, v.check) not in healthy]
        checks = list(dict.fromkeys(v.check for v in failed))
        fault, expected = faults[name]
        kind = "law or adapter" if file == "law_mutants.py" else "measure"
        right = bool(set(checks) & set(expected)) if expected else bool(checks)
        rows.append(
            {
                "name": name,
                "fault": fault,
                "kind": kind,
                "exit code": exit_code([v for v in own if (v.case, v.check) not in healthy]),
                "caught by": "check" if right else "another check" if checks else "",
                "checks": checks,
                "expected": list(expected),
                "where": failed[0].where if failed else "",
                "why not": EXPLAINED.get(name, "") if not failed else "",
            }
        )
    return rows


WITH_FAULT = """import sys, measure_mutants
measure_mutants.apply(sys.argv.pop(1))
from impactbench.reports.cli import main
main()
"""


def check_refuses(name: str) -> str:
    """Why `impactbench check`, whose measures have the fault, judges nothing; empty where it does."""
    words = ["check", "free_flight[dimension=1]", "--engine", "pymunk"]
    done = subprocess.run(
        [sys.executable, "-c", WITH_FAULT, name, *words], env=os.environ | {"PYTHONPATH": str(FAKES)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    told = done.stderr.strip().splitlines()
    return told[-1] if done.returncode == 3 and told and told[-1].startswith("the measures are not right: ") else ""


def measures_own_tests_pass(name: str) -> bool:
    """The measures' tests, with the fault in the code they test."""
    environment = os.environ | {"IMPACTBENCH_MUTANT": name, "PYTHONPATH": str(FAKES)}
    tests = [str(HERE / "test_measures_parts.py"), str(HERE / "test_measures.py")]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "measure_mutants", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, cwd=HERE.parent)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{name}: the measures' tests could not be run: {done.stdout[-500:]}{done.stderr[-500:]}")
    return done.returncode == 0


def text(rows: list[dict[str, Any]]) -> str:
    from impactbench.reports.terminal import table

    lines = [
        [row["name"], row["fault"], str(row["exit code"]), row["caught by"] or "NOT CAUGHT",
         ", ".join(row["checks"][:4]) or row["why not"]]
        for row in rows
    ]  # fmt: skip
    caught = [row for row in rows if row["caught by"]]
    rightly = [row for row in rows if row["caught by"] == "check"]
    refused = [row for row in rows if row["checks"] == ["calibration"]]
    own = [row for row in rows if row["caught by"] == "own tests"]
    return "\n".join(
        [
            table(["mutant", "fault", "exit", "caught by", "failed checks, or why none"], lines),
            "",
            f"{len(rows)} mutants: {len(caught)} caught ({100 * len(caught) / len(rows):.1f} %), {len(rightly)} "
            f"rightly by check ({len(refused)} of them by its calibration), {len(own)} by the measures' own tests, "
            f"{len(rows) - len(caught)} not caught",
        ]
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
