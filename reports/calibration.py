"""Are the measures right? They are run on motions whose every fault was put there, of a known size.

    wrong = faults()      # empty, or one line for each figure that is not the known one

`impactbench check` asks this before it judges: a measure that hides a fault would pass every engine. The motions
(`calibration_runs`) are closed forms; no engine, no reference and no catalogue has a part in them. Below 0.2 s.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable

from impactbench.reports.calibration_runs import STEP, Probe, probes
from impactbench.reports.measures import measure

ROUND_OFF = 100 * 4 * sys.float_info.epsilon / STEP
"""2e-11: figures follow from coordinates up to 4 m, each rounded to 4 eps, as difference quotients over one step, and
sum or square some hundred of them. The smallest seeded fault gives 1e-6."""


def faults(chosen: Iterable[Probe] = ()) -> list[str]:
    """One line for each figure of a probe that differs from the known one by more than round-off, or is not there."""
    return [line for probe in chosen or probes() for line in _faults_of(probe)]


def _faults_of(probe: Probe) -> list[str]:
    try:
        found = {figure.measure: figure.value for figure in measure(probe.case, probe.law, probe.run)}
    except (ArithmeticError, AssertionError, LookupError, TypeError, ValueError) as error:
        return [f"{probe.what}: {type(error).__name__}: {error}"]
    lines = []
    for name, known in probe.known.items():
        if name not in found:
            lines.append(f"{probe.what}: no {name}, but it is {known:.9g}")
        elif not abs(found[name] - known) <= ROUND_OFF:  # NaN is no known figure either
            lines.append(f"{probe.what}: {name} comes out as {found[name]:.9g}, but is {known:.9g}")
    return lines
