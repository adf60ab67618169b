"""The pytest plugin as another project uses it: inner test runs that pass, fail, and leave their figures in JUnit."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import impactbench.reports.asserted  # noqa: F401 - inner runs forget what they import; numpy loads once only
import pytest

pytest_plugins = "pytester"
DOCS = Path(__file__).parents[1] / "docs"

# Two balls in a plane, masses 1 and 3, equal and opposite momenta, hit at t = 0.5 s; then a fault of known size.
RUN = """
import numpy as np
import pytest

t = np.linspace(0, 1, 101)
before = t[:, None] <= 0.5
u = np.array([[0.6, 0.0], [-0.2, 0.0]])
v = np.where(before[..., None], u, -u)
x = np.array([[-0.1, 0.0], [0.1, 0.0]]) - 0.5 * u + np.where(before, t[:, None], 1 - t[:, None])[..., None] * u
setup = dict(masses=[1, 3], radii=[0.1, 0.1])
"""


def inner(pytester: pytest.Pytester, body: str, *words: str) -> Any:
    pytester.makepyfile(RUN + body)
    return pytester.runpytest_inprocess("-p", "no:xdist", *words)


def test_a_true_run_passes_and_its_figures_reach_the_xml(pytester: pytest.Pytester) -> None:
    body = """
    @pytest.mark.conservation(momentum_drift=1e-12, energy_gain=1e-12, energy_loss=1e-12)
    def test_it(conservation):
        figures = conservation.run(t, x, v, **setup, penetration_max=1e-12, restitution_error=1e-12)
        assert figures["angular_momentum_drift"] == 0
        conservation.run(t, 2 * x, v, masses=[1, 3], name="points")
    """
    result = inner(pytester, body.replace("\n    ", "\n"), "--junit-xml=out.xml", "--strict-markers")
    result.assert_outcomes(passed=1)
    root = ElementTree.parse(pytester.path / "out.xml")
    found = {
        item.attrib["name"]: float(item.attrib["value"]) for item in root.iterfind(".//testcase/properties/property")
    }
    assert found["impactbench.momentum_drift"] < 1e-12 == found["impactbench.momentum_drift.budget"]
    assert found["impactbench.penetration_max.budget"] == 1e-12
    assert "impactbench.points.energy_gain" in found
    assert "impactbench.points.penetration_max" not in found  # points without radii never meet


# Scales of this scene, as of a scene file: speed 0.6 m/s, energy (1 + 3) kg of it, 0.72 J, of which 0.24 J are there;
# length from -0.4 - r to 0.2 + r at the start; momentum next to 3 kg at 0.6 m/s.
FAULTS = {
    # 1e-6 of each speed, both the same way after the impact: 1.2e-6 of 1.8 kg m/s.
    "momentum_drift": ("conservation.run(t, x, v + ~before[..., None] * 1e-6 * abs(u), **setup, BUDGET)", 1.2e-6 / 1.8),
    # Speeds 0.1 % up: 1.001^2 - 1 of the energy.
    "energy_gain": ("conservation.run(t, x, v * np.where(before, 1, 1.001)[..., None], **setup, BUDGET)", 2.001e-3 / 3),
    "energy_loss": ("conservation.run(t, x, v * np.where(before, 1, 0.999)[..., None], **setup, BUDGET)", 1.999e-3 / 3),
    # Radii 1 mm larger than the distance at the impact allows.
    "penetration_max": ("conservation.run(t, x, v, masses=[1, 3], radii=[0.101, 0.101], BUDGET)", 2e-3 / 0.802),
    # Sideways momenta +-3e-6 that far apart, 0.6 m at the end; next to sum m |r| |v| = 0.45 * 0.6 + 3 * 0.15 * 0.2.
    "angular_momentum_drift": (
        "w = v.copy(); w[51:, 0, 1] += 3e-6; w[51:, 1, 1] -= 1e-6; conservation.run(t, x, w, **setup, BUDGET)",
        3e-6 * 0.6 / 0.36,
    ),
    "restitution_error": ("conservation.run(t, x, v * np.where(before, 1, 0.9)[..., None], **setup, BUDGET)", 0.1),
}  # fmt: skip


def failures(pytester: pytest.Pytester, calls: dict[str, str]) -> dict[str, str]:
    """What each call, a test of its own in one inner run, fails with; empty for one that passes."""
    tests = [f"def test_{i}(conservation):\n    {call}\n" for i, call in enumerate(calls.values())]
    pytester.makepyfile(RUN + "\n".join(tests))
    found = pytester.inline_run("-p", "no:xdist")
    names = dict(zip((f"test_{i}" for i in range(len(calls))), calls, strict=True))
    told = dict.fromkeys(calls, "")
    reports = found.getreports("pytest_runtest_logreport")
    assert len({report.nodeid for report in reports}) == len(calls)
    for report in reports:
        if report.failed:
            told[names[report.nodeid.rpartition("::")[2]]] += f"{report.longrepr}"
    return told


def test_faults_fail_by_their_known_sizes_and_the_true_run_does_not(pytester: pytest.Pytester) -> None:
    calls = {measure: call.replace("BUDGET", f"{measure}=1e-9") for measure, (call, _) in FAULTS.items()}
    calls |= {f"{name}, true": f"conservation.run(t, x, v, **setup, {name}=1e-9)" for name in FAULTS}
    for name, told in failures(pytester, calls).items():
        if name.endswith(", true"):
            assert told == ""
            continue
        found = re.fullmatch(rf"not conserved in run .*:\n  {name}: (\S+) is beyond its budget 1e-09", told)
        assert found, (name, told)
        assert abs(float(found[1])) == pytest.approx(FAULTS[name][1], rel=1e-5), name


MISUSES = {
    "conservation.run(t, x, v, **setup)": "no budget is stated",
    "conservation.run(t, x, v, **setup, momentum=1)": "did you mean momentum_drift?",
    "conservation.run(t, x, v, **setup, energy_gain=float('nan'))": "finite number from 0 on",
    "conservation.run(t, x, v, masses=[1], energy_gain=1)": "masses must be 2 positive numbers",
    "conservation.run(t, x, v[:, :1], **setup, energy_gain=1)": "must have one shape",
    "conservation.run(t, x[0], v[0], **setup, energy_gain=1)": r"positions must have shape \[T, n, 3\]",
    "conservation.run(t[::-1], x, v, **setup, energy_gain=1)": "ascending",
    "conservation.run(t, x, v, masses=[1, 3], planes=[((0,0,0),(0,0,1))], energy_gain=1)": "need `radii`",
    "conservation.run(t, x, v, **setup, spins=v, energy_gain=1)": "belong together",
    "conservation.run(t, x, v, **setup, scene='equal_masses[bounciness=1]', energy_gain=1)": "not both",
    "conservation.run(t, x, v + np.where(t < 0.7, 0, np.nan)[:, None, None], **setup, energy_gain=1)": "at t = 0.7 s",
    "conservation.run(t, x, v, masses=[1, 3], penetration_max=1)": "cannot be measured in this scene",
    "conservation.engine(object, 'no_such_case', energy_gain=1)": "unknown case",
    "pass": "no run was given to it",
}  # fmt: skip


def test_no_check_passes_by_not_being_made(pytester: pytest.Pytester) -> None:
    for call, told in failures(pytester, {call: call for call in MISUSES}).items():
        assert re.search(MISUSES[call], told), (call, told)


def test_a_marker_without_the_fixture_is_an_error(pytester: pytest.Pytester) -> None:
    result = inner(pytester, "@pytest.mark.conservation(momentum_drift=1)\ndef test_it():\n    pass\n")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "takes no `conservation` fixture" in result.stderr.str()


def test_the_document_runs_as_it_stands(pytester: pytest.Pytester) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / "pytest.md").read_text(encoding="utf-8"), re.DOTALL)
    pytester.makepyfile(test_document="\n".join(blocks))
    pytester.path.joinpath("example_engine.py").write_bytes((DOCS / "example_engine.py").read_bytes())
    pytester.syspathinsert()
    pytester.runpytest_inprocess("-p", "no:xdist").assert_outcomes(passed=4)


def test_an_engine_is_judged_skipped_where_it_says_so_and_seen_failing(pytester: pytest.Pytester) -> None:
    pytester.path.joinpath("example_engine.py").write_bytes((DOCS / "example_engine.py").read_bytes())
    pytester.syspathinsert()
    body = """
from example_engine import Example

class Leaky(Example):
    def advance(self, steps):
        super().advance(steps)
        self._v *= 1 - 1e-6

@pytest.mark.conservation(energy_drift=1e-9)
@pytest.mark.parametrize("engine, case", [
    (Example, "static_wall[bounciness=1]"),
    (Leaky, "static_wall[bounciness=1]"),
    (Example, "equal_masses[bounciness=1]"),
])
def test_it(conservation, engine, case):
    conservation.engine(engine, case, step="1/60")
"""
    result = inner(pytester, body, "-rs")
    result.assert_outcomes(passed=1, failed=1, skipped=1)
    assert "balls do not meet one another here" in result.stdout.str()


def test_unused_it_costs_one_small_module() -> None:
    """The entry point is what pytest loads in every run: neither numpy nor the rest of the harness comes with it."""
    (point,) = (p for p in metadata.entry_points(group="pytest11") if p.name == "impactbench")
    code = (
        f"import pytest, sys; before = set(sys.modules); import {point.value};print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) <= {"impactbench", "impactbench.reports", point.value}
