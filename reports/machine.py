"""Where figures were made, and whether a machine is fit to take times: what else runs, how steady its clock is."""

from __future__ import annotations

import platform
import socket
import statistics
import subprocess
import time
from pathlib import Path
from typing import Any

from impactbench.adapters.isolation import Job

CHECKS = ("before", "after")
REPEATS = 60
LOOP = 40_000
"""Additions in one turn of the loop: some 2 ms, long against a timer and short against a time slice."""
UNSTEADY = 0.05
"""Part by which the same loop may differ: as much as the interval of a median of ten is wide on a quiet machine."""


def clock_seconds() -> float:
    """What the harness' clock adds to a timed run [s]: the median of a thousand runs of nothing."""
    found = []
    for _turn in range(1000):
        start = time.perf_counter()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


def check_job(key: str) -> Job:
    """A check by the process that takes the times, just before or after it does."""
    return Job(key, "timing", "impactbench.reports.machine:condition", None, 60.0)


def condition(_: object = None) -> dict[str, Any]:
    """How this machine is now, from one loop repeated.

    others: programs that ran or wanted to beside this one, on average; fastest, median [s]: one turn of the loop;
    taken: part of the time in which the processor did something else.
    """
    others, turns = [], []
    begun, used = time.perf_counter(), time.process_time()
    for _turn in range(REPEATS):
        turns.append(_turn_seconds())
        others.append(_running() - 1)
    wall, cpu = time.perf_counter() - begun, time.process_time() - used
    return {
        "host": socket.gethostname(),
        "processor": processor(),
        "others": round(statistics.fmean(others), 2),
        "fastest": min(turns),
        "median": statistics.median(turns),
        "taken": round(max(0.0, 1 - cpu / wall), 3),
    }


def _turn_seconds() -> float:
    start, total = time.perf_counter(), 0
    for number in range(LOOP):
        total += number
    return time.perf_counter() - start


def _running() -> int:
    """Programs that run or want to, this one included; 1 where the system does not say."""
    try:
        return int(Path("/proc/loadavg").read_text(encoding="ascii").split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return 1


def notes(checks: dict[str, Any], elsewhere: bool) -> list[str]:
    """What a reader must know of the machine that took the times, a line each; nothing of a quiet one."""
    found = []
    before, after = checks.get("before"), checks.get("after")
    for when, check in (("before", before), ("after", after)):
        found += _disturbed(check, when) if check else []
    if before and after and abs(after["fastest"] / before["fastest"] - 1) > UNSTEADY:
        change = after["fastest"] / before["fastest"] - 1
        told = f"{abs(change):.0%} {'longer' if change > 0 else 'less'} after them than before"
        found.append(f"the processor's pace changed while times were taken: the same loop took {told}")
    if elsewhere and before:
        found.append(f"times were taken by worker {before['host']} ({before['processor']})")
    return found


def _disturbed(check: dict[str, Any], when: str) -> list[str]:
    slower = check["median"] / check["fastest"] - 1
    signs = []
    if check["others"] > 0.5:
        signs.append(f"{check['others']:.1f} other programs ran")
    if check["taken"] > UNSTEADY:
        signs.append(f"{check['taken']:.0%} of the processor's time was not ours")
    if slower > UNSTEADY:
        signs.append(f"the same loop took {slower:.0%} longer than at best")
    return [f"the machine was busy just {when} times were taken: {', '.join(signs)}"] if signs else []


def processor() -> str:
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def commit() -> str | None:
    """Commit of the checkout this runs from; None for an installed package."""
    command = ["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "--short=12", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None
